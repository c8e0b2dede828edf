"""Complete a record that lacks whole columns: air temperature and wind from the climate, DHI and
DNI from GHI.
"""

from dataclasses import replace

import numpy as np
import pandas as pd
import pvlib

from ..settings.errors import InputError
from .climate import climate, hours_of_year
from .climate_grid import LAPSE, LEAST_LATITUDE

FROM_CLIMATE = {"temp_air": "air temperature", "wind_speed": "wind speed"}


def drop_empty_columns(record):
    """The record without columns that have no value at all, with a note: they hold nothing but
    marks of missing values.
    """
    empty = [name for name in record.data if record.data[name].isna().all()]
    if not empty or len(empty) == len(record.data.columns):
        return record
    names = ", ".join(record.columns.get(name, name) for name in empty)
    notes = [*record.notes, f"{names}: no value at all, only marks of missing ones; not used"]
    return replace(record, data=record.data.drop(columns=empty), notes=notes)


def fill_from_climate(record, interval):
    """Take air temperature or wind speed from the built-in climate where the record has none at
    all.

    Parameters
    ----------
    record : Record
    interval : pandas.Timedelta
        Length of its intervals.

    Returns
    -------
    Record
        With a note on what was taken. Temperatures are brought to the record's altitude.

    Raises
    ------
    InputError
        South of 60° S, where there is no climate.
    """
    missing = [name for name in FROM_CLIMATE if name not in record.data]
    if not missing:
        return record
    words = " and ".join(FROM_CLIMATE[name] for name in missing)
    if record.latitude < LEAST_LATITUDE:
        raise InputError(
            record.source,
            f"missing: {', '.join(missing)}; the built-in climate ends at 60° S",
            "add these columns to the weather",
        )
    usual = climate(record.latitude, (record.longitude + 180.0) % 360.0 - 180.0)
    # Each interval has the climate's value of the same day and hour; 29 February has the values of
    # the 28th.
    middle = (record.data.index + interval / 2).tz_convert("UTC")
    day = middle.day_of_year - (middle.is_leap_year & (middle.day_of_year > 59)).astype(int)
    row = np.clip((day - 1) * 24 + middle.hour, 0, len(hours_of_year(2021)) - 1)
    filled = usual.data.iloc[row].set_axis(record.data.index, axis=0)
    filled["temp_air"] += LAPSE * (usual.altitude - record.altitude)
    columns = record.columns | {name: f"{name} of the built-in climate" for name in missing}
    notes = [*record.notes, f"no {words} in the file: taken from the built-in climate"]
    return replace(
        record, data=pd.concat([record.data, filled[missing]], axis=1), notes=notes, columns=columns
    )


def decompose_ghi(ghi, zenith, dni_extra):
    """DHI and DNI of GHI alone, by the model of Erbs and Driesse.

    Parameters
    ----------
    ghi : numpy.ndarray, (t,)
        Mean over intervals of at most an hour [Wm⁻²].
    zenith : numpy.ndarray, (t,)
        True zenith angle of the sun at mid-interval [°].
    dni_extra : numpy.ndarray, (t,)
        Extraterrestrial normal irradiance [Wm⁻²].

    Returns
    -------
    dhi, dni : numpy.ndarray, (t,) [Wm⁻²]
        With GHI = DHI + DNI cos z.

    References
    ----------
    A. Driesse, A. Jensen, R. Perez (2024), A continuous form of the Perez diffuse sky model for
    forward and reverse transposition, Solar Energy 267, :doi:`10.1016/j.solener.2023.112093`;
    pvlib's `erbs_driesse`.
    """
    parts = pvlib.irradiance.erbs_driesse(ghi, zenith, dni_extra=dni_extra)
    return np.nan_to_num(np.asarray(parts["dhi"])), np.nan_to_num(np.asarray(parts["dni"]))
