"""Files of the Physical Solar Model (PSM) of the National Solar Radiation Database (NSRDB)."""

import csv
from pathlib import Path

import pandas as pd

from ..files.open_input import open_text
from ..settings.errors import InputError
from .record import Record, read_numbers
from .typical_year import coerce_year

COLUMNS = {
    "GHI": "ghi",
    "DHI": "dhi",
    "DNI": "dni",
    "Temperature": "temp_air",
    "Wind Speed": "wind_speed",
    "Pressure": "pressure",
}
PASCALS = {"mbar": 100.0, "millibar": 100.0, "hpa": 100.0, "pa": 1.0}
HEADER = ("Time Zone", "Local Time Zone", "Latitude", "Longitude", "Elevation")  # fields of the first line
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
        head = [next(csv.reader([file.readline()]), []) for _ in range(3)]
        place = dict(zip((name.strip() for name in head[0]), head[1], strict=False))
        names = [name.strip() for name in head[2]]
        check_header(path, place, names)
        # Programs that save the file fill its rows up with empty fields.
        table = pd.read_csv(file, header=None, dtype=str).iloc[:, : len(names)]
    table = table.set_axis(names[: table.shape[1]], axis=1)
    data = pd.DataFrame({ours: read_numbers(path, table[name]) for name, ours in COLUMNS.items() if name in table})
    data = data.mask(data <= MISSING)
    if "pressure" in data:
        data["pressure"] *= PASCALS[place.get("Pressure Units", "mbar").strip().lower()]
    data.index = read_stamps(path, table).tz_localize(int(3600 * float(place["Time Zone"])))
    data, typical = coerce_year(data)
    interval = (data.index[1:] - data.index[:-1]).to_series().mode().iloc[0]
    data.index = data.index.tz_convert("UTC") - interval / 2
    label = f"NSRDB PSM {path.name}{' (typical year)' if typical else ''}"
    latitude, longitude, altitude = (float(place[name]) for name in ("Latitude", "Longitude", "Elevation"))
    return Record(data, latitude, longitude, altitude, str(path), label)


def read_stamps(path, table):
    """Time stamps from year, month, day, hour and minute."""
    parts = pd.DataFrame({name: read_numbers(path, table[name]) for name in STAMP})
    stamps = pd.to_datetime(parts, errors="coerce")
    if stamps.isna().any():
        row = int(stamps.isna().to_numpy().argmax())
        raise InputError(path, f"row {row + 1} has no valid date and time", "download the file again; it may be cut")
    return pd.DatetimeIndex(stamps)


def check_header(path, place, names):
    """Refuse files of other sources that SAM reads, too: their stamps and columns have other meanings.

    Parameters
    ----------
    path : pathlib.Path
        The file, for the message.
    place : dict
        Names and values of the first two lines.
    names : list of str
        Of the columns.

    Raises
    ------
    InputError
    """
    missing = [name for name in HEADER if name not in place] + [name for name in STAMP if name not in names]
    if missing:
        raise InputError(path, f"is not of NSRDB: its header has no {', '.join(missing)}", CURE)
