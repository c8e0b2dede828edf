"""Refuse invalid suns, times and places."""

import numpy as np
import pandas as pd

from ..settings.errors import UNIT, InputError, check_array, check_unit

BELOW_HORIZON = -1e-6  # sine of the elevation down to which a sun counts as on the horizon (rounding)
SECOND, INSTANT = pd.Timedelta(seconds=1), pd.Timedelta(0)
DAY = pd.Timedelta(days=1)
BOUNDS = {"latitude": 90, "longitude": 360}  # [°]


def check_suns(suns):
    """Refuse suns without direction or weight, or below the horizon.

    Parameters
    ----------
    suns : Suns

    Raises
    ------
    InputError
    """
    name = "direction of the suns"
    check_array("weight of the suns", suns.weight, (len(np.asarray(suns.direction)),), least=0, most=1 + UNIT)
    direction = check_unit(name, suns.direction)
    low = direction[:, 2] < BELOW_HORIZON
    if low.any():
        first = int(np.flatnonzero(low)[0])
        problem = f"row {first} is {direction[first]}, below the horizon"
        raise InputError(name, problem, "leave out suns below the horizon")


def check_times(times, interval, shortest=SECOND):
    """Refuse an invalid time axis, and intervals without length.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (t,)
        tz-aware.
    interval : pandas.Timedelta
    shortest : pandas.Timedelta
        Shortest interval allowed; 0 to allow instants.

    Raises
    ------
    InputError
    TypeError
        If the times have no time zone.
    """
    if not isinstance(times, pd.DatetimeIndex):
        raise InputError("times", f"a {type(times).__name__}", "give a pandas.DatetimeIndex with a time zone")
    if times.tz is None:
        raise TypeError("times have no time zone; see pandas.DatetimeIndex.tz_localize")
    if times.hasnans:
        first = int(np.flatnonzero(times.isna())[0])
        raise InputError("times", f"row {first} is not a time", "leave it out or fill it in")
    if not (isinstance(interval, pd.Timedelta) and shortest <= interval <= DAY):
        raise InputError("interval", f"{interval!r}", f"give a pandas.Timedelta from {shortest} to {DAY}")


def check_place(latitude, longitude):
    """Refuse a place that is not on Earth.

    Parameters
    ----------
    latitude, longitude : float
        [°]

    Raises
    ------
    InputError
    """
    for (name, bound), value in zip(BOUNDS.items(), (latitude, longitude), strict=True):
        if not (isinstance(value, int | float | np.number) and abs(value) <= bound):  # also true for NaN
            raise InputError(f"--{name}", f"{value} is out of bounds", f"give degrees between -{bound} and {bound}")
