"""Where the sun is: the NREL SPA algorithm as implemented in pvlib, unit vectors for the tracer,
and solar days.

What the position depends on by time alone is computed once for many places.

References
----------
I. Reda, A. Andreas (2004), Solar position algorithm for solar radiation applications.
:doi:`10.1016/j.solener.2003.12.003`
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import pvlib

from ..settings.errors import InputError, check_array, first_true

POSITION = ["solar_zenith", "apparent_zenith", "solar_azimuth"]  # columns of `solar_position`
MINIMUM_ELEVATION = 2.0  # [°] apparent; below it direct light is not traced (paper, section 2.2)
SECOND, DAY = pd.Timedelta(seconds=1), pd.Timedelta(days=1)

# Settings of pvlib.solarposition.get_solarposition: a standard atmosphere at sea level.
DELTA_T = 67.0  # [s] terrestrial time minus UT1
PRESSURE = 1013.25  # [hPa]
TEMPERATURE = 12.0  # [°C]
REFRACTION = 0.5667  # [°] at sunrise and sunset


def check_times(times, interval, shortest=SECOND):
    """Refuse an invalid time axis, and intervals without length.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (t,)
        tz-aware.
    interval : pandas.Timedelta
    shortest : pandas.Timedelta
        Shortest interval allowed; 0 to allow instants.

    Raises
    ------
    InputError
    TypeError
        If the times have no time zone.
    """
    if not isinstance(times, pd.DatetimeIndex):
        raise InputError(
            "times", f"a {type(times).__name__}", "give a pandas.DatetimeIndex with a time zone"
        )
    if times.tz is None:
        raise TypeError("times have no time zone; see pandas.DatetimeIndex.tz_localize")
    if (first := first_true(times.isna())) is not None:
        raise InputError("times", f"row {first} is not a time", "leave it out or fill it in")
    if not (isinstance(interval, pd.Timedelta) and shortest <= interval <= DAY):
        raise InputError(
            "interval", f"{interval!r}", f"give a pandas.Timedelta from {shortest} to {DAY}"
        )


def check_place(latitude, longitude):
    """Refuse a place that is not on Earth.

    Parameters
    ----------
    latitude, longitude : float
        [°]

    Raises
    ------
    InputError
    """
    for name, bound, value in (("latitude", 90, latitude), ("longitude", 360, longitude)):
        if not (
            isinstance(value, int | float | np.number) and abs(value) <= bound
        ):  # also true for NaN
            raise InputError(
                f"--{name}",
                f"{value} is out of bounds",
                f"give degrees between -{bound} and {bound}",
            )


@dataclass
class _GeocentricSun:
    """The sun seen from the centre of the Earth."""

    times: pd.DatetimeIndex  # (t,) start of each interval
    sidereal_time: np.ndarray  # (t,) apparent, at Greenwich, of mid-interval [°]
    right_ascension: np.ndarray  # (t,) [°]
    declination: np.ndarray  # (t,) [°]
    parallax: np.ndarray  # (t,) equatorial horizontal parallax [°]


def geocentric_sun(times, interval):
    """Sun at the middle of each interval, seen from the centre of the Earth.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (t,)
        Start of each interval, tz-aware.
    interval : pandas.Timedelta

    Returns
    -------
    GeocentricSun
    """
    check_times(times, interval, pd.Timedelta(0))
    seconds = ((times + interval / 2) - pd.Timestamp(0, tz="UTC")) / SECOND
    common = (seconds.to_numpy(float), 0, 0, 0, PRESSURE, TEMPERATURE, DELTA_T, REFRACTION, 1)
    sidereal, ascension, declination = pvlib.spa.solar_position_numpy(*common, sst=True)
    (radius,) = pvlib.spa.solar_position_numpy(*common, esd=True)
    parallax = pvlib.spa.equatorial_horizontal_parallax(radius)
    return _GeocentricSun(times, sidereal, ascension, declination, parallax)


def sun_of_place(sun, latitude, longitude):
    """Sun positions at one place, by the topocentric steps of the algorithm.

    Parameters
    ----------
    sun : GeocentricSun
    latitude, longitude : float
        Place [°].

    Returns
    -------
    pandas.DataFrame
        Indexed by `sun.times`: solar_zenith, apparent_zenith and solar_azimuth [°].
    """
    check_place(latitude, longitude)
    spa = pvlib.spa
    # hour_angle  of the sun from the meridian of the place [°]; reduced  latitude on the sphere
    # [rad]; x, y  place in radii of the Earth from its axis and equator [–].
    hour_angle = spa.local_hour_angle(sun.sidereal_time, longitude, sun.right_ascension)
    reduced = spa.uterm(latitude)
    x, y = spa.xterm(reduced, latitude, 0.0), spa.yterm(reduced, latitude, 0.0)
    # shift  of the right ascension by parallax [°]: the place is not the centre of the Earth.
    shift = spa.parallax_sun_right_ascension(x, sun.parallax, hour_angle, sun.declination)
    declination = spa.topocentric_sun_declination(
        sun.declination, x, y, sun.parallax, shift, hour_angle
    )
    hour_angle = spa.topocentric_local_hour_angle(hour_angle, shift)
    # Elevation without, then with the bending of light in air, and azimuth from north [°].
    elevation = spa.topocentric_elevation_angle_without_atmosphere(
        latitude, declination, hour_angle
    )
    refraction = spa.atmospheric_refraction_correction(PRESSURE, TEMPERATURE, elevation, REFRACTION)
    azimuth = spa.topocentric_azimuth_angle(
        spa.topocentric_astronomers_azimuth(hour_angle, declination, latitude)
    )
    angles = (90.0 - elevation, 90.0 - (elevation + refraction), azimuth)
    return pd.DataFrame(dict(zip(POSITION, angles, strict=True)), index=sun.times)


def solar_position(times, interval, latitude, longitude):
    """Position of the sun at the middle of each interval.

    Parameters
    ----------
    times : pandas.DatetimeIndex
        Start of each interval, tz-aware.
    interval : pandas.Timedelta
        Length of the intervals.
    latitude, longitude : float
        Place [°].

    Returns
    -------
    pandas.DataFrame
        Indexed by `times`: solar_zenith, apparent_zenith (with the refraction of a standard
        atmosphere at sea level) and solar_azimuth [°].
    """
    return sun_of_place(geocentric_sun(times, interval), latitude, longitude)


def sun_direction(apparent_zenith, solar_azimuth):
    """Unit vectors towards the sun.

    Parameters
    ----------
    apparent_zenith, solar_azimuth : array_like, (t,)
        Angles [°]; azimuth clockwise from north.

    Returns
    -------
    numpy.ndarray, (t, 3)
        x east, y north, z up.
    """
    apparent_zenith = check_array("apparent_zenith", apparent_zenith, ("t",), least=0, most=180)
    solar_azimuth = check_array(
        "solar_azimuth", solar_azimuth, (len(apparent_zenith),), least=-360, most=360
    )
    zenith, azimuth = np.radians(apparent_zenith), np.radians(solar_azimuth)
    return np.stack(
        [np.sin(zenith) * np.sin(azimuth), np.sin(zenith) * np.cos(azimuth), np.cos(zenith)],
        axis=-1,
    )


def is_sunny(apparent_zenith):
    """Whether the sun is at least 2° high: (t,) bool from apparent zenith angles [°]."""
    return 90.0 - np.asarray(apparent_zenith) >= MINIMUM_ELEVATION


def local_middle(times, interval, longitude):
    """Middle of each interval in local mean solar time: naive pandas.DatetimeIndex, (t,)."""
    shift = pd.Timedelta(seconds=round(longitude * 240.0))
    return (times + interval / 2 + shift).tz_convert("UTC").tz_localize(None).as_unit("ns")


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
        Start of each interval in UTC, in phase with `times`; every day has the same number of
        steps.
    """
    local = local_middle(times, interval, longitude)
    noon = local[(local - local.floor("D")) // interval == (DAY // interval) // 2]
    phase = (local[0] - local[0].floor("D")) % interval
    steps = pd.timedelta_range(phase, periods=DAY // interval, freq=interval)
    start = noon.floor("D").to_numpy()[:, None] + steps.to_numpy()[None, :]
    middle = pd.DatetimeIndex(start.ravel()).tz_localize("UTC")
    return middle - pd.Timedelta(seconds=round(longitude * 240.0)) - interval / 2
