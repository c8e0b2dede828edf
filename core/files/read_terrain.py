"""Read terrain of any supported format into the coordinate reference system of a city."""

from pathlib import Path

import numpy as np

from ..city.convert_to_metres import UNITS
from ..ground.terrain import HORIZON, Layer, Terrain
from ..settings.errors import InputError
from .open_input import open_input
from .parse_obj import parse_obj
from .place_relief import place_layer
from .read_raster import Wanted, read_raster
from .read_relief import read_relief

RASTERS = (".tif", ".tiff", ".asc", ".agr", ".grd")
RELIEFS = (".gml", ".citygml", ".xml")
KNOWN = (*RASTERS, *RELIEFS, ".obj")


def read_terrain(path, city, unit="m", up="z"):
    """Read a CityGML TINRelief, an OBJ mesh, a GeoTIFF or an ASC grid.

    Horizontal coordinates are transformed to the city's coordinate reference system, heights are converted to metres
    but keep their vertical datum. A file without a system is assumed to be in the city's.

    Parameters
    ----------
    path : path-like
        Plain or gzip-compressed.
    city : City
    unit : {'m', 'ft', 'us-ft'}
        Of files without a coordinate reference system.
    up : {'z', 'y'}
        Of OBJ files.

    Returns
    -------
    Terrain
        Points in the city's system [m].

    Raises
    ------
    InputError
        The file cannot be read, or lies outside the city.
    """
    open_input(path).close()
    suffixes = [suffix.lower() for suffix in Path(path).suffixes if suffix.lower() != ".gz"]
    suffix = suffixes[-1] if suffixes else ""
    low, high = city.points.min(axis=0)[:2], city.points.max(axis=0)[:2]
    terrain = Terrain(str(path))
    if suffix in RASTERS:
        terrain.layers = read_raster(Wanted(path, low, high, HORIZON, city.crs, UNITS[unit]), terrain.notes)
    elif suffix in RELIEFS:
        layers, crs = read_relief(path)
        _note_missing(crs, city.crs, terrain)
        terrain.layers = [place_layer(layer, crs, city.crs, UNITS[unit], path) for layer in layers]
    elif suffix == ".obj":
        terrain.layers = [_read_obj(path, UNITS[unit], up)]
        terrain.notes.append(f"{path} has no coordinate reference system; the city's is assumed.")
    else:
        raise InputError(path, "not a known terrain format", f"give one of {', '.join(KNOWN)}")
    _check_place(terrain, low, high)
    return terrain


def _read_obj(path, factor, up):
    parts = parse_obj(path)
    if not any(len(face) > 2 for face in parts.faces):
        raise InputError(path, "contains no polygons", "give an OBJ file of terrain")
    points = parts.vertices if up == "z" else parts.vertices[:, [0, 2, 1]] * [1.0, -1.0, 1.0]
    fans = [np.column_stack([np.full(len(f) - 2, f[0]), f[1:-1], f[2:]]) for f in parts.faces if len(f) > 2]
    return Layer(points * factor, np.concatenate(fans))


def _note_missing(crs, city_crs, terrain):
    """Note which of relief and city has no coordinate reference system, and which one is assumed."""
    if crs is None or city_crs is None:
        own = f"{terrain.source} has no coordinate reference system; the city's is assumed."
        terrain.notes.append(own if crs is None else f"The city has no coordinate reference system; {crs} is assumed.")


def _check_place(terrain, low, high):
    points = np.concatenate([layer.points for layer in terrain.layers]) if terrain.layers else np.empty((0, 3))
    if not len(points):
        raise InputError(terrain.source, "has no heights at the city", "give terrain that covers the city")
    apart = np.maximum(np.maximum(points.min(axis=0)[:2] - high, low - points.max(axis=0)[:2]), 0)
    if apart.any():
        distance = float(np.hypot(*apart))
        problem = f"is {distance / 1000:,.1f} km away from the buildings"
        raise InputError(terrain.source, problem, "give terrain that covers the city, in its system and unit")
