"""Put typical years, which consist of months of different years, into one calendar year."""

import pandas as pd

TYPICAL_YEAR = 2021  # a year without a leap day
TYPICAL_LEAP_YEAR = 2020


def coerce_year(data):
    """Put the rows of a typical year into one calendar year, in order.

    One real year, or several consecutive ones, are unchanged.

    Parameters
    ----------
    data : pandas.DataFrame
        Indexed by the tz-aware start of each interval in the file's own standard time.

    Returns
    -------
    data : pandas.DataFrame
        Indexed in the same time zone, ascending.
    typical : bool
        Whether the year was changed.
    """
    times = data.index
    leap_day = bool(((times.month == 2) & (times.day == 29)).any())
    steps = times[1:] - times[:-1]
    if len(set(times.year)) == 1 or len(set(steps)) == 1:
        return data, False
    year = TYPICAL_LEAP_YEAR if leap_day else TYPICAL_YEAR
    days = pd.to_datetime(pd.DataFrame({"year": year, "month": times.month, "day": times.day}))
    moved = pd.DatetimeIndex(days).tz_localize(times.tz) + (times - times.normalize())
    return data.set_axis(moved, axis=0).sort_index(kind="stable"), True
