"""Exports: files that a run writes when they are asked for, in one table.

Options of the command line, names in Python, Blender's menu and the names of results follow from
it. A new one is a line here, and a file `write_NAME.py` beside this one with a function
`write_NAME(path, run, progress)`, which is imported when it is needed.
"""

from importlib import import_module
from typing import Any, NamedTuple

from ..settings.progress import silent


class Export(NamedTuple):
    """A file that is written when it is asked for."""

    file: str  # its name in the folder of the results
    words: str  # what it holds
    title: str = ""  # in Blender's menu; "": of the light, which is written where it is traced


EXPORTS = {
    "transfer": Export("transfer.nc", "all that was traced, even if it takes gigabytes"),
    "editable": Export("rays.nc", "what citypv variant makes an edited city from"),
    "cityjson": Export("city.city.json", "the city as read with its results", "CityJSON"),
    "gltf": Export("city.glb", "the city in colours for any viewer", "glTF"),
    "geopackage": Export("city.gpkg", "surfaces and buildings for GIS", "GeoPackage"),
}
MODELS = {name: one for name, one in EXPORTS.items() if one.title}  # of the city with its results


class RunResults(NamedTuple):
    """What a run has computed."""

    city: Any  # City whose polygons are the surfaces, and
    scene: Any  # Scene; None of a Transfer that was read from a file
    transfer: Any  # Transfer
    energy: Any  # Energy
    weather: Any  # Weather


def write_exports(folder, run, exports, progress=silent):
    """Write the models of a city that are among some exports.

    Parameters
    ----------
    folder : pathlib.Path
    run : RunResults
    exports : collection of str
        Of `EXPORTS`.
    progress : callable, optional
        See `core.settings.progress`.
    """
    for name in (name for name in MODELS if name in exports):
        write = getattr(import_module(f".write_{name}", __package__), f"write_{name}")
        write(folder / MODELS[name].file, run, progress)
