"""Suns of some days, evenly spread over the year, for interpolation between them."""

import numpy as np
import pandas as pd

from .solar_days import solar_days, whole_solar_days
from .solar_position import solar_position, sun_direction
from .suns import Suns

DAY = pd.Timedelta(days=1)
TROPICAL_YEAR = 365.2422  # days: period of the sun's declination and the equation of time
SHORTEST_STEP = pd.Timedelta(minutes=15)  # between traced suns, in which the sun moves by 3.75°
EPOCH = 719_163  # 1970-01-01 as datetime.date.toordinal counts days


def days_of_year_suns(times, interval, latitude, longitude, *, count=24):
    """Suns of days evenly spread over the year.

    Each day is one of the time axis, with the sun at the middle of every interval in which it is above the horizon.
    Time steps shorter than 15 minutes are merged into steps of 15 minutes or slightly more.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (t,)
        Start of each interval, tz-aware.
    interval : pandas.Timedelta
        Length of the intervals.
    latitude, longitude : float
        Place [°].
    count : int
        Number of days.

    Returns
    -------
    Suns
        Way "days:N", not weighted yet; `day` is the proleptic Gregorian ordinal of the day of local solar time.
    """
    every = merge_steps(interval)
    axis = whole_solar_days(times[::every], interval * every, longitude)
    steps = DAY // (interval * every)
    day, step = (part.reshape(-1, steps) for part in solar_days(axis, interval * every, longitude))
    # Days of all years, sorted by the time of the year.
    season = np.argsort((day[:, 0] + EPOCH) % TROPICAL_YEAR, kind="stable")
    chosen = season[((np.arange(count) + 0.5) / count * len(season)).astype(int)]
    rows = (chosen[:, None] * steps + np.arange(steps)).ravel()
    sun = solar_position(axis[rows], interval * every, latitude, longitude)
    up = sun["apparent_zenith"].to_numpy() <= 90.0
    direction = sun_direction(sun["apparent_zenith"][up], sun["solar_azimuth"][up])
    day, step = (part[chosen].ravel()[up].astype(np.int32) for part in (day + EPOCH, step))
    return Suns(f"days:{count}", direction, np.full(len(direction), 1.0 / max(len(direction), 1)), day, step)


def merge_steps(interval):
    """Number of intervals per step of traced suns, such that the steps divide the day."""
    every = max(1, -(-SHORTEST_STEP // interval))
    while DAY % (interval * every) != pd.Timedelta(0) and interval * every < DAY:
        every += 1
    return every
