"""Match each interval of a time axis to the traced suns that represent it, and take their values."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import KDTree

from ..errors import InputError
from .days_of_year import match_days_of_year
from .sky_grid import match_sky_grid
from .solar_position import MINIMUM_ELEVATION, is_sunny, solar_days, solar_position, sun_direction
from .suns import check_suns
from .typical_days import match_typical_days

SAMPLINGS = ("hourly", "days", "typical-days", "sky-grid")


@dataclass
class SunMatch:
    """Which traced suns represent each interval of a time axis."""

    index: np.ndarray  # (T, k) int32 into the suns; 0 where the weight is 0
    weight: np.ndarray  # (T, k) float64; rows sum to 1, or to 0 if the sun is too low; some are negative


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
    if suns.sampling.partition(":")[0] not in SAMPLINGS:
        raise InputError("suns", f"the sampling {suns.sampling!r} is unknown", f"give one of {', '.join(SAMPLINGS)}")
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
        found, share = match_directions(suns, direction)
        index[low, : found.shape[1]], weight[low, : found.shape[1]] = found, share
    return SunMatch(index, weight)


def match_directions(suns, direction, day=None):
    """Which traced suns represent some suns.

    Parameters
    ----------
    suns : Suns
        As traced.
    direction : numpy.ndarray, (t, 3)
        Towards the sun of each interval.
    day : numpy.ndarray, (t,) int, optional
        Its day of local solar time; without it the nearest traced sun is taken, or the three around it in a sky grid.

    Returns
    -------
    index : numpy.ndarray, (t, k) int
    weight : numpy.ndarray, (t, k)
        Rows sum to 1.
    """
    name = suns.sampling.partition(":")[0]
    if name == "sky-grid":
        return match_sky_grid(suns, direction)
    if name == "days" and day is not None:
        return match_days_of_year(suns, direction, day)
    if name == "typical-days" and day is not None:
        near = match_typical_days(suns, direction, day)
    else:
        near = KDTree(suns.direction).query(direction)[1]
    return near[:, None], np.ones((len(near), 1))


def values_at(values, index, weight):
    """Values of the traced suns, (s, n), at the intervals that they represent: (t, n).

    Parameters
    ----------
    values : numpy.ndarray, (s, n)
        In any unit.
    index, weight : numpy.ndarray, (t, k)
        As of `SunMatch`. A single sun, k = 1, has the weight 1.
    """
    if index.shape[1] == 1:
        return np.take(values, index[:, 0], axis=0, mode="clip")
    return sum(
        np.take(values, index[:, column], axis=0, mode="clip") * weight[:, column, None]
        for column in range(index.shape[1])
    )


def largest_mismatch(suns, direction, index, weight):
    """Largest angle between the sun of an interval, unit vectors (t, 3), and a traced one that represents it: [°]."""
    angle = 0.0
    for column in range(index.shape[1]):
        used = weight[:, column] != 0
        cosine = np.einsum("hi,hi->h", suns.direction[index[used, column]], direction[used])
        angle = max(angle, float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).max(initial=0.0)))
    return angle


def weigh_by_year(suns, times, interval, latitude, longitude, *, position=None):
    """Weight each sun with the share of the sunny intervals that it represents, by `match_suns`.

    Parameters and errors as in `match_suns`.

    Returns
    -------
    Suns
        Unchanged if no interval is sunny.
    """
    match = match_suns(suns, times, interval, latitude, longitude, position=position)
    share = np.bincount(match.index.ravel(), weights=match.weight.ravel(), minlength=len(suns))
    share = np.maximum(share, 0.0)  # an outer node of the interpolation may have a negative sum
    return replace(suns, weight=share / share.sum()) if share.sum() > 0 else suns
