"""Read heights on a grid, GeoTIFF or ASC: fine around the city, coarse as far as the horizon."""

import warnings
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..city.bring_places import bring_places, plane_of
from ..errors import InputError
from ..ground.terrain import Layer
from .open_input import open_input

TIFF_STARTS = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
NEAR = 300.0  # [m] around the city every post is read
NEAR_POSTS, FAR_POSTS = 700, 250  # along a side; a finer grid is thinned to that many
LARGEST_BLOCK = 2**28  # bytes that one piece of the grid may take when unpacked
MOST_POSTS = 400_000_000  # that are gone through
HIGHEST = 12_000.0  # [m] what is further from sea level is no height but a mark for a gap
UNIT_WORDS = {"ft": 0.3048, "foot": 0.3048, "feet": 0.3048, "us survey foot": 1200 / 3937, "us-ft": 1200 / 3937}


class Wanted(NamedTuple):
    """What part of a grid is wanted, and in which frame."""

    path: object  # of the grid
    low: np.ndarray  # (2,) float64 [m] corners of the city
    high: np.ndarray  # (2,) float64 [m]
    horizon: float  # [m] how far beyond them terrain is wanted
    crs: str | None  # of the city
    unit: float  # metres per unit of a grid that names no coordinate reference system


def read_raster(wanted, notes):
    """Layers of a grid around a city.

    Parameters
    ----------
    wanted : Wanted
    notes : list of str
        Grows by what is worth a word.

    Returns
    -------
    list of Layer
        Points in the system of the city [m].

    Raises
    ------
    InputError
        No grid, a damaged one, or one that does not reach the city.
    """
    import rasterio  # late, so that a library which fails to load hurts only those who need it

    path = wanted.path
    open_input(path).close()
    try:
        with _open(rasterio, path) as dataset:
            return _read_layers(dataset, wanted, notes)
    except rasterio.errors.RasterioError as error:
        words = " ".join(str(error).replace(str(path), "it").split())[:160]
        raise InputError(path, f"is no grid that can be read ({words})", "give a GeoTIFF or an ASC grid") from error


@contextmanager
def _open(rasterio, path):
    """The grid of a file, packed with gzip or not; a file without a place on a map is refused."""
    with Path(path).open("rb") as stream:
        packed = stream.read(2) == b"\x1f\x8b"
    with open_input(path) as stream:
        driver = "GTiff" if stream.read(4) in TIFF_STARTS else "AAIGrid"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)  # said below, as an error
        if packed:
            with (
                open_input(path) as stream,
                rasterio.MemoryFile(stream.read()) as memory,
                memory.open(driver=driver) as dataset,
            ):
                yield dataset
        else:
            with rasterio.open(path, driver=driver) as dataset:
                yield dataset


def _read_layers(dataset, wanted, notes):
    path = wanted.path
    if dataset.transform.is_identity and dataset.crs is None:
        raise InputError(path, "does not say where it lies", "give a grid with its place and cell size")
    if dataset.driver == "AAIGrid" and 2 * dataset.width * dataset.height > _size(path) + 1:
        problem = f"its head promises {dataset.width:,} x {dataset.height:,} heights, the file is too short for them"
        raise InputError(path, problem, "the file is cut or damaged: get it again")
    block = max((rows * columns for rows, columns in dataset.block_shapes), default=0)
    if block * np.dtype(dataset.dtypes[0]).itemsize > LARGEST_BLOCK:
        raise InputError(path, "is one piece of more than 256 MiB", "write it anew in tiles")
    source = dataset.crs.to_wkt() if dataset.crs else None
    if source is None or wanted.crs is None:
        notes.append(
            f"{path} names no coordinate reference system; taken as the city's."
            if source is None
            else f"The city names no coordinate reference system; taken as that of {path}."
        )
    layers = []
    for reach, posts in ((NEAR, NEAR_POSTS), (wanted.horizon, FAR_POSTS)):
        window = _window(dataset, _rectangle(reach, source, wanted))
        if window is not None and window[2] * window[3] > MOST_POSTS:
            problem = f"{window[2]:,} x {window[3]:,} posts lie around the city"
            raise InputError(path, problem, f"thin it to at most {MOST_POSTS:,}")
        if window is not None:
            layers.append(_read_layer(dataset, window, posts, notes if not layers else [], wanted))
    return [layer for layer in layers if len(layer.triangles)]


