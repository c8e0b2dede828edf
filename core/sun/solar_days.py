"""Days of local mean solar time."""

import pandas as pd

DAY = pd.Timedelta(days=1)


def solar_days(times, interval, longitude):
    """Day of local mean solar time of each interval, and its step within the day.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (t,)
        Start of each interval, tz-aware.
    interval : pandas.Timedelta
        Length of the intervals, an integer fraction of a day.
    longitude : float
        Longitude of the place [°]: 15° are one hour.

    Returns
    -------
    day : numpy.ndarray, (t,) int64
        Days since 1970-01-01 of local solar time.
    step : numpy.ndarray, (t,) int64
        The step of the day that contains the middle of the interval, from 0.
    """
    local = local_middle(times, interval, longitude)
    day = local.floor("D")
    return ((day - pd.Timestamp(0)) // DAY).to_numpy(), ((local - day) // interval).to_numpy()


def local_middle(times, interval, longitude):
    """Middle of each interval in local mean solar time: naive pandas.DatetimeIndex, (t,)."""
    shift = pd.Timedelta(seconds=round(longitude * 240.0))
    return (times + interval / 2 + shift).tz_convert("UTC").tz_localize(None).as_unit("ns")


def whole_solar_days(times, interval, longitude):
    """Time axis of the whole solar days whose noon lies within a given axis.

    The calendar cuts through the first and last solar day of a year; here they are complete.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (t,)
        Start of each interval, tz-aware; may have gaps of whole years.
    interval : pandas.Timedelta
        Length of the intervals.
    longitude : float
        Longitude of the place [°].

    Returns
    -------
    pandas.DatetimeIndex, (days · steps,)
        Start of each interval in UTC, in phase with `times`; every day has the same number of steps.
    """
    local = local_middle(times, interval, longitude)
    noon = local[(local - local.floor("D")) // interval == (DAY // interval) // 2]
    phase = (local[0] - local[0].floor("D")) % interval
    steps = pd.timedelta_range(phase, periods=DAY // interval, freq=interval)
    start = noon.floor("D").to_numpy()[:, None] + steps.to_numpy()[None, :]
    middle = pd.DatetimeIndex(start.ravel()).tz_localize("UTC")
    return middle - pd.Timedelta(seconds=round(longitude * 240.0)) - interval / 2
