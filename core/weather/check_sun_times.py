"""Compare irradiance with the sun: does GHI = DHI + DNI cos z hold, and do sunrise and sunset fit.

Both are tried with the sun of other times, up to half a day away: the shift that fits best names
the fault of a file.

References
----------
B. Haurwitz (1945), Insolation in relation to cloudiness and cloud density, J. Meteorology 2,
154-166. C. N. Long, Y. Shi (2008), :doi:`10.2174/1874282300802010023`.
"""

from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from ..settings.errors import InputError
from ..sun.solar_position import sun_direction

MINUTE = pd.Timedelta(minutes=1)

WORST_RESIDUAL = 0.08  # of GHI; Long and Shi (2008) flag GHI / (DHI + DNI cos z) beyond 8 %
CLOSURE_SHIFT, DAYLIGHT_SHIFT = 10, 20  # [min]
CURE_OF_TIMES = "check its time zone and stamps"
GAIN = 0.8  # a shift must reduce the residual to less than this share


class TimesError(InputError):
    """Irradiance that fits the sun with other settings.

    Parameters
    ----------
    source, problem, cure
        As of InputError; the cure without these settings.
    time_shift : float
        [min] to be added to the times.
    without : str
        Column of irradiance that is not to be used, or "none".
    """

    def __init__(self, source, problem, cure, time_shift=0.0, without="none"):
        super().__init__(source, problem, cure)
        self.time_shift, self.without = time_shift, without

    def __reduce__(self):
        return type(self), (self.source, self.problem, self.cure, self.time_shift, self.without)


@dataclass
class _SunTimes:
    """How well the irradiance of a record fits the sun at its time stamps; shifts are to be added
    to these [min].
    """

    # mean |GHI - DHI - DNI cos z| / mean GHI; None where only two of them are given
    closure_residual: float | None
    closure_residual_shifted: float | None  # the same with the best shift
    closure_shift: int | None
    # between clear days and the model of a clear sky; None where there is no light
    daylight_residual: float | None
    daylight_residual_shifted: float | None
    daylight_shift: int | None
    # of the clearest days: from the middle of the light to solar noon
    clear_shift: float | None = None
    # ClimateShare; None where there is no climate to hold the year against
    share_of_climate: object = None
    unlikely: list = field(default_factory=list)  # of str: what `check_faults` notes

    @property
    def of_another_sun(self):
        """Whether clear days fit the sun clearly better with a shift."""
        if self.daylight_shift is None or abs(self.daylight_shift) < DAYLIGHT_SHIFT:
            return False
        return self.daylight_residual_shifted < GAIN * self.daylight_residual


def cos_zenith_after(sun, latitude, shift=0.0):
    """Cosine of the sun's zenith angle after a shift in time, 0 below the horizon.

    Its declination stays: instead of the sun around the pole, by 15° an hour, the vertical turns
    the other way.

    Parameters
    ----------
    sun : numpy.ndarray, (t, 3)
        Unit vectors towards the sun: east, north, up.
    latitude : float
        [°]
    shift : float
        [min]

    Returns
    -------
    numpy.ndarray, (t,)
    """
    turn, pole = np.radians(shift / 4), np.radians(latitude)
    lost = 1.0 - np.cos(turn)
    vertical = (
        np.cos(pole) * np.sin(turn),
        np.sin(pole) * np.cos(pole) * lost,
        np.cos(turn) + np.sin(pole) ** 2 * lost,
    )
    return np.maximum(sun @ np.array(vertical), 0.0)


def haurwitz(cos_zenith):
    """Global irradiance of a clear sky [Wm⁻²] (Haurwitz 1945, as in pvlib)."""
    return 1098.0 * cos_zenith * np.exp(-0.059 / np.maximum(cos_zenith, 1e-3))


