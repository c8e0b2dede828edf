"""EnergyPlus weather files (EPW)."""

from pathlib import Path

import pandas as pd
import pvlib

from .open_text import open_text
from .record import Record
from .typical_year import coerce_year

COLUMNS = {
    "ghi": "ghi",
    "dhi": "dhi",
    "dni": "dni",
    "temp_air": "temp_air",
    "wind_speed": "wind_speed",
    "atmospheric_pressure": "pressure",
}
# The format's marks for a missing value: at or above this number there is none.
MISSING = {"ghi": 9999, "dhi": 9999, "dni": 9999, "temp_air": 99.9, "wind_speed": 999, "pressure": 999999}


def read_epw(path):
    """Read an EPW file of a station.

    Its hour 1 covers 0:00 to 1:00 of local standard time, and pvlib's index is the start of that hour. A typical year
    is put into one calendar year. Temperature, wind and pressure are those of the record's own hour.

    Parameters
    ----------
    path : path-like
        The file; may be gz-compressed.

    Returns
    -------
    Record
    """
    path = Path(path)
    with open_text(path) as file:
        table, place = pvlib.iotools.read_epw(file)
    data = table[list(COLUMNS)].rename(columns=COLUMNS).astype(float)
    for name, mark in MISSING.items():
        data[name] = data[name].mask(data[name] >= mark)
    # Pressure has a good substitute in the altitude of the station; the other variables have none.
    if data["pressure"].isna().any():
        data["pressure"] = data["pressure"].fillna(pvlib.atmosphere.alt2pres(place["altitude"]))
    data, typical = coerce_year(data)
    data.index = pd.DatetimeIndex(data.index).tz_convert("UTC")
    label = f"EPW {path.name} ({place['city'].strip()}{', typical year' if typical else ''})"
    return Record(data, place["latitude"], place["longitude"], place["altitude"], str(path), label)
