"""How much light of unobstructed surfaces lies below a horizon, or between two: bounds for the plan of effects."""

import numpy as np
import pandas as pd

from ..sun.solar_position import is_sunny, solar_position, sun_direction
from .horizon import TerrainHorizon, is_above
from .lost_sky import lost_sky

HOUR = pd.Timedelta(hours=1)
ROOT = np.sqrt(0.5)
# A level surface, four walls, and four roofs of 45°.
NORMALS = np.array(
    [(0, 0, 1)]
    + [(x, y, 0) for x, y in ((0, 1), (1, 0), (0, -1), (-1, 0))]
    + [(x * ROOT, y * ROOT, ROOT) for x, y in ((0, 1), (1, 0), (0, -1), (-1, 0))],
    float,
)


def suns_of_year(latitude, longitude, year=2021):
    """Directions to the sun in the hours of a year in which it stands above 2°: (s, 3) float64."""
    times = pd.date_range(f"{year}-01-01", f"{year + 1}-01-01", freq="h", tz="UTC", inclusive="left")
    sun = solar_position(times, HOUR, latitude, longitude)
    sunny = is_sunny(sun["apparent_zenith"])
    return sun_direction(sun["apparent_zenith"][sunny], sun["solar_azimuth"][sunny])


def hidden_shares(horizon, suns):
    """Shares of the light of unobstructed surfaces that a horizon hides.

    Parameters
    ----------
    horizon : TerrainHorizon
    suns : (s, 3) float64
        Directions, all with the same irradiance: low ones count for more than they have.

    Returns
    -------
    sky, sun : (n,) float64
        For each of NORMALS, of its diffuse light from the sky and of its direct light.
    """
    sky = lost_sky(NORMALS, horizon) / ((1 + NORMALS[:, 2]) / 2)
    received = np.maximum(suns @ NORMALS.T, 0)
    whole = received.sum(axis=0)
    lost = received[~is_above(horizon, suns)].sum(axis=0)
    return sky, np.divide(lost, whole, out=np.zeros(len(NORMALS)), where=whole > 0)


def bound_of_horizon(horizon, suns):
    """What an unobstructed surface of any of NORMALS loses behind a horizon at most, as a share of its light."""
    return float(max(part.max() for part in hidden_shares(horizon, suns)))


def bound_between(horizon, others, suns):
    """What the light of a place may differ by if it has one of several other horizons instead of this one.

    Parameters
    ----------
    horizon : TerrainHorizon
    others : list of TerrainHorizon
    suns : (s, 3) float64

    Returns
    -------
    float
        0 without others.
    """
    largest = 0.0
    here = hidden_shares(horizon, suns)
    for other in others:
        # Where one rises and the other falls, both count: the light between their lower and higher edge.
        edges = [TerrainHorizon(edge(horizon.elevation, other.elevation)) for edge in (np.minimum, np.maximum)]
        low, high = (hidden_shares(one, suns) for one in edges)
        # What is left of the light here is what the difference is a share of.
        for few, many, own in zip(low, high, here, strict=True):
            left = np.maximum(1 - own, 1e-9)
            largest = max(largest, float(((many - few) / left).max()))
    return largest
