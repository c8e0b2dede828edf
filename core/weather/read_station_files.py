"""Tables of the US National Solar Radiation Database: TMY3 and PSM.

Each reader takes the path of a file, which may be gz-compressed, and returns a Record.
"""

import csv
import re
from pathlib import Path

import pandas as pd

from ..read.open_input import open_text
from ..settings.errors import InputError, first_true
from .weather import DAMAGED, Record, coerce_year, read_numbers

# Our variable, and column of the file; units of the TMY3 stand in its names. Years of other sources
# in that format have a subset of its columns.
TMY3 = {
    "ghi": "GHI (W/m^2)",
    "dhi": "DHI (W/m^2)",
    "dni": "DNI (W/m^2)",
    "temp_air": "Dry-bulb (C)",
    "wind_speed": "Wspd (m/s)",
    "pressure": "Pressure (mbar)",
}
PSM = {
    "ghi": "GHI",
    "dhi": "DHI",
    "dni": "DNI",
    "temp_air": "Temperature",
    "wind_speed": "Wind Speed",
}
PSM |= {"pressure": "Pressure"}


HOUR = pd.Timedelta(hours=1)
DATE, TIME = "Date (MM/DD/YYYY)", "Time (HH:MM)"  # of TMY3
PASCALS = {"mbar": 100.0, "millibar": 100.0, "hpa": 100.0, "pa": 1.0}
STAMP = ("Year", "Month", "Day", "Hour", "Minute")


def take_columns(path, table, names, missing=None):
    """Take our variables that a table has, by `names` (ours -> the file's name); pressure in the
    file's unit.

    Numbers at or below `missing` are missing values; a column without any value is as good as none.
    """
    data = pd.DataFrame(
        {ours: read_numbers(path, table[name]) for ours, name in names.items() if name in table}
    )
    return data if missing is None else data.dropna(axis=1, how="all").mask(data <= missing)


def read_tmy3(path):
    """Read a TMY3 csv of a station, or a year of another source in this format: Record.

    Stamps are at the end of the interval, in local standard time. Months come from different years
    and are put into one calendar year. Files saved by other programs may quote their whole first
    line as one field, and begin with a copy of the last row, to start at midnight: a row that
    repeats another in time and all values is dropped, as noted in the label.
    """
    path = Path(path)
    with open_text(path) as file:
        header = next(csv.reader([file.readline().strip()]))
        with InputError.parsing(path, "cannot be read as tmy3", DAMAGED):
            table = pd.read_csv(file, low_memory=False)
    # A first line that is quoted as a whole is split once more.
    if sum(bool(field) for field in header) == 1:
        header = next(csv.reader([header[0]]))
    _, name, _, *place = (field.replace(",", " ").strip() for field in header[:7])
    zone, latitude, longitude, altitude = map(float, place)
    # Some sources end a name with two brackets.
    table.columns = [re.sub(r"\)+$", ")", str(name).strip()) for name in table.columns]
    # Without columns of date and time the file is refused.
    missing = [name for name in (DATE, TIME) if name not in table]
    if missing:
        raise InputError(path, f"has no column {missing[0]}", DAMAGED)
    # Rows that repeat another one in everything are dropped.
    copies = table.duplicated().to_numpy()
    table = table[~copies]
    # Values at or below -9000 are missing.
    data = take_columns(path, table, TMY3, -9000.0)
    if "pressure" in data:
        data["pressure"] *= 100.0  # mbar to Pa
    # Starts of intervals in UTC; months of different years become one calendar year.
    data.index = _read_starts(path, table).tz_localize(int(3600 * zone))
    data, typical = coerce_year(data)
    notes = ["typical year"] * typical + [f"{copies.sum()} repeated row left out"] * bool(
        copies.any()
    )
    label = f"TMY3 {path.name} ({', '.join([name, *notes])})"
    return Record(data, latitude, longitude, altitude, str(path), label, columns=TMY3)


