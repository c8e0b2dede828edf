"""Which directions of the sky grid stand for the sun of each hour of a place: exactly, or as in the paper."""

import numpy as np
import pandas as pd

from ..sun.sky_grid import match_triangles
from ..sun.solar_position import is_sunny, sun_direction, sun_of_place
from .sum_groups import Sunlight

WAYS = ("exact", "paper")
DEGREES_PER_HOUR = 15.0
SINGLE = np.float32


def match_hours(sky, hours):
    """The three grid directions around the place's own sun.

    Hours without direct light, or with the sun below the horizon, have weights of zero.

    Parameters
    ----------
    sky : SkyTriangles
    hours : PlaceHours

    Returns
    -------
    Sunlight
        Of one sun.
    """
    bright = (hours.light[:, 0] > 0) & (hours.direction[:, 2] >= 0)
    index, weight = match_some(sky, hours.direction, bright)
    level = hours.dni * np.maximum(hours.direction[:, 2], 0.0) + hours.ground
    return Sunlight(index[:, None], weight[:, None], hours.direction[:, None].astype(SINGLE), level.astype(SINGLE))


def match_shifted(sky, hours, sun, latitude, longitude):
    """Suns of Greenwich at the nearest whole degree of latitude, shifted in time (paper, section 2.4 and Fig. 3).

    What each surface gets relative to DNI is taken at Greenwich, longitude/15 hours later, from a parabola through the
    three nearest intervals. Below 2° of elevation it is zero there. The year is cyclic.

    Parameters
    ----------
    sky : SkyTriangles
    hours : PlaceHours
    sun : GeocentricSun
        Of the weather's whole time axis.
    latitude, longitude : float
        Place [°].

    Returns
    -------
    Sunlight
        Of three suns.
    """
    greenwich = sun_of_place(sun, float(np.round(latitude)), 0.0)
    direction = sun_direction(greenwich["apparent_zenith"], greenwich["solar_azimuth"])
    index, weight = match_some(sky, direction, is_sunny(greenwich["apparent_zenith"]))
    step = (sun.times[1] - sun.times[0]) / pd.Timedelta(hours=1)
    later = longitude / DEGREES_PER_HOUR / step
    middle = int(np.floor(later + 0.5))
    nodes = (hours.interval[:, None] + middle + np.array([-1, 0, 1])) % len(direction)  # (h, 3)
    share = parabola(later - middle)
    suns = direction[nodes]
    used = share * weight[nodes].any(axis=2)  # suns that are too low have no light
    level = hours.dni * (used * np.maximum(suns[:, :, 2], 0.0)).sum(axis=1) + hours.ground
    shares = (weight[nodes] * share[:, None]).astype(SINGLE)
    return Sunlight(index[nodes], shares, suns.astype(SINGLE), level.astype(SINGLE))


def parabola(place):
    """Weights of values at -1, 0 and 1 in the parabola through them, at a place between -0.5 and 0.5: (3,)."""
    return np.array([place * (place - 1) / 2, 1 - place**2, place * (place + 1) / 2])


def match_some(sky, direction, chosen):
    """Grid directions around some suns, index and weight 0 for the others: (t, 3) int64, (t, 3) float32."""
    index, weight = np.zeros((len(direction), 3), np.int64), np.zeros((len(direction), 3), SINGLE)
    index[chosen], weight[chosen] = match_triangles(sky, direction[chosen])
    return index, weight
