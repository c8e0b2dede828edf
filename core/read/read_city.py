"""Read buildings of every format: files and folders to a City."""

import re
from contextlib import suppress
from pathlib import Path

from ..city.join_contents import join_contents
from ..settings.errors import InputError
from ..settings.progress import silent
from .footprint_heights import HeightHints
from .formats import SUFFIXES, format_of
from .open_input import suffix_of
from .parse_json import speaks_of_cityjson
from .read_citygml import read_citygml
from .read_cityjson import read_cityjson
from .read_footprints import read_footprints
from .read_gdal import read_geoparquet, read_vector
from .read_geojson import read_geojson
from .read_geopackage import read_geopackage
from .read_obj import read_obj
from .read_osm import read_osm
from .read_relief import place_relief

# of the table in `formats`
READERS = {
    "citygml": read_citygml,
    "cityjson": read_cityjson,
    "geojson": read_geojson,
    "geopackage": read_geopackage,
    "osm": read_osm,
    "vector": read_vector,
    "geoparquet": read_geoparquet,
    "obj": read_obj,
}
READING = "reading files"  # name of the stage


def read_city(paths, lod=None, unit="m", up="z", *, orient="auto", progress=silent, hints=None):
    """Read files and folders of buildings into one City.

    Parameters
    ----------
    paths : path-like or list of path-like
        Files or folders; of a folder all files with buildings are read.
    lod : str, optional
        Level of detail; by default each building's best of 2.x, else 3, else 1.
    unit : {'m', 'ft', 'us-ft', 'mm', 'cm', 'in', 'auto'}
        Of coordinates in files without a coordinate reference system; auto: by the heights of
        buildings.
    up : {'z', 'y', 'auto'}
        Vertical axis, for formats that do not define it; auto: by where floors lie.
    orient : {'auto', 'as-drawn'}
        Flip polygons that face into their building, or keep all as drawn.
    progress : callable, optional
        See `core.settings.progress`: bytes of the files, then polygons joined. If cancelled,
        nothing is kept.
    hints : PlaceHints, optional
        What the user tells of the place of the city, and of the heights of outlines.

    Returns
    -------
    City
        With the terrain of its files, where they hold any.

    Raises
    ------
    InputError
        A file cannot be used, or a folder has none.
    """
    if up not in ("z", "y", "auto"):
        raise InputError("--up", f"{up!r} is not an axis", "choose z, y or auto")
    contents = _read_files(_list_files(paths), up, progress)
    read_footprints(contents, (hints and hints.heights) or HeightHints())
    city = join_contents(
        contents, lod=lod, unit=unit, orient=orient, progress=progress, hints=hints
    )
    city.terrain = place_relief(contents, city, city.report.unit)
    return city


def _read_files(files, up, progress=silent):
    """Contents of files, one after the other.

    Returns
    -------
    list of FileContent
    """
    sizes = [file.stat().st_size if file.is_file() else 0 for file in files]
    total, done, contents = max(sum(sizes), 1), 0, []
    progress(READING, 0, total, "B")

    def report_share(share):
        # All of a file is reached only when it is completely parsed.
        progress(READING, done + min(share, 0.99) * size, total, "B")

    for file, size in zip(files, sizes, strict=True):
        reader = READERS[format_of(file).reader]
        contents.append(reader(file, *((up,) if reader is read_obj else ()), report_share))
        done += size
        progress(READING, done, total, "B")
    return contents


def _list_files(paths):
    """Expand files and folders to files, sorted by name within a folder.

    Returns
    -------
    list of Path

    Raises
    ------
    InputError
        A path cannot be looked at, or a folder has no building files.
    """
    files = []
    # A file that cannot be looked at is told at once; a missing one when it is opened.
    for path in [paths] if isinstance(paths, (str, Path)) else paths:
        try:
            with suppress(FileNotFoundError):  # refused when it is opened
                Path(path).stat()
        except OSError as error:
            raise InputError(
                path, f"cannot be read ({error.strerror})", "check the path"
            ) from error
        if not Path(path).is_dir():
            files.append(Path(path))
            continue
        # Of a folder: all files of known types.
        inside = sorted(
            file for file in Path(path).iterdir() if file.is_file() and suffix_of(file) in SUFFIXES
        )
        # JSON is taken where it is CityJSON, GeoJSON or of OpenStreetMap; XML beside a map only
        # describes it.
        inside = [
            file
            for file in inside
            if not re.search(r"\.(shp|gpkg|fgb)\.xml$", file.name.lower())
            and (
                suffix_of(file) not in (".json", ".jsonl")
                or speaks_of_cityjson(file)
                or format_of(file).reader in ("geojson", "osm")
            )
        ]
        if not inside:
            raise InputError(
                path, "a folder without building files", f"known types are {', '.join(SUFFIXES)}"
            )
        files += inside
    return files
