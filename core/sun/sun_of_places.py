"""Sun positions of many places on one time axis: what depends on time alone is computed once."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import pvlib

from .check_suns import INSTANT, check_place, check_times

# Settings of pvlib.solarposition.get_solarposition: a standard atmosphere at sea level.
DELTA_T = 67.0  # [s] terrestrial time minus UT1
PRESSURE = 1013.25  # [hPa]
TEMPERATURE = 12.0  # [°C]
REFRACTION = 0.5667  # [°] at sunrise and sunset


@dataclass
class GeocentricSun:
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
    check_times(times, interval, INSTANT)
    seconds = ((times + interval / 2) - pd.Timestamp(0, tz="UTC")) / pd.Timedelta(seconds=1)
    common = (seconds.to_numpy(float), 0, 0, 0, PRESSURE, TEMPERATURE, DELTA_T, REFRACTION, 1)
    sidereal, ascension, declination = pvlib.spa.solar_position_numpy(*common, sst=True)
    (radius,) = pvlib.spa.solar_position_numpy(*common, esd=True)
    parallax = pvlib.spa.equatorial_horizontal_parallax(radius)
    return GeocentricSun(times, sidereal, ascension, declination, parallax)


def sun_of_place(sun, latitude, longitude):
    """Sun positions at one place, those of `solar_position.solar_position`.

    Parameters
    ----------
    sun : GeocentricSun
    latitude, longitude : float
        Place [°].

    Returns
    -------
    pandas.DataFrame
        Indexed by `sun.times`: solar_zenith, apparent_zenith and solar_azimuth [°].

    Notes
    -----
    The topocentric steps of the NREL SPA algorithm, :doi:`10.1016/j.solener.2003.12.003`, by the functions of pvlib.
    """
    check_place(latitude, longitude)
    spa = pvlib.spa
    hour_angle = spa.local_hour_angle(sun.sidereal_time, longitude, sun.right_ascension)
    reduced = spa.uterm(latitude)
    x, y = spa.xterm(reduced, latitude, 0.0), spa.yterm(reduced, latitude, 0.0)
    shift = spa.parallax_sun_right_ascension(x, sun.parallax, hour_angle, sun.declination)
    declination = spa.topocentric_sun_declination(sun.declination, x, y, sun.parallax, shift, hour_angle)
    hour_angle = spa.topocentric_local_hour_angle(hour_angle, shift)
    elevation = spa.topocentric_elevation_angle_without_atmosphere(latitude, declination, hour_angle)
    refraction = spa.atmospheric_refraction_correction(PRESSURE, TEMPERATURE, elevation, REFRACTION)
    azimuth = spa.topocentric_azimuth_angle(spa.topocentric_astronomers_azimuth(hour_angle, declination, latitude))
    return pd.DataFrame(
        {
            "solar_zenith": 90.0 - elevation,
            "apparent_zenith": 90.0 - (elevation + refraction),
            "solar_azimuth": azimuth,
        },
        index=sun.times,
    )
