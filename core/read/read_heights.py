"""Read the heights of a raster around a place, as grids: fine nearby, at most 4,000 posts wide
further out.
"""

from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import pyproj

from ..city.transform_crs import plane_of, transform_crs
from ..settings.errors import InputError
from .open_input import open_input, suffix_of
from .open_raster import full_turn, open_raster, read_posts, turn_towards, windows_around
from .read_terrain import RASTERS, RELIEFS

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
    # longitude of the site in the raster's degrees, which may go on beyond 180°
    middle: float | None = None

    def places_of(self, latitude, longitude):
        """Columns and rows, not rounded, of places on Earth [°]: (m,) each, not finite where the
        system ends.
        """
        turn = pyproj.Transformer.from_crs(GLOBE, plane_of(self.crs)[0], always_xy=True)
        places = np.array(turn.transform(longitude, latitude)).reshape(2, -1)
        if self.middle is not None:
            places[0] = turn_towards(places[0], self.middle, full_turn(self.crs))
        return np.linalg.solve(self.matrix[:, :2], places - self.matrix[:, 2:])


@contextmanager
def _open_placed(path):
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
            raise InputError(
                path,
                "names no coordinate reference system, so nothing tells where it lies",
                "give a GeoTIFF with its reference system, or a horizon file (azimuth,elevation)",
            )
        yield raster


def is_placed_raster(path):
    """Whether a file that can be opened is a raster of heights, by its suffix; it must say where it
    lies.

    Raises
    ------
    InputError
        It cannot be opened, is a mesh, or a raster without reference system.
    """
    open_input(path).close()
    if suffix_of(path) in (*RELIEFS, ".obj"):
        cure = (
            f"give heights around the city as {', '.join(RASTERS)}, or lines of azimuth,elevation "
            "in degrees"
        )
        raise InputError(
            path,
            "is a mesh or a city, from which no horizon is read",
            f"{cure}; --terrain takes meshes",
        )
    if suffix_of(path) not in RASTERS:
        return False
    with _open_placed(path):
        return True


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
    with _open_placed(path) as raster:
        grids = []
        bearing = np.arange(0, 360, 5.0)
        ones = np.ones(len(bearing))
        # The raster is read up to 4 km around the place, then out to `reach`, each time with a
        # limited number of posts a side, so that the first is finer where posts must be averaged.
        for distance in (4000.0, reach):
            # Points of the circle around the place, and the place itself as the last: the rectangle
            # around them is read, in two pieces where a map of the globe begins and ends.
            ends = pyproj.Geod(ellps="WGS84").fwd(
                ones * place[1], ones * place[0], bearing, ones * distance
            )
            points = np.append(np.column_stack(ends[:2]), [place[::-1]], axis=0)
            windows = windows_around(raster, transform_crs(points, GLOBE, raster.crs, path))
            read_grids = [_read_grid(raster, window, middle) for window, middle in windows]
            # Where nothing is averaged the far grids are as fine as the near ones, and replace
            # them.
            whole = distance == reach and all(
                max(window[2:]) <= MOST_POSTS for window, _ in windows
            )
            grids = read_grids if read_grids and whole else grids + read_grids
    if not grids:
        raise InputError(
            path,
            f"does not reach the site ({place[0]:.4f}°, {place[1]:.4f}°)",
            "give a raster that covers the site and up to 50 km around it",
        )
    return grids


def _read_grid(raster, window, middle):
    heights, matrix = read_posts(raster, window, MOST_POSTS)
    # The smaller distance between neighbouring posts in the middle of the grid.
    column, row = heights.shape[1] / 2, heights.shape[0] / 2
    posts = np.array([(column, row, 1), (column + 1, row, 1), (column, row + 1, 1)])
    points = transform_crs(posts @ matrix.T, raster.crs, GLOBE, raster.path)
    _, _, length = pyproj.Geod(ellps="WGS84").inv(
        *np.repeat(points[:1], 2, axis=0).T, *points[1:].T
    )
    return HeightGrid(heights, matrix, raster.crs, float(length.min()), str(raster.path), middle)
