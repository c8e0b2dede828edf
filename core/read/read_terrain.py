"""Read terrain into the coordinate reference system of a city: TIN reliefs, OBJ meshes, and height
rasters.

Rasters are read fine around the city and coarse out to the horizon.
"""

from dataclasses import replace

import numpy as np

from ..city.terrain import HORIZON, Layer, Terrain
from ..city.transform_crs import UNITS, plane_of, transform_crs
from ..settings.errors import InputError
from .open_input import open_input, suffix_of
from .open_raster import HIGHEST, LOWEST, open_raster, read_posts, windows_around
from .parse_obj import parse_obj
from .read_relief import place_layer, read_relief

RASTERS = (".tif", ".tiff", ".asc", ".agr", ".grd")
RELIEFS = (".gml", ".citygml", ".xml")


def read_terrain(path, city, unit="m", up="z"):
    """Read a CityGML TINRelief, an OBJ mesh, a GeoTIFF or an ASC grid.

    Horizontal coordinates are transformed to the city's coordinate reference system, heights are
    converted to metres but keep their vertical datum. A file without a system is assumed to be in
    the city's.

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
    suffix = suffix_of(path)
    # By its suffix: a raster of heights, a relief, or a mesh; any other is refused.
    low, high = city.points.min(axis=0)[:2], city.points.max(axis=0)[:2]
    terrain = Terrain(str(path))
    # In each case a missing reference system, of the terrain or of the city, is noted.
    if suffix in RASTERS:
        terrain.layers = _read_raster(path, city, UNITS[unit], terrain.notes)
    elif suffix in RELIEFS:
        layers, crs = read_relief(path)
        _note_missing(crs, city.crs, path, terrain.notes)
        terrain.layers = [
            place_layer(layer, (crs, city.axes), city, UNITS[unit], path) for layer in layers
        ]
    elif suffix == ".obj":
        parts = parse_obj(path, up)
        # A face of several corners becomes a fan of triangles around its first.
        faces = [face for face in parts.faces if len(face) > 2]
        if not faces:
            raise InputError(path, "contains no polygons", "give an OBJ file of terrain")
        fans = [
            np.column_stack([np.full(len(face) - 2, face[0]), face[1:-1], face[2:]])
            for face in faces
        ]
        layer = Layer(parts.vertices, np.concatenate(fans))
        terrain.layers = [place_layer(layer, (None, city.axes), city, UNITS[unit], path)]
        _note_missing(None, city.crs, path, terrain.notes)
    else:
        raise InputError(
            path,
            "not a known terrain format",
            f"give one of {', '.join((*RASTERS, *RELIEFS, '.obj'))}",
        )
    # Some of it must lie at the city: terrain whose bounding box misses the buildings' is refused.
    points = np.concatenate([np.empty((0, 3)), *(layer.points for layer in terrain.layers)])
    if not len(points):
        raise InputError(path, "has no heights at the city", "give terrain that covers the city")
    apart = np.maximum(np.maximum(points.min(axis=0)[:2] - high, low - points.max(axis=0)[:2]), 0)
    if apart.any():
        raise InputError(
            path,
            f"is {float(np.hypot(*apart)) / 1000:,.1f} km away from the buildings",
            "give terrain that covers the city, in its system and unit",
        )
    return terrain


def _note_missing(crs, city_crs, path, notes):
    """Note which of terrain and city has no coordinate reference system, and which one is
    assumed.
    """
    if crs is None:
        notes.append(f"{path} has no coordinate reference system; the city's is assumed.")
    elif city_crs is None:
        notes.append(f"The city has no coordinate reference system; {crs} is assumed.")


def _read_raster(path, city, unit, notes, *, most_posts=400_000_000):
    """Terrain layers of a raster around a city.

    Parameters
    ----------
    path : path-like
    city : City
    unit : float
        Metres per unit of a raster without a coordinate reference system.
    notes : list of str
        Notes for the report are appended.

    Returns
    -------
    list of Layer
        Points in the city's coordinate reference system [m].

    Raises
    ------
    InputError
        Not a raster, a damaged one, or one that does not cover the city.
    """
    layers = []
    with open_raster(path) as source:
        if source.crs is None and (source.matrix == np.eye(2, 3)).all():
            raise InputError(
                path, "is not georeferenced", "give a raster with position and cell size"
            )
        _note_missing(source.crs and f"that of {path}", city.crs, path, notes)
        assumed = plane_of(city.crs)[0].to_wkt() if city.plane is not None else None
        raster = replace(source, crs=source.crs or assumed)
        # The raster is read up to 300 m around the city with 700 posts a side, further out with
        # 250.
        for reach, posts in ((300.0, 700), (HORIZON, 250)):
            for window, _ in windows_around(raster, _rectangle(reach, raster, city, unit)):
                if window[2] * window[3] > most_posts:
                    raise InputError(
                        path,
                        f"has {window[2]:,} x {window[3]:,} posts around the city",
                        f"resample it to at most {most_posts:,}",
                    )
                told = notes if not layers else []
                layers.append(
                    _read_layer(raster, window, posts, told, (city.plane or city.crs, unit))
                )
    return [layer for layer in layers if len(layer.triangles)]


def _rectangle(reach, raster, city, unit):
    """Places in a rectangle around the city and what lies within reach of it: (81, 2) in the
    raster's system.
    """
    low, high = city.points.min(axis=0)[:2] - reach, city.points.max(axis=0)[:2] + reach
    share, unit = np.linspace(0, 1, 9), _common_unit(raster, city.crs, unit)
    plane = city.plane or city.crs
    x, y = np.meshgrid(low[0] + share * (high[0] - low[0]), low[1] + share * (high[1] - low[1]))
    places = np.column_stack([x.ravel(), y.ravel()])
    return (
        places / unit if unit is not None else transform_crs(places, plane, raster.crs, raster.path)
    )


def _common_unit(raster, crs, unit):
    """Metres per unit of a raster that is taken to be in the system of the city, None where both
    have their own.
    """
    if raster.crs is None or crs is not None:
        return unit if raster.crs is None else None
    plane, _ = plane_of(raster.crs)
    if plane.is_geographic:
        raise InputError(
            raster.path,
            "is in degrees, but the city has no coordinate reference system",
            "give terrain in the city's own metres",
        )
    return plane.axis_info[0].unit_conversion_factor


def _read_layer(raster, window, posts, notes, target):
    """Triangles of a window with so many posts on a side at most, in a system and unit as of
    `_read_raster`: Layer.
    """
    path, (crs, unit) = raster.path, target
    heights, matrix = read_posts(raster, window, posts, unit)
    rows, columns = heights.shape
    gaps = int(np.isnan(heights).sum())
    if gaps:
        notes.append(
            f"{gaps} posts of {path} without a height of {LOWEST:,.0f} to {HIGHEST:,.0f} m treated "
            "as gaps."
        )
    if (columns, rows) != tuple(window[2:]):
        notes.append(f"{path}: {window[2]} x {window[3]} posts resampled to {columns} x {rows}.")
    y, x = np.mgrid[:rows, :columns]
    places = np.column_stack([x.ravel(), y.ravel(), np.ones(rows * columns)]) @ matrix.T
    unit = _common_unit(raster, crs, unit)
    places = transform_crs(places, raster.crs, crs, path) if unit is None else places * unit
    # Two triangles per cell of four posts, none over a gap.
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    triangles = np.concatenate(
        [np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, d, c), (a, c, b))]
    )
    whole = np.isfinite(heights.ravel()[triangles]).all(axis=1)
    return Layer(np.column_stack([places, heights.ravel()]), triangles).take(whole)
