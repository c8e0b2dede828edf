"""Read the heights of a raster around a place, as grids: fine nearby, at most 4,000 posts wide further out."""

from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
import pyproj

from ..city.bring_places import bring_places, full_turn, plane_of, turn_towards
from ..settings.errors import InputError
from .open_raster import open_raster
from .raster import average_window
from .read_raster import HIGHEST, LOWEST, height_factor, window_between

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
    middle: float | None = None  # longitude of the site in the raster's degrees, which may go on beyond 180°

    def places_of(self, latitude, longitude):
        """Columns and rows, not rounded, of places on Earth [°]: (m,) each, not finite where the system ends."""
        turn = pyproj.Transformer.from_crs(GLOBE, plane_of(self.crs)[0], always_xy=True)
        places = np.array(turn.transform(longitude, latitude)).reshape(2, -1)
        if self.middle is not None:
            places[0] = turn_towards(places[0], self.middle, full_turn(self.crs))
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
        grids = []
        for distance in (NEAR, reach):
            windows = windows_around(raster, place, distance)
            found = [_read_grid(raster, window, middle) for window, middle in windows]
            # Where nothing is averaged the far grid is as fine as the near one.
            whole = distance == reach and all(max(window[2:]) <= MOST_POSTS for window, _ in windows)
            grids = found if found and whole else grids + found
    if not grids:
        problem = f"does not reach the site ({place[0]:.4f}°, {place[1]:.4f}°)"
        raise InputError(path, problem, "give a raster that covers the site and up to 50 km around it")
    return grids


def windows_around(raster, place, distance):
    """Parts of a raster within some distance of a place: list of (column, row, width, height) and middle longitude.

    One for each turn around the Earth in which longitudes may be written: two where a map of the globe begins and ends.
    """
    points = points_around(place, distance, raster.crs, raster.path)
    turn, found = full_turn(raster.crs), []
    for count in (0,) if turn is None else (-1, 0, 1):
        middle = None if turn is None else points[-1, 0] + count * turn
        own = points.copy()
        if turn is not None:
            own[:, 0] = turn_towards(own[:, 0], middle, turn)
        window = window_between(raster, (own.min(axis=0), own.max(axis=0)))
        found += [] if window is None else [(window, middle)]
    return found


def points_around(place, distance, crs, path):
    """The circle around a place, and the place itself as the last point, in a reference system: (k, 2) float64."""
    turn = np.arange(0, 360, 5.0)
    geodesic = pyproj.Geod(ellps="WGS84")
    count = np.ones(len(turn))
    longitude, latitude, _ = geodesic.fwd(count * place[1], count * place[0], turn, count * distance)
    places = np.column_stack([np.append(longitude, place[1]), np.append(latitude, place[0])])
    return bring_places(places, GLOBE, crs, path)


def _read_grid(raster, window, middle):
    crs, path = raster.crs, raster.path
    column, row, width, height = (int(value) for value in window)
    shape = (min(height, MOST_POSTS), min(width, MOST_POSTS))
    heights = average_window(replace(raster, read_cells=read_land(raster)), window, shape)
    # Whole numbers stand for posts, which lie in the middle of cells.
    wide, high = width / shape[1], height / shape[0]
    first = column + wide / 2, row + high / 2
    turn = raster.matrix[:, :2]
    matrix = np.column_stack([turn * (wide, high), turn @ first + raster.matrix[:, 2]])
    return HeightGrid(heights, matrix, crs, _smaller_step(matrix, shape, crs, path), str(path), middle)


def read_land(raster):
    """`read_cells` of a raster in metres, with gaps where no land can be that low or high."""
    factor = height_factor(raster, raster.crs, 1.0)

    def read_cells(*window):
        heights = raster.read_cells(*window) * factor
        with np.errstate(invalid="ignore"):
            return np.where((heights >= LOWEST) & (heights <= HIGHEST), heights, np.nan)

    return read_cells


def _smaller_step(matrix, shape, crs, path):
    """Smaller distance between neighbouring posts in the middle of a grid [m]."""
    middle = shape[1] / 2, shape[0] / 2
    posts = np.array([(*middle, 1), (middle[0] + 1, middle[1], 1), (middle[0], middle[1] + 1, 1)])
    points = bring_places(posts @ matrix.T, crs, GLOBE, path)
    _, _, length = pyproj.Geod(ellps="WGS84").inv(*np.repeat(points[:1], 2, axis=0).T, *points[1:].T)
    return float(length.min())