def _read_starts(path, table):
    """Start of each interval in the file's time zone, from date and time of its end; 24:00 is
    midnight after the date.

    Typical years have no 29 February, but February may come from a leap year: then a stamp of 0:00
    on 1 March ends the 28th. A real leap year has more of the 29th than its last hour.
    """
    days = pd.to_datetime(table[DATE], format="%m/%d/%Y", errors="coerce")
    parts = table[TIME].astype(str).str.extract(r"^\s*(\d{1,2}):(\d{2})").astype(float)
    ends = days + pd.to_timedelta(60.0 * parts[0] + parts[1], unit="min")
    if (row := first_true(ends.isna())) is not None:
        raise InputError(
            path,
            f"{table[DATE].iloc[row]!r}, {table[TIME].iloc[row]!r} (row {row + 1}) is not a date "
            "and a time",
            "write them as MM/DD/YYYY and HH:MM; or download the file again if it is cut",
        )
    ends = pd.DatetimeIndex(ends)
    steps = ends[1:] - ends[:-1]
    starts = ends - (steps.to_series().mode().iloc[0] if len(steps) else HOUR)
    leap_day = (starts.month == 2) & (starts.day == 29)
    if leap_day.sum() * (ends - starts)[:1].sum() <= HOUR:
        starts = starts.where(~leap_day, starts - pd.Timedelta(days=1))
    return starts


def read_psm(path):
    """Read a PSM csv in SAM's format: Record. The file has two header lines, the column names, and
    one row for each interval.

    Values are instantaneous at their stamps (satellite images; at half past in hourly files): the
    interval is centred on the stamp. A typical year (TMY) is put into one calendar year. Files of
    other sources that SAM reads, too, are refused: their stamps and columns have other meanings.
    """
    # Head: names and values of the place, then names of the columns; without the NSRDB's names the
    # file is refused.
    path = Path(path)
    with open_text(path) as file:
        head = [next(csv.reader([file.readline()]), []) for _ in range(3)]
        place = dict(zip((name.strip() for name in head[0]), head[1], strict=False))
        names = [name.strip() for name in head[2]]
        missing = [
            name
            for name in ("Time Zone", "Local Time Zone", "Latitude", "Longitude", "Elevation")
            if name not in place
        ] + [name for name in STAMP if name not in names]
        if missing:
            raise InputError(
                path,
                f"is not of NSRDB: its header has no {', '.join(missing)}",
                "give a csv of NSRDB, or one with times, ghi, dhi, dni, temp_air and wind_speed "
                "(docs/reference/weather.md)",
            )
        # Programs that save the file fill its rows up with empty fields.
        with InputError.parsing(path, "cannot be read as psm", DAMAGED):
            table = pd.read_csv(file, header=None, dtype=str).iloc[:, : len(names)]
    table = table.set_axis(names[: table.shape[1]], axis=1)
    # Rows that are too short to hold their stamps are refused.
    missing = [name for name in STAMP if name not in table]
    if missing:
        raise InputError(path, f"its rows have no {', '.join(missing)}", DAMAGED)
    # Columns by our names, in which -990 and less are missing; pressure in pascals, by the unit in
    # the head: an unknown unit is refused.
    data = take_columns(path, table, PSM, -990.0)
    if "pressure" in data:
        unit = place.get("Pressure Units", "mbar").strip().lower()
        if unit not in PASCALS:
            raise InputError(
                path, f"its pressure is in {unit!r}", f"give it in {', '.join(PASCALS)}"
            )
        data["pressure"] *= PASCALS[unit]
    # Stamps in the time zone of the head; months of different years become one calendar year;
    # intervals lie around the stamps.
    parts = pd.DataFrame({name: read_numbers(path, table[name]) for name in STAMP})
    data.index = pd.DatetimeIndex(pd.to_datetime(parts)).tz_localize(
        int(3600 * float(place["Time Zone"]))
    )
    data, typical = coerce_year(data)
    interval = (data.index[1:] - data.index[:-1]).to_series().mode().iloc[0]
    data.index -= interval / 2
    label = f"NSRDB PSM {path.name}{' (typical year)' if typical else ''}"
    latitude, longitude, altitude = (
        float(place[name]) for name in ("Latitude", "Longitude", "Elevation")
    )
    return Record(data, latitude, longitude, altitude, str(path), label, columns=PSM)