def measure_sun_times(data, interval, latitude, position):
    """Find the time shift with which the irradiance fits the sun best.

    Closure: where GHI, DHI and DNI are given, the shift with the smallest sum of |GHI - DHI - DNI
    cos z|, z at the middle of the interval. Daylight: for every 20 days the 90th percentile of GHI
    at each time of day (a clear day) against the clear sky of Haurwitz, averaged over the interval
    and scaled to fit. Where GHI is not given, it is DHI + DNI cos z with the z of each shift that
    is tried.

    Parameters
    ----------
    data : pandas.DataFrame
        Two or more of ghi, dhi and dni [Wm⁻²], as given; index: tz-aware start of each interval.
    interval : pandas.Timedelta
    latitude : float
        [°]
    position : pandas.DataFrame
        Of `solar_position` for these times.

    Returns
    -------
    SunTimes
    """
    sun = sun_direction(position["solar_zenith"].to_numpy(), position["solar_azimuth"].to_numpy())
    given = {name: data[name].to_numpy(float) for name in ("ghi", "dhi", "dni") if name in data}
    if not any(values.any() for values in given.values()):
        return _SunTimes(*6 * [None])

    # Closure first, where all three are given; then the shape of the days.
    best_shift = None, None, None
    if len(given) == 3 and given["ghi"].any():
        ghi, dhi, dni = given.values()
        best_shift = _search_shift(
            lambda shift: float(
                np.abs(ghi - dhi - dni * cos_zenith_after(sun, latitude, shift)).sum() / ghi.sum()
            )
        )
    return _SunTimes(*best_shift, *_search_shift(_compare_daylight(given, interval, sun, latitude)))


def _search_shift(residual, *, coarse_step=30):
    """Residual without a shift and with the best one, and that shift [min].

    Parameters
    ----------
    residual : callable
        Residual of a shift [min].

    Returns
    -------
    tuple of float, float, int
    """
    # Shifts are tried in steps of 30 minutes first, then of one.
    coarse = min(range(-720, 721, coarse_step), key=lambda shift: (residual(shift), abs(shift)))
    best = min(
        range(coarse - coarse_step, coarse + coarse_step + 1),
        key=lambda shift: (residual(shift), abs(shift)),
    )
    return residual(0), residual(best), best


