"""Split a time axis into years."""

import numpy as np
import pandas as pd

WHOLE = pd.Timedelta(days=364)  # shorter years are not reported separately


def split_years(times, interval):
    """Years of a time axis, counted from its first instant.

    There may be gaps between years, and a year may start at another hour than in UTC.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (T,)
        Start of each interval, tz-aware, ascending.
    interval : pandas.Timedelta

    Returns
    -------
    list of (int, numpy.ndarray)
        Calendar year that contains most of it, and its intervals (k,) int; incomplete years are skipped.
    """
    years, first = [], times[0]
    for number in range(times[-1].year - first.year + 1):
        start, stop = first + pd.DateOffset(years=number), first + pd.DateOffset(years=number + 1)
        inside = np.flatnonzero((times >= start) & (times < stop))
        if len(inside) * interval >= WHOLE:
            years.append(((start + (stop - start) / 2).year, inside))
    return years
