"""Read the horizon of a scene: from a raster of heights around it, or from a file with angles."""

from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files.open_input import open_input
from ..files.read_heights import open_placed, read_heights
from ..files.read_terrain import RASTERS, RELIEFS
from .horizon import STEPS
from .horizon_of_terrain import GEODESIC, horizon_of_terrain
from .read_horizon_table import read_horizon_table

REACH = 50_000.0  # [m] terrain further away is left out: a peak of 2,000 m rises by less than 2.1° beyond it


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
    found = []
    for place, post in zip(places, posts, strict=True):
        start = distance_to_box(post, low, high)
        eye = found[0].eye if found else np.nan  # of corners that stand in water, which may be a gap
        found.append(horizon_of_terrain(grids, place, start, REACH, otherwise=eye))
    return found[0], found[1:]


def box_of_buildings(scene):
    """Lowest and highest x and y of the triangles that belong to surfaces: (2,) float64 [m] each."""
    own = scene.triangle_surface >= 0
    points = scene.vertices[scene.triangles[own if own.any() else slice(None)].ravel(), :2]
    return points.min(axis=0), points.max(axis=0)


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
