"""Give weather its sun: positions at mid-interval, and the direct part that belongs to them."""

import numpy as np
import pandas as pd
import pvlib

from ..sun.solar_position import is_sunny, solar_position
from .direct_normal import compute_dhi, compute_dni, compute_ghi
from .weather import Weather

COLUMNS = [
    "ghi",
    "dhi",
    "dni",
    "temp_air",
    "wind_speed",
    "pressure",
    "solar_zenith",
    "apparent_zenith",
    "solar_azimuth",
]


def add_sun(record, interval):
    """Complete a checked record to Weather.

    Parameters
    ----------
    record : Record
        Checked by `check_weather`.
    interval : pandas.Timedelta
        Length of its intervals.

    Returns
    -------
    Weather
        With the sun at mid-interval, all three irradiances, and no direct part below 2° of apparent elevation.
    """
    sun = solar_position(record.data.index, interval, record.latitude, record.longitude)
    # Negative irradiance down to -1 W/m² is rounding of the file's packing or the dark signal of an instrument.
    given = {
        name: record.data[name].to_numpy(float).clip(min=0.0) for name in record.data if name in ("ghi", "dhi", "dni")
    }
    irradiance = complete_irradiance(given, sun["apparent_zenith"].to_numpy())
    if "pressure" in record.data:
        pressure = record.data["pressure"].to_numpy(float)
    else:
        pressure = np.full(len(sun), pvlib.atmosphere.alt2pres(record.altitude))
    weather = {
        "temp_air": record.data["temp_air"].to_numpy(float),
        "wind_speed": record.data["wind_speed"].to_numpy(float),
    }
    data = pd.DataFrame(irradiance | weather | {"pressure": pressure}, index=sun.index).join(sun)[COLUMNS]
    return Weather(data, interval, record.latitude, record.longitude, record.altitude, record.label)


def complete_irradiance(given, apparent_zenith):
    """Find the third of ghi, dhi and dni, and drop the direct part of a sun that stands too low.

    Parameters
    ----------
    given : dict
        At least two of ghi, dhi, dni: (t,) [Wm⁻²], none negative.
    apparent_zenith : numpy.ndarray, (t,)
        Of the sun at mid-interval [°].

    Returns
    -------
    dict
        ghi, dhi, dni: (t,) [Wm⁻²]; dni is 0 and dhi equals ghi below 2° of apparent elevation.
    """
    sunny = is_sunny(apparent_zenith)
    ghi, dhi, dni = given.get("ghi"), given.get("dhi"), given.get("dni")
    if ghi is None:
        ghi = compute_ghi(dhi, dni, apparent_zenith)
    if dhi is None:
        # A direct part larger than the global one comes from the sun's path within the interval: nothing is left over.
        dhi = np.maximum(compute_dhi(ghi, dni, apparent_zenith), 0.0)
    if dni is None:
        dni = np.zeros_like(ghi)
        dni[sunny] = compute_dni(ghi[sunny], np.minimum(dhi, ghi)[sunny], apparent_zenith[sunny])
    return {"ghi": ghi, "dhi": np.where(sunny, dhi, ghi), "dni": np.where(sunny, dni, 0.0)}
