"""Horizon of a place from the heights around it, with the curvature of the Earth and refraction.

eye ─────────────────────── horizontal        A post at distance d lies lower by about (1 - k) d²/2R than
 ●┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄ ▲ ↕ drop                    its height says: light in air bends towards the Earth, as
═══════════╲_____╱═╲___                       if the Earth had the radius R/(1 - k).
"""

import numpy as np
import pyproj
from numba import njit

from ..settings.errors import InputError
from .horizon import STEPS, TerrainHorizon

EARTH_RADIUS = 6_371_000.0  # [m] mean; the local one differs by 0.4 %, which is 0.001° at 50 km
REFRACTION = 0.13  # coefficient k of terrestrial refraction (Gauss); Brunner 1984, Hirt et al. 2010
NODE = 1000.0  # [m] along a line of sight places of the raster are computed so often, and linear between
GEODESIC = pyproj.Geod(ellps="WGS84")


def horizon_of_terrain(grids, place, start, reach, refraction=REFRACTION, *, otherwise=np.nan):
    """Horizon as seen from the ground at a place.

    Heights are bilinear between posts, taken every half post, nearby every eighth, along lines of sight every 0.25°.

    Parameters
    ----------
    grids : list of HeightGrid
        The finest first.
    place : tuple of two float
        Latitude and longitude [°].
    start : (STEPS,) float64 [m]
        Distance from which terrain counts, for each azimuth.
    reach : float [m]
        Distance up to which it counts.
    refraction : float
        Coefficient k of terrestrial refraction.
    otherwise : float [m]
        Height of the ground at the place where no grid has one.

    Returns
    -------
    TerrainHorizon

    Raises
    ------
    InputError
        There is no height at the place.

    References
    ----------
    C. Hirt et al. (2010), Monitoring of the refraction coefficient in the lower atmosphere,
    :doi:`10.1029/2010JD014067`.
    """
    found = height_at(grids, place)
    eye = found if np.isfinite(found) else otherwise
    if not np.isfinite(eye):
        problem = f"has no height at the site ({place[0]:.4f}°, {place[1]:.4f}°)"
        raise InputError(grids[0].path, problem, "give a raster that covers the site and up to 50 km around it")
    nodes = np.arange(int(np.ceil(reach / NODE)) + 2) * NODE
    latitudes, longitudes = points_around(place, np.arange(STEPS) * (360.0 / STEPS), nodes)
    steepest, known = np.zeros((2, STEPS))
    radius = EARTH_RADIUS / (1 - refraction)
    for grid in grids:
        column, row = grid.places_of(latitudes.ravel(), longitudes.ravel())
        lines = column.reshape(latitudes.shape), row.reshape(latitudes.shape)
        march(grid.heights, lines, (start, reach, grid.post / 2), (eye, radius), steepest, known)
    return TerrainHorizon(np.degrees(np.arctan(steepest)), str(grids[0].path), float(eye), known)


def height_at(grids, place):
    """Height of the ground at a place (latitude, longitude) [m]; NaN where no grid has one."""
    found = np.nan
    for grid in grids:
        column, row = grid.places_of(*place)
        found = found if np.isfinite(found) else bilinear(grid.heights, column[0], row[0])
    return found


def points_around(place, azimuth, distance):
    """Latitudes and longitudes [°] of points on geodesics from a place: (a, d) each."""
    turn, far = (grid.ravel() for grid in np.meshgrid(azimuth, distance, indexing="ij"))
    latitude, longitude = (np.full(turn.shape, value) for value in place)
    longitudes, latitudes, _ = GEODESIC.fwd(longitude, latitude, turn, far)
    return latitudes.reshape(len(azimuth), -1), longitudes.reshape(len(azimuth), -1)


@njit(nogil=True, cache=True)
def bilinear(heights, column, row):
    """Height at a place of a grid whose posts lie at whole numbers; NaN outside its cells, and beside gaps."""
    rows, columns = heights.shape
    if not (-0.5 <= column <= columns - 0.5 and -0.5 <= row <= rows - 0.5):
        return np.nan
    column, row = min(max(column, 0.0), columns - 1.0), min(max(row, 0.0), rows - 1.0)
    left, top = min(int(column), columns - 2), min(int(row), rows - 2)
    across, down = column - left, row - top
    upper = heights[top, left] * (1 - across) + heights[top, left + 1] * across
    lower = heights[top + 1, left] * (1 - across) + heights[top + 1, left + 1] * across
    return upper * (1 - down) + lower * down


@njit(nogil=True, cache=True)
def march(heights, lines, extent, eye_of, steepest, known):  # noqa: PLR0917
    """Raise the greatest tangent of elevation along each line of sight, in place.

    Parameters
    ----------
    heights : (rows, columns) float64 [m]
    lines : tuple of two (a, d) float64
        Columns and rows of the nodes of each line.
    extent : tuple of (a,) float64, float and float [m]
        First distance of each line, last distance, and largest distance between samples.
    eye_of : tuple of two float [m]
        Height of the eye, and radius of the Earth for bent light.
    steepest : (a,) float64
        Changed in place.
    known : (a,) float64 [m]
        Distance of the last height of each line; changed in place.
    """
    (columns, rows), (start, reach, step), (eye, radius) = lines, extent, eye_of
    for line in range(len(steepest)):
        distance = max(start[line], step)
        while distance <= reach:
            before = int(distance / NODE)
            share = distance / NODE - before
            column = columns[line, before] * (1 - share) + columns[line, before + 1] * share
            row = rows[line, before] * (1 - share) + rows[line, before + 1] * share
            height = bilinear(heights, column, row)
            if not np.isnan(height):
                angle = distance / radius  # at the centre of the Earth
                drop = (radius + height) * 2 * np.sin(angle / 2) ** 2
                tangent = (height - eye - drop) / ((radius + height) * np.sin(angle))
                steepest[line] = max(steepest[line], tangent)
                known[line] = max(known[line], distance)
            distance += min(step, max(step / 4, distance / 200))  # finer nearby, where angles change quickly
