"""The years of a time axis, one by one."""

import numpy as np
import pandas as pd

WHOLE = pd.Timedelta(days=364)  # a year that lacks more than a day and some is not told by itself


def split_years(times, interval):
    """Years that a time axis covers, counted from its first instant.

    Years may lie apart, and a calendar may begin at another hour than that of UTC.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (T,)
        Start of each interval, tz-aware, ascending.
    interval : pandas.Timedelta

    Returns
    -------
    list of (int, numpy.ndarray)
        Year that holds most of it, and the intervals (k,) int; incomplete years are left out.
    """
    years, first = [], times[0]
    for number in range(times[-1].year - first.year + 1):
        start, stop = first + pd.DateOffset(years=number), first + pd.DateOffset(years=number + 1)
        inside = np.flatnonzero((times >= start) & (times < stop))
        if len(inside) * interval >= WHOLE:
            years.append(((start + (stop - start) / 2).year, inside))
    return years
