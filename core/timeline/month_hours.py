"""Hours of the average day of each month, in the standard time of the nearest meridian of 15°."""

import numpy as np
import pandas as pd

# Days whose extraterrestrial irradiation is nearest to the month's mean: S. A. Klein (1977),
# https://doi.org/10.1016/0038-092X(77)90001-9, table 1.
AVERAGE_DAYS = (17, 16, 16, 15, 15, 11, 17, 16, 15, 15, 14, 10)
HOURS = 24
COUNT = 12 * HOURS
HOUR = pd.Timedelta(hours=1)


def zone_of(longitude):
    """Standard time of the nearest meridian of 15°, whole hours ahead of UTC: int."""
    return round(longitude / 15.0)


def month_hours(year, longitude):
    """Starts of the 24 hours of each month's average day.

    Parameters
    ----------
    year : int
    longitude : float
        Of the place [°].

    Returns
    -------
    pandas.DatetimeIndex, (288,)
        UTC; January first, each month from midnight to midnight of `zone_of`.
    """
    days = [pd.Timestamp(year, month + 1, day) for month, day in enumerate(AVERAGE_DAYS)]
    local = pd.DatetimeIndex([day + hour * HOUR for day in days for hour in range(HOURS)])
    return (local - zone_of(longitude) * HOUR).tz_localize("UTC")


def mean_of_months(values, times, interval, longitude):
    """Mean of a quantity for each hour of the day of each month.

    Parameters
    ----------
    values : numpy.ndarray, (t,)
    times : pandas.DatetimeIndex, (t,)
        Starts of the intervals, tz-aware.
    interval : pandas.Timedelta
    longitude : float
        Of the place [°].

    Returns
    -------
    numpy.ndarray, (288,)
        NaN for hours without values.
    """
    local = (times + interval / 2).tz_convert("UTC").tz_localize(None) + zone_of(longitude) * HOUR
    place = (local.month.to_numpy() - 1) * HOURS + local.hour.to_numpy()
    count = np.bincount(place, minlength=COUNT)
    total = np.bincount(place, weights=np.asarray(values, float), minlength=COUNT)
    return np.divide(total, count, out=np.full(COUNT, np.nan), where=count > 0)
