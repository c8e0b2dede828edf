"""Refuse weather from which full load hours cannot be computed."""

from itertools import pairwise

import numpy as np
import pandas as pd

from ..settings.errors import InputError

DAY = pd.Timedelta(days=1)
HOUR = pd.Timedelta(hours=1)

# Values outside are impossible on Earth: another unit, or a marker for missing values.
LIMITS = {
    "ghi": (-1.0, 2000.0, "Wm⁻²"),
    "dhi": (-1.0, 2000.0, "Wm⁻²"),
    "dni": (-1.0, 2000.0, "Wm⁻²"),
    "temp_air": (-95.0, 70.0, "°C"),
    "wind_speed": (0.0, 120.0, "ms⁻¹"),
    "pressure": (30e3, 115e3, "Pa"),
}


def check_weather(record):
    """Refuse a record with missing variables or values, a broken time axis, or less than whole years.

    Upper limits are checked later by `check_values`, after `check_irradiance`, whose message on units is more helpful.

    Parameters
    ----------
    record : Record
        Record as read from a file.

    Returns
    -------
    pandas.Timedelta
        Length of the intervals.

    Raises
    ------
    InputError
        With the file, the place in it, and the cure.
    """
    check_variables(record)
    interval = check_time_axis(record.data.index, record.source)
    check_finite(record)
    check_values(record, lowest_only=True)
    return interval


def check_variables(record):
    """Refuse a record without air temperature, wind speed or two of ghi, dhi and dni."""
    columns = set(record.data.columns)
    missing = [name for name in ("temp_air", "wind_speed") if name not in columns]
    if len(columns & {"ghi", "dhi", "dni"}) < 2:
        missing.append(
            "two of ghi, dhi, dni (there: " + (", ".join(sorted(columns & {"ghi", "dhi", "dni"})) or "none") + ")"
        )
    if missing:
        raise InputError(record.source, "missing: " + ", ".join(missing), "add these columns to the weather")


def check_time_axis(times, source):
    """Refuse gaps, duplicates, intervals longer than one hour and anything but whole years.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (t,)
        Start of each interval.
    source : str
        The file, for the message.

    Returns
    -------
    pandas.Timedelta
        Length of the intervals.
    """
    if len(times) < 2:
        raise InputError(source, f"{len(times)} time stamps", "give at least one full year of hourly weather")
    step = times[1:] - times[:-1]
    disorder = np.flatnonzero(step <= pd.Timedelta(0))
    if len(disorder):
        stamp = times[disorder[0] + 1]
        raise InputError(
            source, f"the time {stamp} is repeated or out of order", "sort the times and remove duplicates"
        )
    interval = step.to_series().mode().iloc[0]
    if interval > HOUR or DAY % interval != pd.Timedelta(0):
        raise InputError(source, f"the times are {interval} apart", "give weather of every hour (or a part of one)")
    check_whole_years(times, interval, source)
    return interval


def check_whole_years(times, interval, source):
    """Refuse gaps and part years; whole calendar years may be left out between others.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (t,)
        Start of each interval, ascending.
    interval : pandas.Timedelta
        Length of the intervals.
    source : str
        The file, for the message.
    """
    breaks = np.flatnonzero((times[1:] - times[:-1] != interval) & ~skips_leap_day(times, interval)) + 1
    bounds = [0, *breaks, len(times)]
    spans = [(last - first) * interval for first, last in pairwise(bounds)]
    whole = [count_years(span) > 0 for span in spans]
    if len(breaks) and not all(whole):
        end, start = times[breaks[0] - 1] + interval, times[breaks[0]]
        what = "a gap" if start > end else "an overlap"
        raise InputError(source, f"{what} in the time axis from {end} to {start}", "fill the gap, or give whole years")
    if not all(whole):
        problem = f"covers {spans[0] / DAY:.2f} days, from {times[0]} to {times[-1] + interval}"
        raise InputError(source, problem, "give one or more full years: full load hours need full years")


def skips_leap_day(times, interval):
    """Where a time axis leaves out 29 February, as calendars of 365 days do.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (t,)
        Start of each interval, ascending.
    interval : pandas.Timedelta

    Returns
    -------
    numpy.ndarray, (t - 1,) bool
        Whether the step to the next time is such a gap, in any time zone.
    """
    middle = times[:-1] + interval + DAY / 2  # of the day that is left out, if it is
    leap_day = (middle.month == 2) & (middle.day == 29) | (
        (middle.month == 3) & (middle.day == 1) & middle.is_leap_year
    )
    leap_day |= (middle.month == 2) & (middle.day == 28) & middle.is_leap_year
    return np.asarray((times[1:] - times[:-1] == DAY + interval) & leap_day)


def count_years(span):
    """How many whole years a time span is: 365 to 366 days each, else 0.

    Parameters
    ----------
    span : pandas.Timedelta
        Length of an unbroken time axis.

    Returns
    -------
    int
        Number of years, 0 where the span is not whole years.
    """
    years = int(span // (365 * DAY))
    return years if span <= 366 * years * DAY else 0


def check_finite(record):
    """Refuse missing values, naming the first time."""
    for name in LIMITS:
        if name not in record.data.columns:
            continue
        missing = np.flatnonzero(~np.isfinite(record.data[name].to_numpy(dtype=float)))
        if len(missing):
            place = f"{name} is missing at {record.data.index[missing[0]]} ({len(missing)} values in total)"
            raise InputError(record.source, place, "fill the missing values")


def check_values(record, *, lowest_only=False):
    """Refuse impossible values, naming the first time.

    Parameters
    ----------
    record : Record
    lowest_only : bool
        Check the lower bounds only.
    """
    for name, (lowest, highest, unit) in LIMITS.items():
        if name not in record.data.columns:
            continue
        values = record.data[name].to_numpy(dtype=float)
        outside = np.flatnonzero((values < lowest) | ((values > highest) & (not lowest_only)))
        if len(outside):
            first = outside[0]
            place = f"{name} is {values[first]:g} {unit} at {record.data.index[first]}"
            cure = f"give values from {lowest:g} to {highest:g} {unit}"
            raise InputError(record.source, place, cure)
