"""Suns to trace, from the user's setting."""

import pandas as pd

from ..settings.errors import InputError, check_seed
from .check_suns import check_place, check_times
from .days_of_year import days_of_year_suns
from .hourly import hourly_suns
from .keep_suns import weigh_by_year
from .sky_grid import sky_grid_suns
from .suns import TimeAxis

CURE = "give hourly, days:N, typical-days:N or sky-grid:N"
FEWEST_DIRECTIONS, MOST_DIRECTIONS = 16, 1_000_000


def choose_suns(way, times, interval, latitude, longitude, seed=0, *, position=None):  # noqa: PLR0917
    """Suns to trace for a time axis at a place.

    Parameters
    ----------
    way : str
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
    name, count = parse_way(way)
    check_times(times, interval)
    check_place(latitude, longitude)
    check_seed(seed)
    if name == "hourly":
        return hourly_suns(times, interval, latitude, longitude, position)
    year = TimeAxis(times, interval, latitude, longitude)
    if name == "sky-grid":
        return weigh_by_year(sky_grid_suns(count), *year, position=position)
    days = len(times) * interval // pd.Timedelta(days=1)
    if count > days:
        raise InputError("--suns", f"{count} {name.replace('-', ' ')} of {days} days", "ask for fewer, or for hourly")
    if name == "typical-days":
        from .typical_days import typical_day_suns  # loads tsam, which takes as long as tracing a small scene

        return typical_day_suns(*year, count=count, seed=seed)
    return weigh_by_year(days_of_year_suns(*year, count=count), *year, position=position)


def parse_way(way):
    """Parse a setting into its name and number.

    Parameters
    ----------
    way : str
        As in `choose_suns`.

    Returns
    -------
    name : {"hourly", "days", "typical-days", "sky-grid"}
    count : int
        0 for "hourly".
    """
    name, _, number = str(way).partition(":")
    if way == "hourly":
        return name, 0
    if name not in ("days", "typical-days", "sky-grid") or not (number.isascii() and number.isdigit()):
        raise InputError("--suns", f"{way!r} is unknown", CURE)
    count, least = int(number), FEWEST_DIRECTIONS if name == "sky-grid" else 1
    if count < least:
        raise InputError("--suns", f"{way!r} is too few", f"give {name}:{least} or more")
    if count > MOST_DIRECTIONS:
        raise InputError("--suns", f"{way!r} is too many", f"give {name}:{MOST_DIRECTIONS} at most")
    return name, count
