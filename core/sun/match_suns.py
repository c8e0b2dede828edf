"""Rebuild a whole year from the suns that were traced."""

import numpy as np
from scipy.spatial import KDTree

from ..errors import InputError
from .check_suns import check_suns
from .match_sky_grid import match_sky_grid
from .match_typical_days import match_typical_days
from .solar_days import solar_days
from .solar_position import is_sunny, solar_position, sun_direction
from .suns import SunMatch

WAYS = ("hourly", "typical-days", "sky-grid")


def match_suns(suns, times, interval, latitude, longitude):
    """Which traced suns stand for each interval of a time axis.

    Hourly: the nearest sun, which is the interval's own on the axis that was traced. Typical days: a sun of the typical
    day that comes nearest to the interval's day. Sky grid: the three directions around the sun, weighted. The axis may
    be another year and the place another one than those traced for.

    Parameters
    ----------
    suns : Suns
        As traced.
    times : pandas.DatetimeIndex, (t,)
        Start of each interval, tz-aware.
    interval : pandas.Timedelta
        Length of the intervals.
    latitude, longitude : float
        Place [°].

    Returns
    -------
    SunMatch
        With weights of zero where the sun stands below 2°.
    """
    check_suns(suns)
    if not suns.way.startswith(WAYS):
        raise InputError("suns", f"the way {suns.way!r} is unknown", f"give one of {', '.join(WAYS)}")
    sun = solar_position(times, interval, latitude, longitude)
    sunny = is_sunny(sun["apparent_zenith"])
    direction = sun_direction(sun["apparent_zenith"][sunny], sun["solar_azimuth"][sunny])
    columns = 3 if suns.way.startswith("sky-grid") else 1
    index = np.zeros((len(times), columns), np.int32)
    weight = np.zeros((len(times), columns), np.float32)
    if not sunny.any():
        return SunMatch(index, weight)
    if not len(suns):
        problem = "none was traced, but the sun stands above 2° on this time axis"
        raise InputError("suns", problem, "trace them again, for a year and place that have sun")
    if suns.way.startswith("sky-grid"):
        index[sunny], weight[sunny] = match_sky_grid(suns, direction)
    elif suns.way.startswith("typical-days"):
        day, _ = solar_days(times, interval, longitude)
        index[sunny, 0], weight[sunny, 0] = match_typical_days(suns, direction, day[sunny]), 1.0
    else:
        index[sunny, 0], weight[sunny, 0] = KDTree(suns.direction).query(direction)[1], 1.0
    return SunMatch(index, weight)
