"""Read a height raster, GeoTIFF or ASC: fine around the city, coarse out to the horizon."""

from typing import NamedTuple

import numpy as np

from ..city.bring_places import bring_places, full_turn, plane_of, turn_towards
from ..ground.terrain import Layer
from ..settings.errors import InputError
from .open_raster import open_raster
from .raster import average_window

NEAR = 300.0  # [m] around the city the raster is read at full resolution
NEAR_POSTS, FAR_POSTS = 700, 250  # per side; a finer raster is resampled to that many
MOST_POSTS = 400_000_000  # that are read
LOWEST, HIGHEST = (
    -500.0,
    12_000.0,
)  # [m] all land lies between; values beyond mark gaps, or the floor of the sea
WORDS = {  # in which rasters name the unit of their heights [m]
    0.3048: ("ft", "foot", "feet", "international foot"),
    1200 / 3937: ("us survey foot", "us survey feet", "us-ft", "ftus", "foot_us"),
    0.001: ("mm", "millimetre", "millimetres", "millimeter", "millimeters"),
    0.01: ("cm", "centimetre", "centimetres", "centimeter", "centimeters"),
    0.1: ("dm", "decimetre", "decimetres", "decimeter", "decimeters"),
    1.0: ("m", "metre", "metres", "meter", "meters"),
    1000.0: ("km", "kilometre", "kilometres", "kilometer", "kilometers"),
}
UNIT_WORDS = {word: factor for factor, words in WORDS.items() for word in words}


class Wanted(NamedTuple):
    """Which part of a raster is wanted, and in which coordinate reference system."""

    path: object  # of the raster
    low: np.ndarray  # (2,) float64 [m] corners of the city
    high: np.ndarray  # (2,) float64 [m]
    horizon: float  # [m] distance beyond them to which terrain is read
    crs: str | None  # of the city
    unit: float  # metres per unit of a raster without a coordinate reference system


def read_raster(wanted, notes):
    """Terrain layers of a raster around a city.

    Parameters
    ----------
    wanted : Wanted
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
    with open_raster(wanted.path) as raster:
        return _read_layers(raster, wanted, notes)


def _read_layers(raster, wanted, notes):
    path = wanted.path
    if raster.crs is None and (raster.matrix == np.eye(2, 3)).all():
        raise InputError(path, "is not georeferenced", "give a raster with position and cell size")
    source = raster.crs
    if source is None or wanted.crs is None:
        notes.append(
            f"{path} has no coordinate reference system; the city's is assumed."
            if source is None
            else f"The city has no coordinate reference system; that of {path} is assumed."
        )
    layers = []
    for reach, posts in ((NEAR, NEAR_POSTS), (wanted.horizon, FAR_POSTS)):
        window = window_between(raster, _rectangle(reach, raster, wanted))
        if window is not None and window[2] * window[3] > MOST_POSTS:
            problem = f"has {window[2]:,} x {window[3]:,} posts around the city"
            raise InputError(path, problem, f"resample it to at most {MOST_POSTS:,}")
        if window is not None:
            layers.append(_read_layer(raster, window, posts, notes if not layers else [], wanted))
    return [layer for layer in layers if len(layer.triangles)]


def _rectangle(reach, raster, wanted):
    """Bounding box, in the raster's system, of the city and what lies within reach of it."""
    source, low, high = raster.crs, wanted.low - reach, wanted.high + reach
    share = np.linspace(0, 1, 9)
    x, y = np.meshgrid(low[0] + share * (high[0] - low[0]), low[1] + share * (high[1] - low[1]))
    places = np.column_stack([x.ravel(), y.ravel()])
    if source is None:
        places = places / wanted.unit
    elif wanted.crs is None:
        places = places / _metres_per_unit(source, wanted.path)
    else:
        places = bring_places(places, wanted.crs, source, wanted.path)
        turn = full_turn(source)
        if turn is not None:  # a map may go on beyond 180°
            middle = raster.matrix[0] @ (raster.width / 2, raster.height / 2, 1)
            places[:, 0] = turn_towards(places[:, 0], turn_towards(places[0, 0], middle, turn), turn)
    return places.min(axis=0), places.max(axis=0)


def _metres_per_unit(source, path):
    plane, _ = plane_of(source)
    if plane.is_geographic:
        raise InputError(
            path,
            "is in degrees, but the city has no coordinate reference system",
            "give terrain in the city's own metres",
        )
    return plane.axis_info[0].unit_conversion_factor


def window_between(raster, corners):
    """First column, first row, columns and rows of the raster inside a rectangle of its system, or None."""
    (west, south), (east, north) = corners
    corners = np.array([(west, south), (west, north), (east, south), (east, north)])
    places = np.linalg.solve(raster.matrix[:, :2], corners.T - raster.matrix[:, 2:]).T
    first = np.maximum(np.floor(places.min(axis=0)).astype(np.int64) - 1, 0)
    last = np.minimum(np.ceil(places.max(axis=0)).astype(np.int64) + 1, (raster.width, raster.height))
    return (*first, *(last - first)) if (last - first > 1).all() else None


def _read_layer(raster, window, posts, notes, wanted):
    column, row, width, height = (int(value) for value in window)
    shape = (min(height, posts), min(width, posts))
    heights = average_window(raster, window, shape)
    source, path = raster.crs, wanted.path
    factor = height_factor(raster, source, wanted.unit)
    with np.errstate(invalid="ignore"):
        odd = (heights * factor > HIGHEST) | (heights * factor < LOWEST)
    if odd.any():
        notes.append(f"{int(odd.sum())} heights of {path} beyond {LOWEST:,.0f} to {HIGHEST:,.0f} m treated as gaps.")
    heights[odd | ~np.isfinite(heights)] = np.nan
    if shape != (height, width):
        notes.append(f"{path}: {width} x {height} posts resampled to {shape[1]} x {shape[0]}.")
    y, x = np.mgrid[: shape[0], : shape[1]]
    pixels = column + (x.ravel() + 0.5) * width / shape[1], row + (y.ravel() + 0.5) * height / shape[0]
    places = np.column_stack([*pixels, np.ones(len(pixels[0]))]) @ raster.matrix.T
    if source is None:
        places = places * wanted.unit
    elif wanted.crs is None:
        places = places * _metres_per_unit(source, path)
    else:
        places = bring_places(places, source, wanted.crs, path)
    return _triangulate(places, heights * factor)


def height_factor(raster, source, unit):
    """Metres per unit of the heights: as given by the band, else by the coordinate reference system."""
    word = raster.unit.strip().lower()
    if word in UNIT_WORDS:
        return UNIT_WORDS[word]
    return unit if source is None else plane_of(source)[1]


def _triangulate(places, heights):
    """Two triangles per cell of four posts, none over a gap."""
    rows, columns = heights.shape
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    triangles = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, d, c), (a, c, b))])
    whole = np.isfinite(heights.ravel()[triangles]).all(axis=1)
    used, index = np.unique(triangles[whole], return_inverse=True)
    points = np.column_stack([places, heights.ravel()])[used]
    return Layer(points, index.reshape(-1, 3))
