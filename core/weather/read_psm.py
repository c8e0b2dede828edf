"""Files of the Physical Solar Model (PSM) of the National Solar Radiation Database (NSRDB)."""

import csv
import io
from pathlib import Path

import pandas as pd
import pvlib

from ..errors import InputError
from ..files.open_input import open_text
from .record import Record
from .typical_year import coerce_year

NAMES = ["ghi", "dhi", "dni", "temp_air", "wind_speed", "pressure"]
PASCALS = {"mbar": 100.0, "millibar": 100.0, "hpa": 100.0, "pa": 1.0}
HEADER = ("Local Time Zone", "Latitude", "Longitude", "Elevation")  # fields of the first line
STAMP = ("Year", "Month", "Day", "Hour", "Minute")
CURE = "give a csv of NSRDB, or one with times, ghi, dhi, dni, temp_air and wind_speed (docs/weather.md)"
MISSING = -990.0  # missing values are -999 or -9999 in this format


def read_psm(path):
    """Read a PSM csv in SAM's format: two header lines, the column names, one row for each interval.

    Values are instantaneous at their stamps (satellite images; at half past in hourly files): the interval is centred
    on the stamp. A typical year (TMY) is put into one calendar year.

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
        text = file.read()
    check_header(path, text)
    with io.StringIO(text) as file:
        table, place = pvlib.iotools.read_nsrdb_psm4(file, map_variables=True)
    data = table[[name for name in NAMES if name in table]].astype(float)
    data = data.mask(data <= MISSING)
    if "pressure" in data:
        data["pressure"] *= PASCALS[str(place.get("Pressure Units", "mbar")).strip().lower()]
    data.index = pd.DatetimeIndex(data.index)
    data, typical = coerce_year(data)
    interval = (data.index[1:] - data.index[:-1]).to_series().mode().iloc[0]
    data.index = data.index.tz_convert("UTC") - interval / 2
    label = f"NSRDB PSM {path.name}{' (typical year)' if typical else ''}"
    return Record(data, place["latitude"], place["longitude"], float(place["altitude"]), str(path), label)


def check_header(path, text):
    """Refuse files of other sources that SAM reads, too: their stamps and columns have other meanings.

    Parameters
    ----------
    path : pathlib.Path
        The file, for the message.
    text : str
        The whole file.

    Raises
    ------
    InputError
    """
    lines = [next(csv.reader([line])) for line in text.split("\n", 3)[:3]]
    found = {name.strip() for name in lines[0]}, {name.strip() for name in lines[2]}
    missing = [name for name in HEADER if name not in found[0]] + [name for name in STAMP if name not in found[1]]
    if missing:
        raise InputError(path, f"is not of NSRDB: its header has no {', '.join(missing)}", CURE)
