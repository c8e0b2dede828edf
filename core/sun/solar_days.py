"""Days of local solar time: the calendar the sun itself keeps."""

import pandas as pd

DAY = pd.Timedelta(days=1)


def solar_days(times, interval, longitude):
    """Which day of local mean solar time each interval belongs to, and which step of it.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (t,)
        Start of each interval, tz-aware.
    interval : pandas.Timedelta
        Length of the intervals, a whole part of a day.
    longitude : float
        Of the place [°]: 15° are one hour.

    Returns
    -------
    day : numpy.ndarray, (t,) int64
        Days since 1970-01-01 of local solar time.
    step : numpy.ndarray, (t,) int64
        From 0, the step of the day that holds the middle of the interval.
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

    The first and last day of a calendar year are cut somewhere by the calendar; here they are complete.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (t,)
        Start of each interval, tz-aware; may have gaps of whole years.
    interval : pandas.Timedelta
        Length of the intervals.
    longitude : float
        Of the place [°].

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
