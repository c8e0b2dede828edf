"""The suns of all hours of the year: the reference, and the most expensive choice."""

import numpy as np

from .solar_days import solar_days
from .solar_position import is_sunny, solar_position, sun_direction
from .suns import Suns


def hourly_suns(times, interval, latitude, longitude, position=None):
    """The sun of every interval with an elevation of at least 2°.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (t,)
        Start of each interval, tz-aware.
    interval : pandas.Timedelta
        Length of the intervals.
    latitude, longitude : float
        Place [°].
    position : pandas.DataFrame, optional
        Of `solar_position` for this time axis and place, if known; further columns do not matter.

    Returns
    -------
    Suns
        Way "hourly"; `day` counts the solar days of the axis from 0.
    """
    sun = solar_position(times, interval, latitude, longitude) if position is None else position
    sunny = is_sunny(sun["apparent_zenith"])
    direction = sun_direction(sun["apparent_zenith"][sunny], sun["solar_azimuth"][sunny])
    day, step = (np.asarray(part) for part in solar_days(times, interval, longitude))
    weight = np.full(len(direction), 1.0 / max(len(direction), 1))
    day = day - day[:1].sum()  # of the first interval, if any
    return Suns("hourly", direction, weight, day[sunny].astype(np.int32), step[sunny].astype(np.int32))
