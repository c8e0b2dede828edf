"""Sun position: angles from pvlib, unit vectors for the tracer."""

import numpy as np
import pandas as pd
import pvlib

from ..settings.errors import check_array
from .check_suns import INSTANT, check_place, check_times

POSITION = ["solar_zenith", "apparent_zenith", "solar_azimuth"]  # columns of `solar_position`
MINIMUM_ELEVATION = 2.0  # [°] apparent; below it direct light is not traced (paper, section 2.2)


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
        Indexed by `times`: solar_zenith, apparent_zenith (with the refraction of a standard atmosphere at sea level)
        and solar_azimuth [°].

    Notes
    -----
    The NREL SPA algorithm as implemented in pvlib, :doi:`10.1016/j.solener.2003.12.003`.
    """
    check_times(times, interval, INSTANT)
    check_place(latitude, longitude)
    position = pvlib.solarposition.get_solarposition(times + interval / 2, latitude, longitude)
    return pd.DataFrame(
        {
            "solar_zenith": position["zenith"].to_numpy(),
            "apparent_zenith": position["apparent_zenith"].to_numpy(),
            "solar_azimuth": position["azimuth"].to_numpy(),
        },
        index=times,
    )


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
    solar_azimuth = check_array("solar_azimuth", solar_azimuth, (len(apparent_zenith),), least=-360, most=360)
    zenith, azimuth = np.radians(apparent_zenith), np.radians(solar_azimuth)
    return np.stack([np.sin(zenith) * np.sin(azimuth), np.sin(zenith) * np.cos(azimuth), np.cos(zenith)], axis=-1)


def is_sunny(apparent_zenith):
    """Whether the sun is at least 2° high: (t,) bool from apparent zenith angles [°]."""
    return 90.0 - np.asarray(apparent_zenith) >= MINIMUM_ELEVATION
