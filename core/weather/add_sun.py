"""Add sun positions at mid-interval to weather, and complete GHI, DHI and DNI."""

import numpy as np
import pandas as pd
import pvlib

from ..settings.errors import InputError
from ..sun.solar_position import POSITION, is_sunny, solar_position
from .weather import Weather

HORIZON_CUTS = ("measured", "neglect")
COLUMNS = [
    "ghi",
    "dhi",
    "dni",
    "temp_air",
    "wind_speed",
    "pressure",
    *POSITION,
]


def add_sun(record, interval, horizon_cut="measured", position=None):
    """Turn a checked record into Weather.

    Parameters
    ----------
    record : Record
        Checked by `check_weather`.
    interval : pandas.Timedelta
        Length of its intervals.
    horizon_cut : {"measured", "neglect"}
        Treatment of suns below 2° of apparent elevation, as in `complete_irradiance`.
    position : pandas.DataFrame, optional
        Of `solar_position` for the times and the place of the record, if known.

    Returns
    -------
    Weather
        With the sun at mid-interval and all three irradiances.
    """
    sun = position
    if position is None:
        sun = solar_position(record.data.index, interval, record.latitude, record.longitude)
    # Negative irradiance down to -1 W/m² comes from packing in the file or the dark signal of an instrument.
    given = {
        name: record.data[name].to_numpy(float).clip(min=0.0) for name in record.data if name in ("ghi", "dhi", "dni")
    }
    irradiance = complete_irradiance(given, sun["apparent_zenith"].to_numpy(), horizon_cut)
    if "pressure" in record.data:
        pressure = record.data["pressure"].to_numpy(float)
    else:
        pressure = np.full(len(sun), pvlib.atmosphere.alt2pres(record.altitude))
    weather = {
        "temp_air": record.data["temp_air"].to_numpy(float),
        "wind_speed": record.data["wind_speed"].to_numpy(float),
    }
    data = pd.DataFrame(irradiance | weather | {"pressure": pressure}, index=sun.index).join(sun)[COLUMNS]
    return Weather(data, interval, record.latitude, record.longitude, record.altitude, record.label, list(record.notes))


def complete_irradiance(given, apparent_zenith, horizon_cut="measured"):
    """Compute the missing one of ghi, dhi and dni, and treat the sun near the horizon.

    Parameters
    ----------
    given : dict
        At least two of ghi, dhi, dni: (t,) [Wm⁻²], none negative.
    apparent_zenith : numpy.ndarray, (t,)
        Of the sun at mid-interval [°].
    horizon_cut : {"measured", "neglect"}
        "measured": below 2° of apparent elevation DNI is kept if it was measured; if it would have to be derived, as a
        quotient of two numbers near zero, all light is diffuse. With the sun below the horizon all light is diffuse.
        "neglect": intervals with the sun below 2° have no light, as in the paper.

    Returns
    -------
    dict
        ghi, dhi, dni: (t,) [Wm⁻²].
    """
    if horizon_cut not in HORIZON_CUTS:
        raise InputError("horizon_cut", f"{horizon_cut!r} is unknown", f"give one of {', '.join(HORIZON_CUTS)}")
    sunny = is_sunny(apparent_zenith)
    ghi, dhi, dni = (given.get(name) for name in ("ghi", "dhi", "dni"))
    # Intervals with direct light: sun above the horizon, or above 2° if DNI has to be derived.
    direct = sunny if dni is None or horizon_cut == "neglect" else np.asarray(apparent_zenith) < 90.0
    if ghi is None:
        ghi = compute_ghi(dhi, dni, apparent_zenith)
    if dhi is None:
        # Direct above global irradiance comes from the sun's motion within the interval: then DHI is 0.
        dhi = np.maximum(compute_dhi(ghi, dni, apparent_zenith), 0.0)
    if dni is None:
        dni = np.zeros_like(ghi)
        dni[sunny] = compute_dni(ghi[sunny], np.minimum(dhi, ghi)[sunny], apparent_zenith[sunny])
    irradiance = {"ghi": ghi, "dhi": np.where(direct, dhi, ghi), "dni": np.where(direct, dni, 0.0)}
    if horizon_cut == "neglect":
        return {name: np.where(sunny, values, 0.0) for name, values in irradiance.items()}
    return irradiance


def compute_dni(ghi, dhi, zenith):
    """Direct normal irradiance of hours with the sun well above the horizon (paper, Eq. 5).

    Parameters
    ----------
    ghi, dhi : array_like, (t,)
        Global and diffuse horizontal irradiance [Wm⁻²].
    zenith : array_like, (t,)
        Zenith angle of the sun [°], below 90.

    Returns
    -------
    numpy.ndarray, (t,)
        Direct normal irradiance [Wm⁻²].
    """
    return (np.asarray(ghi) - np.asarray(dhi)) / np.cos(np.radians(zenith))  # Eq. 5


def compute_dhi(ghi, dni, zenith):
    """Diffuse horizontal irradiance [Wm⁻²] from the global and the direct normal one (paper, Eq. 5).

    Parameters
    ----------
    ghi, dni : array_like, (t,)
        Global horizontal and direct normal irradiance [Wm⁻²].
    zenith : array_like, (t,)
        Zenith angle of the sun [°].

    Returns
    -------
    numpy.ndarray, (t,)
        Diffuse horizontal irradiance [Wm⁻²].
    """
    return np.asarray(ghi) - np.asarray(dni) * np.maximum(np.cos(np.radians(zenith)), 0.0)  # Eq. 5


def compute_ghi(dhi, dni, zenith):
    """Global horizontal irradiance [Wm⁻²] from the diffuse and the direct normal one (paper, Eq. 5).

    Parameters
    ----------
    dhi, dni : array_like, (t,)
        Diffuse horizontal and direct normal irradiance [Wm⁻²].
    zenith : array_like, (t,)
        Zenith angle of the sun [°].

    Returns
    -------
    numpy.ndarray, (t,)
        Global horizontal irradiance [Wm⁻²].
    """
    return np.asarray(dhi) + np.asarray(dni) * np.maximum(np.cos(np.radians(zenith)), 0.0)  # Eq. 5
