"""Series on whole intervals of a calendar year: a file's own times rarely begin one.

ERA5's 2017 begins at 23:00 of 31 December 2016, years of PVGIS at the satellite's 23:40:34, and
neither fits a load profile. Power is constant over each interval of the weather; what a whole
interval holds of two of them is its mean. Intervals at the ends of the calendar year that the
weather lacks are taken from the other end of the same year.
"""

import re
from datetime import UTC, timedelta, timezone

import numpy as np
import pandas as pd
from scipy import sparse

from ..settings.errors import InputError


def read_zone(text):
    """Fixed offset from UTC: "utc" or "+01:00", without summer time; None for "file", the weather's
    own times.

    Raises
    ------
    InputError
    """
    if text == "file":
        return None
    if text.lower() == "utc":
        return UTC
    match = re.fullmatch(r"([+-])(\d{1,2}):(00|15|30|45)", text.strip())
    if not match or int(match[2]) > 14:
        raise InputError(
            "--time-axis",
            f"{text!r} is no fixed offset from UTC",
            "give utc, or hours and minutes such as +01:00 or -03:30, or file",
        )
    offset = timedelta(hours=int(match[2]), minutes=int(match[3]))
    return timezone(-offset if match[1] == "-" else offset)


def lay_on_axis(times, interval, zone):
    """Whole intervals of calendar years, and what they hold of the intervals of a weather.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (T,)
        Start of each interval, tz-aware, ascending.
    interval : pandas.Timedelta
        A whole part of an hour, or an hour.
    zone : datetime.timezone
        Offset of the calendar from UTC.

    Returns
    -------
    axis : pandas.DatetimeIndex, (S,)
        Starts in that zone, from midnight of 1 January of each year that the weather covers for the
        most part. Days that it lacks, such as 29 February, are left out.
    share : scipy.sparse.csr_array, (S, T)
        Share of the interval of the axis in each interval of the weather; rows sum up to 1.

    Raises
    ------
    InputError
        It covers no calendar year.
    """
    # Calendar years that the weather covers by nine tenths, each as whole intervals from midnight.
    own = times.tz_convert(zone)
    middle = own + interval / 2
    step = interval.value
    starts = own.as_unit("ns").asi8
    pieces = []
    for year, count in zip(*np.unique(middle.year, return_counts=True), strict=True):
        begin, end = (
            pd.Timestamp(year=number, month=1, day=1, tz=zone) for number in (year, year + 1)
        )
        if count * interval < (end - begin) * 0.9:
            continue
        whole = pd.date_range(begin, end, freq=interval, inclusive="left").as_unit("ns").asi8
        pieces.append((whole, (end - begin).value))
    if not pieces:
        raise InputError(
            "--time-axis",
            f"the weather, from {own[0]:%Y-%m-%d} to {own[-1]:%Y-%m-%d}, covers no calendar year "
            "by nine tenths",
            "give --time-axis file, or weather from January to December",
        )
    axis, first, second, part = ([] for _ in range(4))
    for whole, length in pieces:
        # The interval of the axis begins within one of the weather, and ends in the next. Where the
        # weather has none at that time, the same time a year later or earlier is taken.
        one = _rows_at(starts, step, whole, length)
        # elapsed  of the weather's interval when the axis' one begins [ns]; what lacks comes from
        # the next.
        #
        # weather  ├── one ──┼─ other ─┤
        # axis         ├─────────┤
        #          ├───┤ elapsed
        elapsed = np.where(one >= 0, (whole - starts[one]) % step, 0)
        other = np.where(elapsed == 0, one, _rows_at(starts, step, whole + step - elapsed, length))
        # An interval of the axis is left out where one of its two parts is in none of these years.
        kept = (one >= 0) & (other >= 0)
        axis.append(whole[kept])
        first.append(one[kept])
        second.append(other[kept])
        part.append((1.0 - elapsed / step)[kept])
    axis, first, second, part = (np.concatenate(values) for values in (axis, first, second, part))
    # One row of shares for each interval of the axis: the rest of the first, then the start of the
    # second.
    rows = np.arange(len(axis))
    values, places = np.r_[part, 1.0 - part], (np.r_[rows, rows], np.r_[first, second])
    share = sparse.csr_array((values, places), shape=(len(axis), len(times)))
    return pd.DatetimeIndex(axis, tz="UTC").tz_convert(zone), share


def _rows_at(starts, step, moments, length):
    """Interval that holds each moment, or the same a year (of a length) later or earlier; -1 where
    there is none.
    """
    rows_of_moments = np.full(len(moments), -1)
    for shift in (0, length, -length):
        row = np.searchsorted(starts, moments + shift, side="right") - 1
        inside = (row >= 0) & (moments + shift < starts[row] + step)
        rows_of_moments = np.where((rows_of_moments < 0) & inside, row, rows_of_moments)
    return rows_of_moments
