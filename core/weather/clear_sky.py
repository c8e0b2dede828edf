"""Clear-sky weather: an upper bound."""

import pandas as pd
import pvlib

from ..settings.errors import InputError
from ..sky.clear_irradiance import clear_irradiance
from ..sun.solar_position import solar_position
from .record import Record

TEMP_AIR = 15.0  # [°C]
WIND_SPEED = 1.0  # [ms⁻¹]
INTERVAL = pd.Timedelta(hours=1)


def clear_sky(latitude, longitude, altitude, year, sun=None):
    """One year of the clear-sky model of Ineichen and Perez with pvlib's monthly Linke turbidity.

    Parameters
    ----------
    latitude, longitude : float
        Place [°].
    altitude : float
        Of the place [m].
    year : int
        Calendar year, in UTC.
    sun : pandas.DataFrame, optional
        Of `solar_position` for the place and the year's hours, if known.

    Returns
    -------
    Record
        Hourly, with the irradiance at mid-interval, 15 °C and 1 ms⁻¹ throughout.

    Notes
    -----
    :doi:`10.1016/S0038-092X(02)00045-2`; an upper bound of a real year.
    """
    if not 1900 <= year <= 2100:
        raise InputError("--year", f"{year} is not from 1900 to 2100", "give a year in that range")
    times = pd.date_range(f"{year}-01-01", f"{year + 1}-01-01", freq=INTERVAL, inclusive="left", tz="UTC")
    zenith = (solar_position(times, INTERVAL, latitude, longitude) if sun is None else sun)["apparent_zenith"]
    pressure = pvlib.atmosphere.alt2pres(altitude)
    data = clear_irradiance(zenith, times + INTERVAL / 2, (latitude, longitude), altitude, pressure).set_axis(times)
    data = data.assign(temp_air=TEMP_AIR, wind_speed=WIND_SPEED, pressure=pressure)
    label = f"clear sky {year} (upper bound)"
    return Record(data, latitude, longitude, altitude, "clear-sky", label)
