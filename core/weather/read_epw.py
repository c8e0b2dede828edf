"""EnergyPlus weather files (EPW)."""

import io
import re
from itertools import islice
from pathlib import Path

import pandas as pd
import pvlib

from ..files.open_input import open_text
from .weather import Record, coerce_year, read_numbers

COLUMNS = {
    "ghi": "ghi",
    "dhi": "dhi",
    "dni": "dni",
    "temp_air": "temp_air",
    "wind_speed": "wind_speed",
    "atmospheric_pressure": "pressure",
}
# Missing values of the format are at or above these numbers.
MISSING = {"ghi": 9999, "dhi": 9999, "dni": 9999, "temp_air": 99.9, "wind_speed": 999, "pressure": 999999}
OFFSET = re.compile(r"irradiance time offset \(h\)\s*:\s*([-+]?\d*\.?\d+)", re.IGNORECASE)
HEADER_LINES = 8


def read_epw(path):
    """Read an EPW file of a station.

    Hour 1 covers 0:00 to 1:00 of local standard time, and pvlib's index is the start of that hour. A typical year is
    put into one calendar year. Temperature, wind and pressure are those of the record's own hour. In files of PVGIS
    the irradiance is that of satellite images, whose time is given in COMMENTS.

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
    table, place = pvlib.iotools.read_epw(io.StringIO(text))
    data = pd.DataFrame({ours: read_numbers(path, table[name]) for name, ours in COLUMNS.items()}, index=table.index)
    for name, mark in MISSING.items():
        data[name] = data[name].mask(data[name] >= mark)
    # Pressure can be computed from the altitude of the station; the other variables have no substitute.
    if data["pressure"].isna().any():
        data["pressure"] = data["pressure"].fillna(pvlib.atmosphere.alt2pres(place["altitude"]))
    data, typical = coerce_year(data)
    shift, notes = read_offset(text)
    data.index = pd.DatetimeIndex(data.index).tz_convert("UTC") + shift
    label = f"EPW {path.name} ({place['city'].strip()}{', typical year' if typical else ''})"
    return Record(data, place["latitude"], place["longitude"], place["altitude"], str(path), label, notes)


def read_offset(text):
    """Shift of the middle of the intervals from half past the hour.

    PVGIS gives the time of its images in the header of its csv, in hours after the stamp, and one hour less in COMMENTS
    of its EPW (0.1761 and -0.8239 for 45° N, 8° E). The row of hour h in EPW has the image stamped h, so the image was
    taken one hour plus the offset after h.

    Parameters
    ----------
    text : str
        The file.

    Returns
    -------
    shift : pandas.Timedelta
        0 if the comments have no offset.
    notes : list of str
    """
    head = "\n".join(islice(io.StringIO(text), HEADER_LINES))
    found = OFFSET.search(head)
    if not found:
        return pd.Timedelta(0), []
    offset = float(found[1])
    after = offset + 1.0  # [h] from the end of the hour to the image
    shift = pd.Timedelta(seconds=round((after + 0.5) * 3600.0))
    return shift, [
        f"irradiance of images {after:+.4f} h from the end of the hour (Irradiance Time Offset {offset:g} h)"
    ]