def _size(path):
    """Bytes of a file, unpacked."""
    with open_input(path) as stream:
        return sum(len(piece) for piece in iter(lambda: stream.read(2**20), b""))


def _rectangle(reach, source, wanted):
    """Corners, in the grid's system, of what holds the city and what lies within reach of it."""
    low, high = wanted.low - reach, wanted.high + reach
    share = np.linspace(0, 1, 9)
    x, y = np.meshgrid(low[0] + share * (high[0] - low[0]), low[1] + share * (high[1] - low[1]))
    places = np.column_stack([x.ravel(), y.ravel()])
    if source is None:
        places = places / wanted.unit
    elif wanted.crs is None:
        places = places / _metres_per_unit(source, wanted.path)
    else:
        places = bring_places(places, wanted.crs, source, wanted.path)
    return places.min(axis=0), places.max(axis=0)


def _metres_per_unit(source, path):
    plane, _ = plane_of(source)
    if plane.is_geographic:
        raise InputError(path, "is in degrees, and the city names no system", "give terrain in the city's own metres")
    return plane.axis_info[0].unit_conversion_factor


def _window(dataset, corners):
    """First column, first row, columns and rows of the grid inside a rectangle of its system; None where none are."""
    (west, south), (east, north) = corners
    corners = np.array([(west, south), (west, north), (east, south), (east, north)])
    places = _apply(~dataset.transform, *corners.T)
    first = np.maximum(np.floor(places.min(axis=0)).astype(np.int64) - 1, 0)
    last = np.minimum(np.ceil(places.max(axis=0)).astype(np.int64) + 1, (dataset.width, dataset.height))
    return (*first, *(last - first)) if (last - first > 1).all() else None


def _apply(affine, x, y):
    """Places (k, 2) that an affine map makes of others."""
    return np.column_stack([affine.a * x + affine.b * y + affine.c, affine.d * x + affine.e * y + affine.f])


def _read_layer(dataset, window, posts, notes, wanted):
    from rasterio.enums import Resampling
    from rasterio.windows import Window

    column, row, width, height = (int(value) for value in window)
    shape = (min(height, posts), min(width, posts))
    thinned = shape != (height, width)
    resampling = Resampling.average if thinned else Resampling.nearest
    heights = dataset.read(1, window=Window(column, row, width, height), out_shape=shape, masked=True,
                           resampling=resampling)  # fmt: skip
    heights = heights.astype(float).filled(np.nan) * dataset.scales[0] + dataset.offsets[0]
    source, path = dataset.crs.to_wkt() if dataset.crs else None, wanted.path
    factor = _height_factor(dataset, source, wanted.unit)
    with np.errstate(invalid="ignore"):
        odd = np.abs(heights * factor) > HIGHEST
    if odd.any():
        notes.append(f"{int(odd.sum())} heights of {path} beyond ±{HIGHEST:,.0f} m taken as gaps.")
    heights[odd | ~np.isfinite(heights)] = np.nan
    if thinned:
        notes.append(f"{path}: {width} x {height} posts thinned to {shape[1]} x {shape[0]}.")
    y, x = np.mgrid[: shape[0], : shape[1]]
    pixels = column + (x.ravel() + 0.5) * width / shape[1], row + (y.ravel() + 0.5) * height / shape[0]
    places = _apply(dataset.transform, *pixels)
    if source is None:
        places = places * wanted.unit
    elif wanted.crs is None:
        places = places * _metres_per_unit(source, path)
    else:
        places = bring_places(places, source, wanted.crs, path)
    return _triangulate(places, heights * factor)


def _height_factor(dataset, source, unit):
    """Metres per unit of the heights: as the band says, else as the system says."""
    word = (dataset.units[0] or "").strip().lower()
    if word in UNIT_WORDS:
        return UNIT_WORDS[word]
    if source is None:
        return unit
    return 1.0 if word in ("m", "metre", "meter", "metres", "meters") else plane_of(source)[1]


def _triangulate(places, heights):
    """Two triangles per square of four posts, none over a gap."""
    rows, columns = heights.shape
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    triangles = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, d, c), (a, c, b))])
    whole = np.isfinite(heights.ravel()[triangles]).all(axis=1)
    used, index = np.unique(triangles[whole], return_inverse=True)
    points = np.column_stack([places, heights.ravel()])[used]
    return Layer(points, index.reshape(-1, 3))