def _compare_daylight(given, interval, sun, latitude):
    """Function for the residual between clear days and the clear-sky model as a function of a
    shift.

    Parameters
    ----------
    given : dict of str to (t,) float
        GHI, or DHI and DNI [W/m²].
    interval : pandas.Timedelta
    sun : numpy.ndarray, (t, 3)
        Towards the sun at the middle of the intervals.
    latitude : float
        [°]

    Returns
    -------
    callable
        Shift [min] to residual, a share of the irradiance.
    """
    count, steps = len(sun), pd.Timedelta(days=1) // interval
    # The 90 % quantile of each interval of the day over windows of some 20 days represents a clear
    # day.
    windows = max(count // (20 * steps), 1)
    shape = windows, count // steps // windows, steps

    def clear_days(ghi):
        return np.quantile(ghi[: np.prod(shape)].reshape(shape), 0.9, axis=1)  # (windows, steps)

    # GHI that is given does not depend on the shift; without it, GHI is DHI and the horizontal part
    # of DNI under the shifted sun.
    always = clear_days(given["ghi"]) if "ghi" in given else None
    # The sun of the middle day represents the window.
    middle = np.arange(np.prod(shape)).reshape(shape)[:, shape[1] // 2].ravel()
    # The clear sky is averaged over an interval in steps of at most 10 minutes.
    parts = max(int(np.ceil(interval / MINUTE / 10.0)), 1)
    offsets = ((np.arange(parts) + 0.5) / parts - 0.5) * (interval / MINUTE)

    def residual(shift):
        # Clear days against the clear sky under the shifted sun, each scaled to fit; what is left
        # over is the residual.
        clear = (
            clear_days(given["dhi"] + given["dni"] * cos_zenith_after(sun, latitude, shift))
            if always is None
            else always
        )
        model = sum(
            haurwitz(cos_zenith_after(sun[middle], latitude, shift + offset)) for offset in offsets
        )
        model = model.reshape(clear.shape)
        scale = (model * clear).sum(axis=1) / np.maximum((model**2).sum(axis=1), 1e-9)
        return float(np.abs(clear - scale[:, None] * model).sum() / max(clear.sum(), 1e-9))

    return residual


def check_shift(times, source):
    """Refuse irradiance that is shifted in time relative to the sun, and suggest what mends it.

    Parameters
    ----------
    times : SunTimes
    source : str
        The file and the year, for the message.

    Raises
    ------
    TimesError
        If GHI, DHI and DNI contradict each other by more than 1 % of GHI, and a shift of 10 minutes
        or more reduces this by a fifth and below 8 %; if they agree, but the daylight lies 20
        minutes or more from the sun, and the middle of the clearest days within 15 minutes of that;
        or if fewer than three are given, or the three differ by more than 8 %, and clear days fit
        the sun better by a fifth with a shift of 20 minutes or more.
    """
    residual, shifted, shift = (
        times.closure_residual,
        times.closure_residual_shifted,
        times.closure_shift,
    )
    daylight = times.daylight_shift
    # A year without light tells nothing and passes.
    if daylight is None:
        return
    own = _describe_shift(daylight)
    # Where three columns close to within 1 % of GHI, the times are right, with one exception.
    if residual is not None and residual <= 0.01:
        # The exception: the three columns close with the sun that one of them was computed with,
        # which need not be the sun of the light. Where they need no shift, but clear days and the
        # middle of the clearest ones ask for one, the year is refused; the times that fit GHI are
        # suggested, without DNI.
        if times.of_another_sun and abs(shift) < CLOSURE_SHIFT and _clear_days_agree(times):
            problem = (
                f"GHI fits the sun {own}, DNI the sun {_describe_shift(shift)}: DNI seems to be "
                "computed for the"
            )
            raise TimesError(
                source, f"{problem} wrong time", CURE_OF_TIMES, _round_shift(daylight, 3), "dni"
            )
        return
    # Six hours away from the sun of the daylight most direct light falls into the night, and GHI =
    # DHI closes.
    closes = residual is not None and abs(shift - daylight) < 360
    # A shift of 10 minutes or more that brings the three columns a fifth closer, to below 8 %,
    # means wrong times: it is suggested where GHI's daylight asks for it too. Otherwise DNI has
    # wrong times, and GHI's shift without DNI is suggested.
    if closes and abs(shift) >= CLOSURE_SHIFT and shifted < min(GAIN * residual, WORST_RESIDUAL):
        problem = (
            f"GHI differs from DHI + DNI cos z by {100 * residual:.1f} % of GHI, by "
            f"{100 * shifted:.1f} %"
        )
        problem += f" with the sun {_describe_shift(shift)}"
        if abs(daylight - shift) < DAYLIGHT_SHIFT:
            raise TimesError(source, problem, CURE_OF_TIMES, _round_shift(shift, 2))
        problem += f" (GHI itself fits the sun {own}: DNI seems to be computed for the wrong time)"
        raise TimesError(
            source,
            problem,
            CURE_OF_TIMES,
            _round_shift(daylight, 3) if times.of_another_sun else 0.0,
            "dni",
        )
    # Otherwise the daylight decides where fewer than three columns are given, or they stay apart by
    # more than 8 %, and clear days fit the sun better with a shift: beyond 90 minutes the place or
    # the time zone may be wrong. All other years pass.
    if (residual is None or residual > WORST_RESIDUAL) and times.of_another_sun:
        problem = f"its irradiance fits the sun {own} than its time stamps"
        raise TimesError(
            source,
            problem,
            CURE_OF_TIMES
            if abs(daylight) <= 90
            else "check the place (--weather-place) and the time zone of the weather",
            _round_shift(daylight, 3),
        )


def _clear_days_agree(times):
    """Whether the middle of the light of the clearest days tells the same shift as the daylight."""
    apart = np.inf if times.clear_shift is None else abs(times.clear_shift - times.daylight_shift)
    return apart <= 15 and times.daylight_residual_shifted < 0.6 * times.daylight_residual


def check_closure(times, source):
    """Refuse GHI, DHI and DNI that contradict each other by more than 8 % of GHI.

    Raises
    ------
    InputError
    """
    if times.closure_residual is not None and times.closure_residual > WORST_RESIDUAL:
        raise InputError(
            source,
            f"GHI differs from DHI + DNI cos z by {100 * times.closure_residual:.1f} % of GHI at "
            "any time shift",
            "check columns, units and the place (--weather-place), or leave one of them out "
            "(--weather-without)",
        )


def _describe_shift(shift):
    """A shift in words."""
    return f"{abs(shift)} min {'later' if shift > 0 else 'earlier'}" if shift else "as it stands"


def _round_shift(shift, error):
    """A shift rounded to quarters of an hour if that is within its error [min]."""
    quarters = 15 * round(shift / 15)
    return quarters if abs(shift - quarters) <= error else shift
