"""Read the horizon of a scene: from a raster of heights around it, or from a file with angles."""

from pathlib import Path

import numpy as np

from ..files.open_input import open_input
from ..files.read_heights import open_placed, read_heights
from ..files.read_terrain import RASTERS, RELIEFS
from ..scene.find_ground import find_ground
from ..settings.errors import InputError
from .horizon import STEPS
from .horizon_of_terrain import GEODESIC, horizon_of_terrain
from .read_horizon_table import read_horizon_table

REACH = 50_000.0  # [m] terrain further away is left out: a peak of 2,000 m rises by less than 2.1° beyond it
AT_ONCE = 1 << 16  # triangles of ground that are looked at together, so that they need little memory
MESHES = (*RELIEFS, ".obj")


def check_horizon(path):
    """Refuse a file that is neither a raster with a reference system nor a list of angles.

    Raises
    ------
    InputError
    """
    if not is_raster(path):
        read_horizon_table(path)
        return
    with open_placed(path):
        pass


def is_raster(path):
    """Whether a file that can be opened is a raster of heights, by its suffix.

    Raises
    ------
    InputError
        It cannot be opened, or it is a mesh.
    """
    open_input(path).close()
    suffix = next((suffix.lower() for suffix in reversed(Path(path).suffixes) if suffix.lower() != ".gz"), "")
    if suffix in MESHES:
        cure = f"give heights around the city as {', '.join(RASTERS)}, or lines of azimuth,elevation in degrees"
        raise InputError(path, "is a mesh or a city, from which no horizon is read", f"{cure}; --terrain takes meshes")
    return suffix in RASTERS


def read_horizon(path, scene):
    """Horizon as seen from the middle of a scene, and from the corners of the box around its buildings.

    Parameters
    ----------
    path : path-like
        GeoTIFF or ASC grid with its reference system, or a file of angles as in `read_horizon_table`.
    scene : Scene

    Returns
    -------
    horizon : TerrainHorizon
    corners : list of TerrainHorizon
        Empty for a file of angles, which are the same everywhere.

    Raises
    ------
    InputError
        The file cannot be used, or does not reach the site.
    """
    if not is_raster(path):
        return read_horizon_table(path), []
    low, high = box_of_buildings(scene)
    middle, (west, south), (east, north) = (low + high) / 2, low, high
    posts = [middle, *(np.array(corner) for corner in ((west, south), (east, south), (east, north), (west, north)))]
    places = [place_on_earth(scene.site, post) for post in posts]
    grids = read_heights(path, places[0], REACH)
    ground, found = ground_of_model(scene), []
    for place, post in zip(places, posts, strict=True):
        start = np.maximum(distance_to_box(post, low, high), distance_to_end(post, ground))
        eye = found[0].eye if found else np.nan  # of corners that stand in water, which may be a gap
        found.append(horizon_of_terrain(grids, place, start, REACH, otherwise=eye))
    return found[0], found[1:]


def box_of_buildings(scene):
    """Lowest and highest x and y of the triangles that belong to surfaces: (2,) float64 [m] each."""
    own = scene.triangle_surface >= 0
    points = scene.vertices[scene.triangles[own if own.any() else slice(None)].ravel(), :2]
    return points.min(axis=0), points.max(axis=0)


def ground_of_model(scene):
    """Corners in plan of the triangles of ground that is drawn or measured, not generated: (g, 3, 2) float64 [m]."""
    ground = find_ground(scene)
    if not scene.terrain_laid:
        ground &= scene.triangle_surface >= 0
    return np.asarray(scene.vertices, float)[scene.triangles[ground], :2]


def place_on_earth(site, point):
    """Latitude and longitude [°] of a point (2,) [m] in the frame of a scene."""
    azimuth, distance = np.degrees(np.arctan2(point[0], point[1])), np.hypot(*point)
    longitude, latitude, _ = GEODESIC.fwd(site.longitude, site.latitude, azimuth, distance)
    return float(latitude), float(longitude)


def distance_to_box(point, low, high):
    """Distance from a point in a box to its edge, for each azimuth of a horizon: (STEPS,) float64 [m]."""
    turn = np.radians(np.arange(STEPS) * (360.0 / STEPS))
    direction = np.stack([np.sin(turn), np.cos(turn)])
    room = np.where(direction > 0, (high - point)[:, None], (point - low)[:, None])
    return (room / np.maximum(np.abs(direction), 1e-12)).min(axis=0)


def distance_to_end(point, triangles):
    """Distance from a point to the furthest edge of some triangles, for each azimuth of a horizon.

    Parameters
    ----------
    point : (2,) float [m]
    triangles : (g, 3, 2) float64 [m]
        Corners in plan.

    Returns
    -------
    (STEPS,) float64 [m]
        0 where there is none.
    """
    furthest = np.zeros(STEPS)
    for first in range(0, len(triangles), AT_ONCE):
        corners = triangles[first : first + AT_ONCE] - point
        ends = corners.reshape(-1, 2), np.roll(corners, -1, axis=1).reshape(-1, 2)
        step, distance = cross_edges(*ends)
        np.maximum.at(furthest, step % STEPS, distance)
    return furthest


def cross_edges(start, end):
    """Where lines of sight from the origin cross some edges.

    Parameters
    ----------
    start, end : (e, 2) float64 [m]

    Returns
    -------
    step : (c,) int
        Azimuth of each crossing in steps of a horizon.
    distance : (c,) float64 [m]
    """
    angle = 2 * np.pi / STEPS
    one = np.arctan2(start[:, 0], start[:, 1])
    turn = np.arctan2(end[:, 0], end[:, 1]) - one
    turn -= 2 * np.pi * np.rint(turn / (2 * np.pi))  # the way round that the edge takes
    first = np.ceil((one + np.minimum(turn, 0)) / angle).astype(int)
    count = np.maximum(np.floor((one + np.maximum(turn, 0)) / angle).astype(int) - first + 1, 0)
    edge = np.repeat(np.arange(len(one)), count)
    step = first[edge] + np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    ahead, along = np.stack([np.sin(step * angle), np.cos(step * angle)]), (end - start)[edge].T
    across = ahead[0] * along[1] - ahead[1] * along[0]
    offset = start[edge, 0] * along[1] - start[edge, 1] * along[0]
    return step, np.divide(offset, across, out=np.zeros(len(edge)), where=across != 0)
