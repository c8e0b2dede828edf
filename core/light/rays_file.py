"""rays.nc: a traced city that can be edited later, with what its rays and suns met, and all that it
was made of.

The file holds a tree of values as JSON, and the arrays of that tree as variables. Only the types
below are read, so that a file cannot bring code along.
"""

import json
import shlex
import shutil
import tempfile
import weakref
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from zlib import crc32

import h5py
import numpy as np

from ..city.build_ground import Lattice
from ..city.city import City, ImportReport, Polygon, Tree
from ..city.scene import Crowns, Scene, Surfaces
from ..city.site import Site
from ..city.terrain import Layer, Terrain
from ..modules.lay_modules import ModuleLayout
from ..read.netcdf_file import netcdf_file, refuse_links
from ..settings.errors import InputError, build_from
from ..settings.request import Request
from ..sky.horizon import TerrainHorizon
from ..sun.suns import Suns
from .annual_light import Annual
from .compact_city import compact_city
from .editable_city import Decisions, restore_editable
from .form_factors import FormFactors, Rows
from .light_errors import LightError
from .packed_bits import PackedBits
from .solve_light import Light
from .solve_suns import SunLight
from .traced import FirstLight, Traced

NAME, FORMAT = "rays.nc", "CityPV rays, format 7"
GIVE_EDITABLE = "give the folder of citypv simulate --editable"
TYPES = (
    City,
    ImportReport,
    Polygon,
    Tree,
    Site,
    Layer,
    Terrain,
    Decisions,
    FirstLight,
    FormFactors,
    ModuleLayout,
    PackedBits,
    Rows,
    Traced,
)
TYPES += (
    Lattice,
    Scene,
    Surfaces,
    Crowns,
    TerrainHorizon,
    Suns,
    Light,
    SunLight,
    Annual,
    LightError,
)
TYPES = {one.__name__: one for one in TYPES}
FILES = (
    "albedo_file",
    "terrain",
    "horizon",
    "leave_out",
)  # settings that name a file, which is kept too


@dataclass
class _KeptRays:
    """What rays.nc holds."""

    city: City  # as read
    scene: Scene
    request: Request  # its files lie in a temporary folder
    names: dict  # of these settings: the files that were given
    decisions: Decisions
    traced: dict  # of `_keep_traced`
    drift: float  # as of EditableCity

    def restore(self, transfer, rules):
        """The traced city as it was, with its Transfer; `rules` are of its PreparedScene:
        EditableCity.
        """
        return restore_editable(
            self.scene,
            self.request,
            transfer,
            decisions=self.decisions,
            kept=self.traced | {"rules": rules},
            drift=self.drift,
        )


def write_rays(folder, base, city, names=None):
    """Write rays.nc into a folder.

    Parameters
    ----------
    folder : path-like
    base : EditableCity
    city : City
        Of which its scene was made.
    names : dict, optional
        Settings that name other files than those that are kept: as they were given.

    Raises
    ------
    InputError
        Materials have no file.
    """
    # All that a later edit starts from: the city, its scene and settings, what was decided, and
    # what the rays and suns met. Rows of patches that are gone are dropped first.
    base, request = compact_city(base), base.request
    # Materials given in Python could not be read again.
    if request.materials:
        raise InputError(
            "--editable", "materials were given in Python alone", "give them by --albedo-file"
        )
    # Files that the settings name go into it, as they may have changed when it is read.
    files = {}
    for name in FILES:
        source = getattr(request, name)
        if source is not None:
            files[name] = [Path(source).name, np.frombuffer(Path(source).read_bytes(), np.uint8)]
    content = {
        "city": city,
        "scene": base.scene,
        "request": request.as_dict() | dict.fromkeys(FILES) | {"site_of": None},
        "files": files,
        "names": {name: getattr(request, name) for name in files} | (names or {}),
        "decisions": base.decisions,
        "drift": base.drift,
        "traced": _keep_traced(base.city),
    }
    # Plain values as JSON, arrays as data sets that it refers to by number, with a checksum.
    # Data sets get no netCDF dimensions: hundreds of these, which nobody asks for, would take
    # longer to write than all numbers.
    arrays = []
    text = json.dumps(encode(content, arrays)).encode()
    with netcdf_file(Path(folder) / NAME) as stream, h5py.File(stream, "w") as file:
        file.attrs["title"] = FORMAT
        for number, array in enumerate(arrays):
            file[f"array_{number}"] = array
        file["content"] = np.frombuffer(text, np.uint8)
        file["content"].attrs["crc32"] = crc32(text)


def _keep_traced(city):
    """What edits need of a TracedCity: dict as of `restore_editable`."""
    states = [
        {
            "traced": state.traced,
            "lights": state.lights,
            "direct": replace(
                state.direct, visible_share=None, reflected=None, string_loss=None, specular=0.0
            ),
        }
        for state in city.states
    ]
    kept = {"bits": city.bits, "cramped": city.cramped, "layout": city.context.layout}
    return kept | {"states": states}


