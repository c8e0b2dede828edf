"""Match each interval of a time axis to the traced suns that represent it."""

import numpy as np
from scipy.spatial import KDTree

from ..settings.errors import InputError
from .check_suns import check_suns
from .match_days_of_year import match_days_of_year
from .match_sky_grid import match_sky_grid
from .match_typical_days import match_typical_days
from .solar_days import solar_days
from .solar_position import MINIMUM_ELEVATION, is_sunny, solar_position, sun_direction
from .suns import SunMatch

WAYS = ("hourly", "days", "typical-days", "sky-grid")


def match_suns(suns, times, interval, latitude, longitude, *, lowest=MINIMUM_ELEVATION, position=None):
    """Which traced suns represent each interval of a time axis.

    Hourly: the nearest sun, which is the interval's own on the traced axis. Days: the suns of the days before and
    after, weighted. Typical days: a sun of the typical day that is nearest to the interval's day. Sky grid: the three
    directions around the sun, weighted. Year and place may differ from those of tracing.

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
    lowest : float
        Apparent elevation [°] from which suns below 2°, which are never traced, are represented by the nearest traced
        sun, or by the three around it in a sky grid.
    position : pandas.DataFrame, optional
        Of `solar_position` for this time axis and place, if known; further columns do not matter.

    Returns
    -------
    SunMatch
        With zero weights for lower suns.
    """
    check_suns(suns)
    if suns.way.partition(":")[0] not in WAYS:
        raise InputError("suns", f"the way {suns.way!r} is unknown", f"give one of {', '.join(WAYS)}")
    sun = solar_position(times, interval, latitude, longitude) if position is None else position
    sunny = is_sunny(sun["apparent_zenith"])
    direction = sun_direction(sun["apparent_zenith"][sunny], sun["solar_azimuth"][sunny])
    if not sunny.any():
        return SunMatch(np.zeros((len(times), 1), np.int32), np.zeros((len(times), 1), float))
    if not len(suns):
        problem = "none was traced, but the sun is above 2° on this time axis"
        raise InputError("suns", problem, "trace again for this year and place")
    day, _ = solar_days(times, interval, longitude)
    found, share = match_directions(suns, direction, day[sunny])
    index = np.zeros((len(times), found.shape[1]), np.int32)
    weight = np.zeros(index.shape, float)
    index[sunny], weight[sunny] = found, share
    low = (90.0 - sun["apparent_zenith"].to_numpy() >= lowest) & ~sunny
    if low.any():
        direction = sun_direction(sun["apparent_zenith"][low], sun["solar_azimuth"][low])
        found, share = match_low_suns(suns, direction)
        index[low, : found.shape[1]], weight[low, : found.shape[1]] = found, share
    return SunMatch(index, weight)


def match_directions(suns, direction, day):
    """Which traced suns represent each sunny interval.

    Parameters
    ----------
    suns : Suns
        As traced.
    direction : numpy.ndarray, (t, 3)
        Towards the sun of each interval.
    day : numpy.ndarray, (t,) int
        Its day of local solar time.

    Returns
    -------
    index : numpy.ndarray, (t, k) int
    weight : numpy.ndarray, (t, k)
        Rows sum to 1.
    """
    name = suns.way.partition(":")[0]
    if name == "sky-grid":
        return match_sky_grid(suns, direction)
    if name == "days":
        return match_days_of_year(suns, direction, day)
    near = match_typical_days(suns, direction, day) if name == "typical-days" else nearest_sun(suns, direction)
    return near[:, None], np.ones((len(near), 1))


def nearest_sun(suns, direction):
    """The traced sun nearest to each direction, unit vectors (t, 3): (t,) int."""
    return KDTree(suns.direction).query(direction)[1]


def match_low_suns(suns, direction):
    """Traced suns that represent suns below 2°, and their weights: (t, 1) int and float; of a sky grid (t, 3)."""
    if suns.way.startswith("sky-grid"):
        return match_sky_grid(suns, direction)
    return nearest_sun(suns, direction)[:, None], np.ones((len(direction), 1))
