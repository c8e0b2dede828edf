"""Compare irradiance with the sun: does GHI = DHI + DNI cos z hold, and do sunrise and sunset fit."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import pvlib

from ..settings.errors import InputError

DAY = pd.Timedelta(days=1)
STEP = pd.Timedelta(minutes=10)  # the clear sky is averaged over an interval in steps of at most this
COARSE, FINE = 30, 1  # [min] steps in which shifts are tried
WINDOW, BRIGHT = 20, 0.9  # days whose brightest hours represent a clear day, and the quantile of these

# Limits. Sources and the values of real files: docs/weather.md.
RESIDUAL = 0.01  # of GHI; below this the times are right
WORST_RESIDUAL = 0.08  # of GHI; Long and Shi (2008) flag GHI / (DHI + DNI cos z) beyond 8 %
CLOSURE_SHIFT, DAYLIGHT_SHIFT = 10, 20  # [min]
GAIN = 0.8  # a shift must reduce the residual to less than this share


@dataclass
class SunTimes:
    """How well the irradiance of a record fits the sun at its time stamps; shifts are to be added to these [min]."""

    closure_residual: float | None  # mean |GHI - DHI - DNI cos z| / mean GHI; None where only two of them are given
    closure_residual_shifted: float | None  # the same with the best shift
    closure_shift: int | None
    daylight_residual: float | None  # between clear days and the model of a clear sky; None where there is no light
    daylight_residual_shifted: float | None
    daylight_shift: int | None


def measure_sun_times(data, interval, latitude, longitude):
    """Find the time shift with which the irradiance fits the sun best.

    Closure: where GHI, DHI and DNI are given, the shift with the smallest sum of |GHI - DHI - DNI cos z|, z at the
    middle of the interval. Daylight: for every 20 days the 90th percentile of GHI at each time of day (a clear day)
    against the clear sky of Haurwitz, averaged over the interval and scaled to fit. Where GHI is not given, it is
    DHI + DNI cos z with the z of each shift that is tried.

    Parameters
    ----------
    data : pandas.DataFrame
        Those of ghi, dhi and dni that are given [Wm⁻²], two or more; index: tz-aware start of each interval.
    interval : pandas.Timedelta
    latitude, longitude : float
        [°]

    Returns
    -------
    SunTimes

    References
    ----------
    B. Haurwitz (1945), Insolation in relation to cloudiness and cloud density, J. Meteorology 2, 154-166.
    """
    track = sun_track(data.index + interval / 2, latitude, longitude)
    given = {name: data[name].to_numpy(float) for name in ("ghi", "dhi", "dni") if name in data}
    if not any(values.any() for values in given.values()):
        return SunTimes(*6 * [None])
    closure = None, None, None
    if len(given) == 3 and given["ghi"].any():
        closure = search_shift(lambda shift: residual_of_closure(**given, cos_zenith=track.cos_zenith(shift)))
    clear_at = clear_days_by_shift(given, interval, track)
    return SunTimes(*closure, *search_shift(compare_daylight(clear_at, interval, track)))


@dataclass
class SunTrack:
    """Declination and hour angle of the sun, to half a minute: for trying many shifts quickly."""

    sine: np.ndarray  # (t,) sin(latitude) sin(declination)
    cosine: np.ndarray  # (t,) cos(latitude) cos(declination)
    hour_angle: np.ndarray  # (t,) [rad]

    def cos_zenith(self, shift=0.0):
        """Cosine of the zenith angle after a shift [min], 0 below the horizon: (t,)."""
        return np.maximum(self.sine + self.cosine * np.cos(self.hour_angle + np.radians(shift / 4)), 0.0)


def sun_track(times, latitude, longitude):
    """Track of the sun by Spencer's series (1971), as in pvlib.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (t,)
        tz-aware.
    latitude, longitude : float
        [°]

    Returns
    -------
    SunTrack
    """
    times = times.tz_convert("UTC")
    day = times.dayofyear.to_numpy()
    declination = np.asarray(pvlib.solarposition.declination_spencer71(day))
    minutes = ((times - times.normalize()) / pd.Timedelta(minutes=1)).to_numpy()
    minutes = minutes + np.asarray(pvlib.solarposition.equation_of_time_spencer71(day))
    tilt = np.radians(latitude)
    return SunTrack(
        sine=np.sin(tilt) * np.sin(declination),
        cosine=np.cos(tilt) * np.cos(declination),
        hour_angle=np.radians(minutes / 4 + longitude - 180.0),
    )


def residual_of_closure(ghi, dhi, dni, cos_zenith):
    """Mean absolute residual of GHI = DHI + DNI cos z as a share of the mean GHI."""
    return float(np.abs(ghi - dhi - dni * cos_zenith).sum() / ghi.sum())


def search_shift(residual):
    """Residual without a shift and with the best one, and that shift [min].

    Parameters
    ----------
    residual : callable
        Residual of a shift [min].

    Returns
    -------
    tuple of float, float, int
    """
    coarse = min(range(-720, 721, COARSE), key=lambda shift: (residual(shift), abs(shift)))
    best = min(range(coarse - COARSE, coarse + COARSE + 1, FINE), key=lambda shift: (residual(shift), abs(shift)))
    return residual(0), residual(best), best


def clear_days_by_shift(given, interval, track):
    """Function for the result of `clear_days` as a function of a shift, which changes GHI where it is not given.

    Parameters
    ----------
    given : dict of str to (t,) float
        GHI, or DHI and DNI [W/m²].
    interval : pandas.Timedelta
    track : SunTrack

    Returns
    -------
    callable
        Shift [min] to (windows, steps) float.
    """
    if "ghi" in given:
        clear = clear_days(given["ghi"], interval)
        return lambda shift: clear
    return lambda shift: clear_days(given["dhi"] + given["dni"] * track.cos_zenith(shift), interval)


def clear_days(ghi, interval):
    """Global irradiance of a clear day in every WINDOW days: (windows, steps) [W/m²].

    Parameters
    ----------
    ghi : (t,) float
        [W/m²]
    interval : pandas.Timedelta
    """
    windows, days, steps = shape_of_windows(len(ghi), interval)
    return np.quantile(ghi[: windows * days * steps].reshape(windows, days, steps), BRIGHT, axis=1)


def shape_of_windows(count, interval):
    """Numbers of windows, of days in each and of steps in a day for a record of some values: three int."""
    steps = DAY // interval
    windows = max(count // (WINDOW * steps), 1)
    return windows, count // steps // windows, steps


def compare_daylight(clear_at, interval, track):
    """Function for the residual between clear days and the clear-sky model as a function of a shift.

    Parameters
    ----------
    clear_at : callable
        Shift [min] to the result of `clear_days`.
    interval : pandas.Timedelta
    track : SunTrack
        At the middle of the intervals.

    Returns
    -------
    callable
        Shift [min] to residual, a share of the irradiance.
    """
    shape = shape_of_windows(len(track.hour_angle), interval)
    # The sun of the middle day represents the window.
    middle = np.arange(np.prod(shape)).reshape(shape)[:, shape[1] // 2].ravel()
    own = SunTrack(track.sine[middle], track.cosine[middle], track.hour_angle[middle])
    parts = max(int(np.ceil(interval / STEP)), 1)
    offsets = ((np.arange(parts) + 0.5) / parts - 0.5) * (interval / pd.Timedelta(minutes=1))

    def residual(shift):
        clear = clear_at(shift)
        model = sum(haurwitz(own.cos_zenith(shift + offset)) for offset in offsets).reshape(clear.shape)
        scale = (model * clear).sum(axis=1) / np.maximum((model**2).sum(axis=1), 1e-9)
        return float(np.abs(clear - scale[:, None] * model).sum() / max(clear.sum(), 1e-9))

    return residual


def haurwitz(cos_zenith):
    """Global irradiance of a clear sky [Wm⁻²] (Haurwitz 1945, as in pvlib)."""
    return 1098.0 * cos_zenith * np.exp(-0.059 / np.maximum(cos_zenith, 1e-3))


def check_shift(times, source):
    """Refuse irradiance that is shifted in time relative to the sun, and suggest the shift.

    Parameters
    ----------
    times : SunTimes
    source : str
        The file and the year, for the message.

    Raises
    ------
    InputError
        If GHI, DHI and DNI contradict each other by more than 1 % of GHI, and a shift of 10 minutes or more reduces
        this by a fifth and below 8 %; or if only two are given, or the three differ by more than 8 %, and clear days
        fit the sun better by a fifth with a shift of 20 minutes or more.
    """
    closed = times.closure_residual is not None and times.closure_residual <= RESIDUAL
    if closed or times.daylight_shift is None:
        return
    if times.closure_residual is not None and shift_closes(times):
        raise InputError(source, *describe_closure(times))
    # GHI, DHI and DNI that no shift reconciles may belong to another place.
    contradictory = times.closure_residual is None or times.closure_residual > WORST_RESIDUAL
    if contradictory and fits_another_sun(times):
        problem = f"its irradiance fits the sun {describe_shift(times.daylight_shift)} than its time stamps"
        raise InputError(source, problem, cure_of_shift(round_shift(times.daylight_shift, 5)))


def fits_another_sun(times):
    """Whether clear days fit the sun clearly better with a shift."""
    if times.daylight_shift is None or abs(times.daylight_shift) < DAYLIGHT_SHIFT:
        return False
    return times.daylight_residual_shifted < GAIN * times.daylight_residual


def shift_closes(times):
    """Whether a shift explains why GHI is not DHI + DNI cos z."""
    shifted = times.closure_residual_shifted
    return abs(times.closure_shift) >= CLOSURE_SHIFT and shifted < min(GAIN * times.closure_residual, WORST_RESIDUAL)


def describe_closure(times):
    """Problem and cure of a record whose closure requires a shift."""
    residual, shifted, shift = times.closure_residual, times.closure_residual_shifted, times.closure_shift
    problem = f"GHI differs from DHI + DNI cos z by {100 * residual:.1f} % of GHI, by {100 * shifted:.1f} %"
    problem += f" with the sun {describe_shift(shift)}"
    cure = cure_of_shift(round_shift(shift, 2))
    if times.daylight_shift is not None and abs(times.daylight_shift - shift) >= DAYLIGHT_SHIFT:
        own = describe_shift(times.daylight_shift)
        problem += f" (GHI itself fits the sun {own}: DNI seems to be computed for the wrong time)"
        cure = f"derive DNI from GHI and DHI with --weather-without dni; or {cure}"
    return problem, cure


def check_closure(times, source):
    """Refuse GHI, DHI and DNI that contradict each other by more than 8 % of GHI.

    Raises
    ------
    InputError
    """
    if times.closure_residual is not None and times.closure_residual > WORST_RESIDUAL:
        problem = f"GHI differs from DHI + DNI cos z by {100 * times.closure_residual:.1f} % of GHI at any time shift"
        cure = "check columns, units and the place (--weather-place), or leave one of them out (--weather-without)"
        raise InputError(source, problem, cure)


def describe_shift(shift):
    """A shift in words."""
    return f"{abs(shift)} min {'later' if shift > 0 else 'earlier'}" if shift else "as it stands"


def round_shift(shift, error):
    """Round a shift to quarters of an hour if that is within its error [min]."""
    quarters = 15 * round(shift / 15)
    return quarters if abs(shift - quarters) <= error else shift


def cure_of_shift(shift):
    """Cure for a shift."""
    if abs(shift) > 90:
        return f"check the place (--weather-place) and the time zone of the weather, or give --time-shift {shift}"
    return f"check its time zone and stamps, or give --time-shift {shift}"
