"""Typical meteorological years of the US National Solar Radiation Database (TMY3)."""

import csv
import re
from pathlib import Path

import pandas as pd

from ..files.open_input import open_text
from ..settings.errors import InputError
from .record import Record, read_numbers
from .typical_year import coerce_year

# Column and unit of the file, and our variable. Years of other sources in this format have a subset of the columns.
COLUMNS = {
    "GHI (W/m^2)": "ghi",
    "DHI (W/m^2)": "dhi",
    "DNI (W/m^2)": "dni",
    "Dry-bulb (C)": "temp_air",
    "Wspd (m/s)": "wind_speed",
    "Pressure (mbar)": "pressure",
}
DATE, TIME = "Date (MM/DD/YYYY)", "Time (HH:MM)"
MISSING = -9000.0  # missing values are -9900 in this format


def read_tmy3(path):
    """Read a TMY3 csv of a station, or a year of another source in this format.

    Stamps are at the end of the interval, in local standard time. Months come from different years and are put into one
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
        table = pd.read_csv(file, low_memory=False)
    # Some sources end a name with two brackets.
    table.columns = [re.sub(r"\)+$", ")", str(name).strip()) for name in table.columns]
    zone, latitude, longitude, altitude = (float(field) for field in header[3:7])
    ends = read_ends(path, table)
    copies = table.assign(end=ends).duplicated().to_numpy()
    table, ends = table[~copies], ends[~copies]
    # A column without any value is as good as none.
    data = pd.DataFrame({ours: read_numbers(path, table[name]) for name, ours in COLUMNS.items() if name in table})
    data = data.dropna(axis=1, how="all")
    data = data.mask(data <= MISSING)
    if "pressure" in data:
        data["pressure"] *= 100.0  # mbar to Pa
    data.index = find_starts(ends).tz_localize(int(3600 * zone))
    data, typical = coerce_year(data)
    data.index = data.index.tz_convert("UTC")
    notes = ["typical year"] * typical + [f"{copies.sum()} repeated row left out"] * bool(copies.any())
    label = f"TMY3 {path.name} ({', '.join([header[1], *notes])})"
    return Record(data, latitude, longitude, altitude, str(path), label)


def read_ends(path, table):
    """End of each interval in the file's time zone, from date and time; the time 24:00 is midnight after the date."""
    days = pd.to_datetime(table[DATE], format="%m/%d/%Y", errors="coerce")
    parts = table[TIME].astype(str).str.extract(r"^\s*(\d{1,2}):(\d{2})").astype(float)
    ends = days + pd.to_timedelta(60.0 * parts[0] + parts[1], unit="min")
    if ends.isna().any():
        row = int(ends.isna().to_numpy().argmax())
        problem = f"{table[DATE].iloc[row]!r}, {table[TIME].iloc[row]!r} (row {row + 1}) is not a date and a time"
        raise InputError(path, problem, "write them as MM/DD/YYYY and HH:MM; or download the file again if it is cut")
    return pd.DatetimeIndex(ends)


def find_starts(ends):
    """Start of each interval, from their ends, (t,) without time zone.

    Typical years have no 29 February, but February may come from a leap year: then a stamp of 0:00 on 1 March ends the
    28th. A real leap year has more of the 29th than its last hour.
    """
    steps = ends[1:] - ends[:-1]
    interval = steps.to_series().mode().iloc[0] if len(steps) else pd.Timedelta(hours=1)
    starts = ends - interval
    leap_day = (starts.month == 2) & (starts.day == 29)
    if leap_day.sum() * interval <= pd.Timedelta(hours=1):
        starts = starts.where(~leap_day, starts - pd.Timedelta(days=1))
    return starts


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
