"""The sun sampling: which suns are traced, and which of them represent each interval of a time
axis.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import KDTree

from ..settings.errors import InputError
from .days_of_year import days_of_year_suns, match_days_of_year
from .sky_grid import SkyTriangles, sky_grid_suns
from .solar_position import (
    DAY,
    MINIMUM_ELEVATION,
    check_place,
    check_times,
    is_sunny,
    solar_days,
    solar_position,
    sun_direction,
)
from .suns import Suns, TimeAxis
from .typical_days import typical_day_suns

SAMPLINGS = ("hourly", "days", "typical-days", "sky-grid")


def choose_suns(sampling, times, interval, latitude, longitude, *, position=None):
    """Suns to trace for a time axis at a place.

    Parameters
    ----------
    sampling : str
        "hourly", "days:N", "typical-days:N" or "sky-grid:N".
    times : pandas.DatetimeIndex, (t,)
        Start of each interval, tz-aware.
    interval : pandas.Timedelta
        Length of the intervals.
    latitude, longitude : float
        Place [°], preferably the weather's.
    position : pandas.DataFrame, optional
        Of `solar_position` for this time axis and place, if known; further columns do not matter.

    Returns
    -------
    Suns
        For a sky grid the directions are the same everywhere; only the weights depend on the time
        axis and the place.

    Raises
    ------
    InputError
        If the setting is invalid or asks for more days than there are, or the place is not on
        Earth.
    """
    name, count = parse_sampling(sampling)
    check_times(times, interval)
    check_place(latitude, longitude)
    year = TimeAxis(times, interval, latitude, longitude)
    # Suns of every hour, of a grid of directions, or of some days; weights are of the year at this
    # place.
    if name == "hourly":
        return hourly_suns(*year, position)
    if name == "sky-grid":
        return weigh_by_year(sky_grid_suns(count), *year, position=position)
    days = len(times) * interval // DAY
    if count > days:
        raise InputError(
            "--suns",
            f"{count} {name.replace('-', ' ')} of {days} days",
            "ask for fewer, or for hourly",
        )
    suns_of_days = typical_day_suns if name == "typical-days" else days_of_year_suns
    return weigh_by_year(suns_of_days(*year, count=count), *year, position=position)


def parse_sampling(sampling, *, most_directions=1_000_000):
    """Parse a setting into its name and number.

    Parameters
    ----------
    sampling : str
        As in `choose_suns`.

    Returns
    -------
    name : {"hourly", "days", "typical-days", "sky-grid"}
    count : int
        0 for "hourly".
    """
    name, _, number = str(sampling).partition(":")
    if sampling == "hourly":
        return name, 0
    if name not in SAMPLINGS[1:] or not (number.isascii() and number.isdigit()):
        raise InputError(
            "--suns",
            f"{sampling!r} is unknown",
            "give hourly, days:N, typical-days:N or sky-grid:N",
        )
    # A sky grid needs 16 directions to interpolate over the whole sky.
    count, least = int(number), 16 if name == "sky-grid" else 1
    if count < least:
        raise InputError("--suns", f"{sampling!r} is too few", f"give {name}:{least} or more")
    if count > most_directions:
        raise InputError(
            "--suns", f"{sampling!r} is too many", f"give {name}:{most_directions} at most"
        )
    return name, count


def hourly_suns(times, interval, latitude, longitude, position=None):
    """The sun of every interval with an elevation of at least 2°: the reference, and the most
    expensive choice.

    Parameters
    ----------
    times, interval, latitude, longitude, position
        As in `choose_suns`.

    Returns
    -------
    Suns
        Sampling "hourly"; `day` counts the solar days of the axis from 0.
    """
    sun = solar_position(times, interval, latitude, longitude) if position is None else position
    sunny = is_sunny(sun["apparent_zenith"])
    direction = sun_direction(sun["apparent_zenith"][sunny], sun["solar_azimuth"][sunny])
    day, step = (np.asarray(part) for part in solar_days(times, interval, longitude))
    weight = np.full(len(direction), 1.0 / max(len(direction), 1))
    day = day - day[:1].sum()  # of the first interval, if any
    return Suns(
        "hourly", direction, weight, day[sunny].astype(np.int32), step[sunny].astype(np.int32)
    )


@dataclass
class _SunMatch:
    """Which traced suns represent each interval of a time axis."""

    index: np.ndarray  # (T, k) int32 into the suns; 0 where the weight is 0
    # (T, k) float64; rows sum to 1, or to 0 if the sun is too low; some are negative
    weight: np.ndarray


def match_suns(
    suns, times, interval, latitude, longitude, *, lowest=MINIMUM_ELEVATION, position=None
):
    """Which traced suns represent each interval of a time axis.

    Hourly and typical days: the nearest sun, which of hourly ones is the interval's own on the
    traced axis. Days of the year: up to 16 suns of the four days around it in the season,
    weighted, or the nearest sun where it is closer. Sky grid: the three directions around the sun,
    weighted. Year and place may differ from where and when was traced.

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
        Apparent elevation [°] from which suns are represented, also below 2°.
    position : pandas.DataFrame, optional
        Of `solar_position` for this time axis and place, if known; further columns do not matter.

    Returns
    -------
    SunMatch
        `index` and `weight`, (t, k): suns by their numbers, and shares that sum to 1; weights are 0
        for lower suns, and everywhere if no interval has the sun at 2° or higher.

    Raises
    ------
    InputError
        The sampling is unknown, or no sun was traced although one is needed.
    """
    # Suns of another sampling, or none at all under a sun above 2°, are refused.
    suns.check()
    if suns.sampling.partition(":")[0] not in SAMPLINGS:
        raise InputError(
            "suns",
            f"the sampling {suns.sampling!r} is unknown",
            f"give one of {', '.join(SAMPLINGS)}",
        )
    sun = solar_position(times, interval, latitude, longitude) if position is None else position
    sunny = is_sunny(sun["apparent_zenith"])
    # Where no interval has the sun at 2° or higher, all weights are 0.
    if not sunny.any():
        return _SunMatch(np.zeros((len(times), 1), np.int32), np.zeros((len(times), 1), float))
    if not len(suns):
        raise InputError(
            "suns",
            "none was traced, but the sun is above 2° on this time axis",
            "trace again for this year and place",
        )
    # Weights by the way in which the suns were chosen: three directions of a grid, suns of the days
    # around in the season, or the nearest sun. Intervals count whose sun is at 2° or higher, or
    # reaches `lowest`.
    up = sunny | (90.0 - sun["apparent_zenith"].to_numpy() >= lowest)
    direction = sun_direction(sun["apparent_zenith"][up], sun["solar_azimuth"][up])
    if suns.sampling.startswith("sky-grid"):
        match, share = SkyTriangles.of(suns).match(direction)
    elif suns.sampling.startswith("days"):
        match, share = match_days_of_year(
            suns, direction, solar_days(times, interval, longitude)[0][up]
        )
    else:
        match, share = (
            KDTree(suns.direction).query(direction)[1][:, None],
            np.ones((len(direction), 1)),
        )
    # Rows of all intervals; those without sun have no weight.
    index = np.zeros((len(times), match.shape[1]), np.int32)
    weight = np.zeros(index.shape, float)
    index[up], weight[up] = match, share
    return _SunMatch(index, weight)


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
