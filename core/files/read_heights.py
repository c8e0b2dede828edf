"""Read the heights of a raster around a place, as grids: fine nearby, at most 4,000 posts wide further out."""

from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import pyproj

from ..city.bring_places import bring_places, plane_of
from ..errors import InputError
from .open_raster import open_raster
from .raster import average_window
from .read_raster import HIGHEST, height_factor, window_between

NEAR = 4000.0  # [m] around the place the raster is read at full resolution, if that is finer than further out
MOST_POSTS = 4000  # per side; a finer raster is averaged down to that many
GLOBE = "EPSG:4326"


@dataclass
class HeightGrid:
    """Heights of a raster, posts in the middle of its cells."""

    heights: np.ndarray  # (rows, columns) float64 [m], NaN in gaps
    matrix: np.ndarray  # (2, 3) float64, from (column, row, 1) of posts to the raster's system
    crs: str  # WKT
    post: float  # [m] smaller distance between posts
    path: str

    def places_of(self, latitude, longitude):
        """Columns and rows, not rounded, of places on Earth [°]: (m,) each, not finite where the system ends."""
        turn = pyproj.Transformer.from_crs(GLOBE, plane_of(self.crs)[0], always_xy=True)
        places = np.array(turn.transform(longitude, latitude)).reshape(2, -1)
        return np.linalg.solve(self.matrix[:, :2], places - self.matrix[:, 2:])


@contextmanager
def open_placed(path):
    """Open a raster that says where it lies.

    Yields
    ------
    Raster

    Raises
    ------
    InputError
        Not a raster, or one without reference system.
    """
    with open_raster(path) as raster:
        if raster.crs is None:
            cure = "give a GeoTIFF with its reference system, or a horizon file (azimuth,elevation)"
            raise InputError(path, "names no coordinate reference system, so nothing tells where it lies", cure)
        yield raster


def read_heights(path, place, reach):
    """Heights of a raster within some distance of a place.

    Parameters
    ----------
    path : path-like
        GeoTIFF or ASC grid, plain or gzip-compressed.
    place : tuple of two float
        Latitude and longitude [°].
    reach : float [m]

    Returns
    -------
    list of HeightGrid
        The finest first.

    Raises
    ------
    InputError
        Not a raster, one without reference system, or one that does not reach the place.
    """
    with open_placed(path) as raster:
        crs = raster.crs
        grids = []
        for distance in (NEAR, reach):
            corners = rectangle_around(place, distance, crs, path)
            window = window_between(raster, corners)
            if window is None:
                continue
            grids.append(_read_grid(raster, window, crs, path))
            if grids[-1].heights.shape == (window[3], window[2]) and distance == reach:
                grids = grids[-1:]  # nothing was averaged: the far grid is as fine as the near one
    if not grids:
        problem = f"does not reach the site ({place[0]:.4f}°, {place[1]:.4f}°)"
        raise InputError(path, problem, "give a raster that covers the site and up to 50 km around it")
    return grids


def rectangle_around(place, distance, crs, path):
    """Bounding box, in a reference system, of the circle around a place: two (2,) float64."""
    turn = np.arange(0, 360, 5.0)
    geodesic = pyproj.Geod(ellps="WGS84")
    count = np.ones(len(turn))
    longitude, latitude, _ = geodesic.fwd(count * place[1], count * place[0], turn, count * distance)
    points = bring_places(np.column_stack([longitude, latitude]), GLOBE, crs, path)
    return points.min(axis=0), points.max(axis=0)


def _read_grid(raster, window, crs, path):
    column, row, width, height = (int(value) for value in window)
    shape = (min(height, MOST_POSTS), min(width, MOST_POSTS))
    heights = average_window(raster, window, shape) * height_factor(raster, crs, 1.0)
    with np.errstate(invalid="ignore"):
        heights[~(np.abs(heights) <= HIGHEST)] = np.nan
    # Whole numbers stand for posts, which lie in the middle of cells.
    wide, high = width / shape[1], height / shape[0]
    first = column + wide / 2, row + high / 2
    turn = raster.matrix[:, :2]
    matrix = np.column_stack([turn * (wide, high), turn @ first + raster.matrix[:, 2]])
    return HeightGrid(heights, matrix, crs, _smaller_step(matrix, shape, crs, path), str(path))


def _smaller_step(matrix, shape, crs, path):
    """Smaller distance between neighbouring posts in the middle of a grid [m]."""
    middle = shape[1] / 2, shape[0] / 2
    posts = np.array([(*middle, 1), (middle[0] + 1, middle[1], 1), (middle[0], middle[1] + 1, 1)])
    points = bring_places(posts @ matrix.T, crs, GLOBE, path)
    _, _, length = pyproj.Geod(ellps="WGS84").inv(*np.repeat(points[:1], 2, axis=0).T, *points[1:].T)
    return float(length.min())
