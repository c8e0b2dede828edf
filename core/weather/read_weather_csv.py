"""Weather from plain csv tables."""

import io
import re
from pathlib import Path

import pandas as pd

from ..read.open_input import read_text
from ..settings.errors import InputError, first_true
from .weather import Record, read_numbers

NAMES = ["ghi", "dhi", "dni", "temp_air", "wind_speed", "pressure"]
COMMAS = "write commas between columns, and points in numbers"
UTC_OFFSET = r"(?:Z|UTC|[+-]\d{2}(?::?\d{2})?)\s*$"


def read_weather_csv(path, latitude, longitude, altitude):
    """Read a csv whose first column is the start of each interval, with its UTC offset, and whose names are pvlib's.

    Columns: two or three of ghi, dhi, dni [Wm⁻²]; temp_air [°C]; wind_speed [ms⁻¹]; optionally pressure [Pa]. Lines
    that start with # are skipped.

    Parameters
    ----------
    path : path-like
        The file; may be gz-compressed.
    latitude, longitude : float
        Place of the weather [°], which is not in the file.
    altitude : float
        Of that place [m].

    Returns
    -------
    Record
    """
    path = Path(path)
    text = read_text(path)
    header = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
    if header.count(",") < 2 and re.search(r"[;\t]", header):
        raise InputError(path, "its columns are separated by other signs than commas", COMMAS)
    try:
        table = pd.read_csv(io.StringIO(text), comment="#", skipinitialspace=True, dtype=str, header=None)
    except pd.errors.ParserError as error:
        problem = f"a row has more fields than the header ({' '.join(str(error).split('error: ')[-1].split())})"
        raise InputError(path, problem, COMMAS) from error
    given = [str(name).strip() for name in table.iloc[0]]
    names = [name.lower() if name.lower() in NAMES else name for name in given]
    twice = [name for name in NAMES if names.count(name) > 1]
    if twice:
        raise InputError(path, f"its header has {twice[0]} twice", "leave one of the two columns out")
    table = table.iloc[1:].reset_index(drop=True).set_axis(names, axis=1)
    if table.empty:
        raise InputError(path, "the table has no rows", "give a header and one row for each interval")
    names = [name for name in NAMES if name in table]
    if not names:
        problem = f"no column of the header ({', '.join(map(str, table.columns[:8]))}) is a weather variable"
        raise InputError(path, problem, "name the columns ghi, dhi, dni, temp_air, wind_speed, pressure")
    times = read_times(path, table.iloc[:, 0])
    data = pd.DataFrame({name: read_numbers(path, table[name]) for name in names}).set_axis(times, axis=0)
    columns = dict(zip(table.columns, given, strict=True))
    return Record(data, latitude, longitude, altitude, str(path), f"csv {path.name}", columns=columns)


def read_times(path, column):
    """Parse time stamps with UTC offsets.

    Parameters
    ----------
    path : pathlib.Path
        The file, for messages.
    column : pandas.Series of str
        First column of the table.

    Returns
    -------
    pandas.DatetimeIndex, (t,)
        In UTC.
    """
    column = column.fillna("")
    if (row := first_true(~column.str.contains(UTC_OFFSET))) is not None:
        problem = f"the time {column.iloc[row]!r} (row {row + 1}, column {column.name!r}) has no time zone"
        raise InputError(path, problem, "write times with their UTC offset, such as 2021-01-01T00:00+01:00")
    times = pd.to_datetime(column, utc=True, errors="coerce", format="ISO8601")
    if (row := first_true(times.isna())) is not None:
        problem = f"{column.iloc[row]!r} (row {row + 1}, column {column.name!r}) is not a time"
        raise InputError(path, problem, "write times as 2021-01-01T00:00+01:00")
    return pd.DatetimeIndex(times)
