"""Add sun positions at mid-interval to weather, and complete GHI, DHI and DNI (paper, Eq. 5)."""

import numpy as np
import pandas as pd
import pvlib

from ..sun.solar_position import POSITION, is_sunny, solar_position
from .complete_record import decompose_ghi
from .weather import IRRADIANCES, Weather

COLUMNS = [*IRRADIANCES, "temp_air", "wind_speed", "pressure", *POSITION]


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
    place = record.latitude, record.longitude
    sun = solar_position(record.data.index, interval, *place) if position is None else position
    # Small negative irradiance comes from packing in the file or the dark signal of an instrument.
    given = {
        name: record.data[name].to_numpy(float).clip(min=0.0)
        for name in IRRADIANCES
        if name in record.data
    }
    extra = np.asarray(
        pvlib.irradiance.get_extra_radiation(record.data.index + interval / 2), float
    )
    if [*given] == ["ghi"]:
        modelled, _ = decompose_ghi(given["ghi"], sun["solar_zenith"].to_numpy(), extra)
        given = given | {"dhi": modelled}
    irradiance = complete_irradiance(given, sun["apparent_zenith"].to_numpy(), horizon_cut, extra)
    weather = {"pressure": np.full(len(sun), pvlib.atmosphere.alt2pres(record.altitude))}
    for name in ("temp_air", "wind_speed", "pressure"):
        if name in record.data:
            weather[name] = record.data[name].to_numpy(float)
    data = pd.DataFrame(irradiance | weather, index=sun.index).join(sun)[COLUMNS]
    columns = {name: record.columns.get(name, name) for name in record.data}
    sources = " and ".join(columns[name] for name in given if name in columns)
    columns = {name: f"{name} (from {sources})" for name in irradiance} | columns
    changed = {"data": data, "notes": list(record.notes), "columns": columns}
    return Weather(**vars(record) | changed, interval=interval)


def complete_irradiance(given, apparent_zenith, horizon_cut="measured", dni_extra=np.inf):
    """Compute the missing one of ghi, dhi and dni, and treat the sun near the horizon.

    Parameters
    ----------
    given : dict
        At least two of ghi, dhi, dni: (t,) [Wm⁻²], none negative.
    apparent_zenith : numpy.ndarray, (t,)
        Of the sun at mid-interval [°].
    horizon_cut : {"measured", "neglect"}
        "measured": below 2° of apparent elevation DNI is kept if it was measured; if it would have
        to be derived, as a quotient of two numbers near zero, all light is diffuse. With the sun
        below the horizon all light is diffuse. "neglect": intervals with the sun below 2° have no
        light, as in the paper.
    dni_extra : numpy.ndarray, (t,), optional
        Extraterrestrial normal irradiance [Wm⁻²]: what DNI has above it counts as diffuse.

    Returns
    -------
    dict
        ghi, dhi, dni: (t,) [Wm⁻²].
    """
    sunny, height = is_sunny(apparent_zenith), np.maximum(np.cos(np.radians(apparent_zenith)), 0.0)
    ghi, dhi, dni = (given.get(name) for name in ("ghi", "dhi", "dni"))
    # Intervals with direct light: sun above the horizon, or above 2° if DNI has to be derived.
    direct = (
        sunny if dni is None or horizon_cut == "neglect" else np.asarray(apparent_zenith) < 90.0
    )
    if ghi is None:
        ghi = dhi + dni * height  # Eq. 5
    if dhi is None:
        # Direct above global irradiance comes from the sun's motion within the interval: then DHI
        # is 0.
        dhi = np.maximum(ghi - dni * height, 0.0)  # Eq. 5
    if dni is None:
        dni = np.zeros_like(ghi)
        dni[sunny] = (ghi - np.minimum(dhi, ghi))[sunny] / height[sunny]  # Eq. 5
    above = dni > dni_extra
    dni = np.minimum(dni, dni_extra)
    dhi = np.where(above, np.maximum(ghi - dni * height, 0.0), dhi)
    irradiance = {"ghi": ghi, "dhi": np.where(direct, dhi, ghi), "dni": np.where(direct, dni, 0.0)}
    if horizon_cut == "neglect":
        return {name: np.where(sunny, values, 0.0) for name, values in irradiance.items()}
    return irradiance
