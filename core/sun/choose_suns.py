"""Choose the suns to trace, from the user's setting: the sun sampling."""

import numpy as np

from ..check_arrays import check_seed
from ..errors import InputError
from .days_of_year import days_of_year_suns
from .match_suns import weigh_by_year
from .sky_grid import sky_grid_suns
from .solar_position import DAY, check_place, check_times, is_sunny, solar_days, solar_position, sun_direction
from .suns import Suns, TimeAxis
from .typical_days import typical_day_suns

CURE = "give hourly, days:N, typical-days:N or sky-grid:N"
FEWEST_DIRECTIONS, MOST_DIRECTIONS = 16, 1_000_000


def choose_suns(sampling, times, interval, latitude, longitude, seed=0, *, position=None):  # noqa: PLR0917
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
        Place [°], preferably that of the weather.
    seed : int
        Seed of the clustering.
    position : pandas.DataFrame, optional
        Of `solar_position` for this time axis and place, if known; further columns do not matter.

    Returns
    -------
    Suns
        For a sky grid the directions are the same everywhere; only the weights depend on the time axis and the place.

    Raises
    ------
    InputError
        If the setting is invalid or asks for more days than there are, or the place is not on Earth.
    """
    name, count = parse_sampling(sampling)
    check_times(times, interval)
    check_place(latitude, longitude)
    check_seed(seed)
    year = TimeAxis(times, interval, latitude, longitude)
    if name == "hourly":
        return hourly_suns(*year, position)
    if name == "sky-grid":
        return weigh_by_year(sky_grid_suns(count), *year, position=position)
    days = len(times) * interval // DAY
    if count > days:
        raise InputError("--suns", f"{count} {name.replace('-', ' ')} of {days} days", "ask for fewer, or for hourly")
    if name == "typical-days":
        return typical_day_suns(*year, count=count, seed=seed)
    return weigh_by_year(days_of_year_suns(*year, count=count), *year, position=position)


def parse_sampling(sampling):
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
    if name not in ("days", "typical-days", "sky-grid") or not (number.isascii() and number.isdigit()):
        raise InputError("--suns", f"{sampling!r} is unknown", CURE)
    count, least = int(number), FEWEST_DIRECTIONS if name == "sky-grid" else 1
    if count < least:
        raise InputError("--suns", f"{sampling!r} is too few", f"give {name}:{least} or more")
    if count > MOST_DIRECTIONS:
        raise InputError("--suns", f"{sampling!r} is too many", f"give {name}:{MOST_DIRECTIONS} at most")
    return name, count


def hourly_suns(times, interval, latitude, longitude, position=None):
    """The sun of every interval with an elevation of at least 2°: the reference, and the most expensive choice.

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
    return Suns("hourly", direction, weight, day[sunny].astype(np.int32), step[sunny].astype(np.int32))
