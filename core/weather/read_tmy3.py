"""Typical meteorological years of the US National Solar Radiation Database (TMY3)."""

import csv
import io
from pathlib import Path

import pandas as pd
import pvlib

from ..files.open_input import open_text
from .record import Record
from .typical_year import coerce_year

NAMES = ["ghi", "dhi", "dni", "temp_air", "wind_speed", "pressure"]
MISSING = -9000.0  # missing values are -9900 in this format


def read_tmy3(path):
    """Read a TMY3 csv of a station.

    Stamps are at the end of the hour, in local standard time. Months come from different years and are put into one
    calendar year. Files saved by other programs may begin with a copy of the last row, to start at midnight: a row
    that repeats another in time and all values is dropped, as noted in the label.

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
        header = read_header(file.readline())
        text = file.read()
    table, place = pvlib.iotools.read_tmy3(io.StringIO(",".join(header) + "\n" + text))
    copies = table.reset_index().duplicated().to_numpy()
    table = table[~copies]
    data = table[NAMES].astype(float)
    data = data.mask(data <= MISSING)
    data["pressure"] *= 100.0  # mbar to Pa
    data.index = pd.DatetimeIndex(data.index) - pd.Timedelta(hours=1)
    data, _ = coerce_year(data)
    data.index = data.index.tz_convert("UTC")
    repeated = f", {copies.sum()} repeated row left out" if copies.any() else ""
    label = f"TMY3 {path.name} ({header[1]}, typical year{repeated})"
    return Record(data, place["latitude"], place["longitude"], place["altitude"], str(path), label)


def read_header(line):
    """The seven fields of the first line, with commas inside fields replaced.

    Programs that save the file may quote the whole line as one field.

    Parameters
    ----------
    line : str
        First line of the file.

    Returns
    -------
    list of str
        Station number, name, state, time zone, latitude, longitude, altitude.
    """
    fields = next(csv.reader([line.strip()]))
    if sum(bool(field) for field in fields) == 1:
        fields = next(csv.reader([fields[0]]))
    return [field.replace(",", " ").strip() for field in fields[:7]]
