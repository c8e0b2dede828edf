"""The horizon of distant terrain as seen from one place: an elevation angle for every azimuth.

elevation
   │        ▲ hidden: below the line a ray that leaves the scene meets terrain, and no sun is seen
10°│      ／╲＿
   │＿＿／     ╲＿＿＿
   └────────────────── azimuth
   N    E    S    W    N
"""

from dataclasses import dataclass, replace

import numpy as np
from numba import njit

STEPS = 1440  # azimuths at which a horizon is stored: every 0.25°


@dataclass
class TerrainHorizon:
    """Elevation angle of the terrain around a place."""

    elevation: np.ndarray  # (STEPS,) float64 [°], 0 to 90, at azimuths 0, 0.25°, … clockwise from true north
    source: str = ""  # the file it comes from
    eye: float | None = None  # [m] height from which terrain is seen; None: the file has angles
    known: np.ndarray | None = None  # (STEPS,) float64 [m], distance of the last height in each direction

    @property
    def azimuth(self):
        """Azimuths of the elevations [°]: (STEPS,)."""
        return np.arange(len(self.elevation)) * (360.0 / len(self.elevation))


def elevation_at(horizon, azimuth):
    """Elevation angle of the horizon, linear between its stored azimuths.

    Parameters
    ----------
    horizon : TerrainHorizon
    azimuth : array_like [°]
        Clockwise from true north.

    Returns
    -------
    numpy.ndarray [°]
    """
    return np.interp(np.asarray(azimuth, float), horizon.azimuth, horizon.elevation, period=360.0)


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
    azimuth = np.degrees(np.arctan2(direction[:, 0], direction[:, 1]))
    elevation = np.degrees(np.arcsin(np.clip(direction[:, 2], -1, 1)))
    return elevation >= elevation_at(horizon, azimuth)


def without_hidden(suns, horizon):
    """Suns of which those behind the horizon have no weight: the weights sum to the share of open suns.

    Parameters
    ----------
    suns : Suns
    horizon : TerrainHorizon or None

    Returns
    -------
    Suns
    """
    return (
        suns if horizon is None else replace(suns, weight=np.where(is_above(horizon, suns.direction), suns.weight, 0.0))
    )


@njit(nogil=True, cache=True)
def mark_hidden(fate, directions, sine, seen, hidden):
    """Change the fate of rays that reach the sky below the horizon, in place.

    Parameters
    ----------
    fate : (c, rays) uint8
    directions : (3, c, rays) float32
        Unit vectors.
    sine : (STEPS,) float64
        Sine of the horizon's elevation.
    seen, hidden : int
        Fate of rays that reach the sky, and of those that meet terrain instead.
    """
    steps, highest = len(sine), sine.max()
    for patch in range(fate.shape[0]):
        for ray in range(fate.shape[1]):
            height = directions[2, patch, ray]
            if fate[patch, ray] != seen or height >= highest:
                continue
            turn = np.arctan2(directions[0, patch, ray], directions[1, patch, ray]) / (2 * np.pi)
            place = (turn - np.floor(turn)) * steps
            before = int(place)
            share = place - before
            before %= steps  # rounding may give `steps` itself
            limit = sine[before] * (1 - share) + sine[(before + 1) % steps] * share
            if height < limit:
                fate[patch, ray] = hidden
