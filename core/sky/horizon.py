"""The horizon of distant terrain as seen from one place: an elevation angle for every azimuth, from
heights around it.

elevation
   │        ▲ hidden: below the line a ray that leaves the scene meets terrain, and no sun is seen
10°│      ／╲＿
   │＿＿／     ╲＿＿＿
   └────────────────── azimuth
   N    E    S    W    N

eye ─────────────────────── horizontal        A post at distance d lies lower by about (1 - k) d²/2R
                                              than
 ●┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄ ▲ ↕ drop                    its height says: light in air bends towards the Earth,
                                              as
═══════════╲_____╱═╲___                       if the Earth had the radius R/(1 - k).

What it takes of the sky from unobstructed surfaces has a closed form: `TerrainHorizon.lost_sky`.
"""

from dataclasses import dataclass

import numpy as np
import pyproj
from numba import njit

from ..rays.faces import Fate
from ..settings.errors import UNIT, InputError, check_array
from .horizon_band import by_normal

STEPS = 1440  # azimuths at which a horizon is stored: every 0.25°
EARTH_RADIUS = 6_371_000.0  # [m] mean; the local one differs by 0.4 %, which is 0.001° at 50 km
REFRACTION = 0.13  # coefficient k of terrestrial refraction (Gauss); Brunner 1984, Hirt et al. 2010
# [m] along a line of sight places of the raster are computed so often, and linear between
NODE = 1000.0
GEODESIC = pyproj.Geod(ellps="WGS84")


@dataclass
class TerrainHorizon:
    """Elevation angle of the terrain around a place."""

    # (STEPS,) float64 [°], 0 to 90, at azimuths 0, 0.25°, … clockwise from true north
    elevation: np.ndarray
    source: str = ""  # the file it comes from
    eye: float | None = None  # [m] height from which terrain is seen; None: the file has angles
    # (STEPS,) float64 [m], distance of the last height in each direction
    known: np.ndarray | None = None

    @property
    def azimuth(self):
        """Azimuths of the elevations [°]: (STEPS,)."""
        return np.arange(len(self.elevation)) * (360.0 / len(self.elevation))

    def elevation_at(self, azimuth):
        """Elevation angle of the horizon, linear between its stored azimuths.

        Parameters
        ----------
        azimuth : array_like [°]
            Clockwise from true north.

        Returns
        -------
        numpy.ndarray [°]
        """
        return np.interp(np.asarray(azimuth, float), self.azimuth, self.elevation, period=360.0)

    def lost_sky(self, normal):
        """Cosine-weighted share of the hemisphere of unobstructed surfaces between the horizontal
        and the horizon.

        For each azimuth the integral over elevation is exact: with c the component of the normal
        along that azimuth, ∫ (c cos e + n_z sin e) cos e de = c (e/2 + sin 2e / 4) + n_z sin² e /
        2. A horizon of equal height h takes sin² h from a level surface, and (h + sin h cos h)/π, h
        in radians, from a wall.

        Parameters
        ----------
        normal : array_like, (n, 3)
            Unit vectors.

        Returns
        -------
        numpy.ndarray, (n,)
            What (1 + cos tilt)/2 loses, and the view of the ground gains.
        """
        normal = check_array("normal", normal, ("n", 3), least=-1 - UNIT, most=1 + UNIT)
        # For each azimuth the sky between level and terrain, cut where the surface's own plane cuts
        # it.
        turn, height = np.radians(self.azimuth), np.radians(self.elevation)

        def lose(normal):
            along = normal[:, :1] * np.sin(turn) + normal[:, 1:2] * np.cos(turn)  # (n, STEPS)
            up = np.broadcast_to(normal[:, 2:], along.shape)
            # Where the surface's own plane rises or falls across the sky, it is the limit.
            plane = np.arctan2(np.abs(along), np.abs(up))
            low = np.where((along < 0) & (up > 0), plane, 0.0)
            high = np.where((along > 0) & (up < 0), np.minimum(height, plane), height)
            faces = (high > low) & ((along > 0) | (up > 0))
            # The integral of the docstring between elevations low and high, for the part along the
            # azimuth and the upward part of the normal.
            share = along * (high - low + (np.sin(2 * high) - np.sin(2 * low)) / 2) / 2
            share += up * (np.sin(high) ** 2 - np.sin(low) ** 2) / 2
            # da/π = 2/STEPS
            return np.maximum(np.where(faces, share, 0.0), 0).sum(axis=1) * 2 / len(turn)

        return by_normal(lose, normal, 9)

    def hide_rays(self, fate, directions):
        """Give rays that leave the scene below the horizon to the far ground: their fates, (c,
        rays) uint8, change in place; directions are (c, rays, 3) float32.
        """
        sine = np.sin(np.radians(self.elevation))
        _hide_rays(fate, np.ascontiguousarray(np.moveaxis(directions, -1, 0)), sine)


@njit(nogil=True, cache=True)
def _hide_rays(fate, directions, sine):
    """Change the fate of rays that reach the sky below the horizon, in place.

    Parameters
    ----------
    fate : (c, rays) uint8
    directions : (3, c, rays) float32
        Unit vectors.
    sine : (STEPS,) float64
        Sine of the horizon's elevation.
    """
    steps, highest = len(sine), sine.max()
    for patch in range(fate.shape[0]):
        for ray in range(fate.shape[1]):
            # Only rays to the sky count, and only those lower than the highest terrain.
            height = directions[2, patch, ray]
            if fate[patch, ray] != Fate.SKY or height >= highest:
                continue
            # Height of the terrain at the ray's azimuth, linear in the sine between two stored
            # azimuths.
            turn = np.arctan2(directions[0, patch, ray], directions[1, patch, ray]) / (2 * np.pi)
            place = (turn - np.floor(turn)) * steps
            before = int(place)
            share = place - before
            before %= steps  # rounding may give `steps` itself
            limit = sine[before] * (1 - share) + sine[(before + 1) % steps] * share
            if height < limit:
                fate[patch, ray] = Fate.FAR_GROUND