def read_rays(folder):
    """Read rays.nc of a result folder: KeptRays.

    Raises
    ------
    InputError
        There is none, it is damaged, of another version, or takes values from other files.
    """
    # What an edit starts from, as `write_rays` left it. Its format and checksum must hold before
    # anything is built from it.
    path = Path(folder) / NAME
    if not path.is_file():
        raise InputError(path, "there is no such file, so this run cannot be edited", GIVE_EDITABLE)
    with InputError.parsing(path, "cannot be read", GIVE_EDITABLE):
        refuse_links(path)
    with InputError.parsing(path, "cannot be read", GIVE_EDITABLE), h5py.File(path) as file:
        if file.attrs.get("title") != FORMAT:
            raise InputError(
                path,
                f"is of another version, not of {FORMAT!r}",
                f"trace the city again: {_command_again(folder)}",
            )
        text = file["content"][:].tobytes()
        if crc32(text) != file["content"].attrs["crc32"]:
            raise InputError(path, "is damaged", "trace the city again with --editable")
        arrays = {name: file[name][...] for name in file if name.startswith("array_")}
    # From JSON and arrays back to a request and what rays met.
    try:
        kept_rays = decode(json.loads(text), arrays)
        request, files = build_from(Request, kept_rays.pop("request")), kept_rays.pop("files")
        kept = build_from(_KeptRays, {"request": request, **kept_rays})
    except ValueError as error:
        raise InputError.blame(path, "cannot be read", error, GIVE_EDITABLE) from error
    # Files that it carries are laid out again, until nobody needs them.
    place = tempfile.mkdtemp(prefix="citypv-")
    weakref.finalize(kept, shutil.rmtree, place, ignore_errors=True)
    for name, (file_name, data) in files.items():
        own = Path(place, Path(file_name).name)
        own.write_bytes(data.tobytes())
        setattr(request, name, str(own))
    return kept


def _command_again(folder):
    """The command that computes a result folder again so that it can be edited, from its
    summary.json: str.
    """
    try:
        summary = json.loads((Path(folder) / "summary.json").read_text("utf-8"))
    except (OSError, ValueError):
        return f"citypv simulate CITY --editable --overwrite --out {shlex.quote(str(folder))}"
    files = " ".join(shlex.quote(str(file)) for file in summary["input"]["report"]["files"])
    options = Request.write_options(summary["settings"])
    return " ".join(
        filter(
            None,
            [
                "citypv simulate",
                files,
                options,
                "--editable --overwrite --out",
                shlex.quote(str(folder)),
            ],
        )
    )


def encode(value, arrays):
    """A value as plain types, with its arrays appended to a list."""
    if isinstance(value, np.ndarray | np.generic) and value.dtype.kind in "OU":
        return {"texts": np.asarray(value).tolist()}
    if isinstance(value, np.ndarray | np.generic):
        array = np.asarray(value).view(np.uint8) if value.dtype.kind == "b" else np.asarray(value)
        arrays.append(array)
        sort = {"dtype": value.dtype.str, "scalar": isinstance(value, np.generic)}
        return {"array": len(arrays) - 1, "crc32": crc32(np.ascontiguousarray(array)), **sort}
    if is_dataclass(value) or hasattr(value, "_asdict"):
        names = [field.name for field in fields(value)] if is_dataclass(value) else value._fields
        own = {
            name: encode(getattr(value, name), arrays) for name in names if name not in ("links",)
        }
        return {"type": type(value).__name__, "fields": own}
    if isinstance(value, dict):
        return {"dict": [[encode(key, arrays), encode(one, arrays)] for key, one in value.items()]}
    if isinstance(value, list | tuple):
        return {type(value).__name__: [encode(one, arrays) for one in value]}
    return str(value) if isinstance(value, Path) else value


def decode(value, arrays):
    """The value that `encode` was given; `arrays` by their names in the file.

    Raises
    ------
    ValueError
        An array is damaged, or a type has other fields, as in another version.
    """
    if not isinstance(value, dict):
        return value
    if "array" in value:
        array = arrays.get(f"array_{value['array']}")
        if array is None or crc32(np.ascontiguousarray(array)) != value["crc32"]:
            raise ValueError(f"array {value['array']} is damaged")
        array = array.astype(value["dtype"], copy=False)
        return array[()] if value["scalar"] else array
    if "texts" in value:
        return np.array(value["texts"], dtype=object)
    if "type" in value:
        if value["type"] not in TYPES:
            raise ValueError(f"{value['type']} is unknown")
        # Files of version 0.2 have a field that is gone.
        given = {
            name: decode(one, arrays)
            for name, one in value["fields"].items()
            if name not in ("unseen_share",)
        }
        return build_from(TYPES[value["type"]], given)
    if "dict" in value:
        return {decode(key, arrays): decode(one, arrays) for key, one in value["dict"]}
    kind = list if "list" in value else tuple
    return kind(decode(one, arrays) for one in value[kind.__name__])