def is_above(horizon, direction):
    """Whether directions point above the horizon.

    Parameters
    ----------
    horizon : TerrainHorizon or None
        None: everything is above it.
    direction : array_like, (m, 3)
        Unit vectors: x east, y north, z up.

    Returns
    -------
    numpy.ndarray, (m,) bool
    """
    direction = np.asarray(direction, float)
    if horizon is None:
        return np.ones(len(direction), bool)
    # azimuth, elevation  of the direction [°], to be held against the terrain's there.
    azimuth = np.degrees(np.arctan2(direction[:, 0], direction[:, 1]))
    elevation = np.degrees(np.arcsin(np.clip(direction[:, 2], -1, 1)))
    return elevation >= horizon.elevation_at(azimuth)


def horizon_of_terrain(grids, place, start, reach, refraction=REFRACTION, *, otherwise=np.nan):
    """Horizon as seen from the ground at a place.

    Heights are bilinear between posts, taken every half post, nearby every eighth, along lines of
    sight every 0.25°.

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
        At least 0° in every direction, with the height of the eye and how far heights are known.

    Raises
    ------
    InputError
        No grid has a height at the place, and `otherwise` is NaN.

    References
    ----------
    C. Hirt et al. (2010), Monitoring of the refraction coefficient in the lower atmosphere,
    :doi:`10.1029/2010JD014067`.
    """
    # The eye stands on the ground: on the finest grid that has a height there.
    ground_height = height_at(grids, place)
    eye = ground_height if np.isfinite(ground_height) else otherwise
    if not np.isfinite(eye):
        raise InputError(
            grids[0].path,
            f"has no height at the site ({place[0]:.4f}°, {place[1]:.4f}°)",
            "give a raster that covers the site and up to 50 km around it",
        )
    # Lines of sight are geodesics: nodes every kilometre are placed on the ellipsoid, and projected
    # to each raster.
    nodes = np.arange(int(np.ceil(reach / NODE)) + 2) * NODE
    turn, far = (
        grid.ravel()
        for grid in np.meshgrid(np.arange(STEPS) * (360.0 / STEPS), nodes, indexing="ij")
    )
    latitude, longitude = (np.full(turn.shape, value) for value in place)
    longitudes, latitudes, _ = GEODESIC.fwd(longitude, latitude, turn, far)
    steepest, known = np.zeros((2, STEPS))
    # A line of sight that bends is straight above a larger Earth, of radius R/(1 - k).
    radius = EARTH_RADIUS / (1 - refraction)
    # Each grid raises the horizon where it shows terrain at a steeper angle than those before it.
    for grid in grids:
        lines = tuple(part.reshape(STEPS, -1) for part in grid.places_of(latitudes, longitudes))
        _raise_horizon(
            grid.heights, lines, (start, reach, grid.post / 2), (eye, radius), steepest, known
        )
    return TerrainHorizon(np.degrees(np.arctan(steepest)), str(grids[0].path), float(eye), known)


def height_at(grids, place):
    """Height of the ground at a place (latitude, longitude) [m]; NaN where no grid has one."""
    ground_height = np.nan
    for grid in grids:
        column, row = grid.places_of(*place)
        ground_height = (
            ground_height
            if np.isfinite(ground_height)
            else bilinear(grid.heights, column[0], row[0])
        )
    return ground_height


@njit(nogil=True, cache=True)
def bilinear(heights, column, row):
    """Height at a place of a grid whose posts lie at whole numbers; NaN outside its cells, and
    beside gaps.
    """
    rows, columns = heights.shape
    if not (-0.5 <= column <= columns - 0.5 and -0.5 <= row <= rows - 0.5):
        return np.nan
    # Half a cell beyond the outermost posts the height stays as at the edge.
    column, row = min(max(column, 0.0), columns - 1.0), min(max(row, 0.0), rows - 1.0)
    left, top = min(int(column), columns - 2), min(int(row), rows - 2)
    # Linear across, along the upper and the lower edge of the cell, then linear down between them.
    across, down = column - left, row - top
    upper = heights[top, left] * (1 - across) + heights[top, left + 1] * across
    lower = heights[top + 1, left] * (1 - across) + heights[top + 1, left + 1] * across
    return upper * (1 - down) + lower * down


@njit(nogil=True, cache=True)
def _raise_horizon(heights, lines, extent, eye_of, steepest, known):  # noqa: PLR0917
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
        # One step after the other along the line, from its start, in cells of the raster between
        # nodes.
        distance = max(start[line], step)
        while distance <= reach:
            before = int(distance / NODE)
            share = distance / NODE - before
            column = columns[line, before] * (1 - share) + columns[line, before + 1] * share
            row = rows[line, before] * (1 - share) + rows[line, before + 1] * share
            height = bilinear(heights, column, row)
            if not np.isnan(height):
                # The Earth falls away under the level line through the eye:
                # drop  below it, of a post at this height [m]; tangent  of its elevation, (height -
                # eye - drop) / distance along that line [–].
                angle = distance / radius  # at the centre of the Earth
                drop = (radius + height) * 2 * np.sin(angle / 2) ** 2
                tangent = (height - eye - drop) / ((radius + height) * np.sin(angle))
                steepest[line] = max(steepest[line], tangent)
                known[line] = max(known[line], distance)
            # finer nearby, where angles change quickly
            distance += min(step, max(step / 4, distance / 200))
