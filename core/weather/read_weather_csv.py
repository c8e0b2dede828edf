"""Weather from plain csv tables."""

from pathlib import Path

import pandas as pd

from ..errors import InputError
from ..files.open_input import open_text
from .record import Record

NAMES = ["ghi", "dhi", "dni", "temp_air", "wind_speed", "pressure"]
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
    with open_text(path) as file:
        table = pd.read_csv(file, comment="#", skipinitialspace=True, dtype=str)
    if table.empty:
        raise InputError(path, "the table has no rows", "give a header and one row for each interval")
    names = [name for name in NAMES if name in table]
    if not names:
        problem = f"no column of the header ({', '.join(map(str, table.columns[:8]))}) is a weather variable"
        raise InputError(path, problem, "name the columns ghi, dhi, dni, temp_air, wind_speed, pressure")
    times = read_times(path, table.iloc[:, 0])
    data = pd.DataFrame({name: read_numbers(path, table[name]) for name in names}).set_axis(times, axis=0)
    return Record(data, latitude, longitude, altitude, str(path), f"csv {path.name}")


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
    naive = ~column.str.contains(UTC_OFFSET)
    if naive.any():
        row = int(naive.to_numpy().argmax())
        problem = f"the time {column.iloc[row]!r} (row {row + 1}, column {column.name!r}) has no time zone"
        raise InputError(path, problem, "write times with their UTC offset, such as 2021-01-01T00:00+01:00")
    times = pd.to_datetime(column, utc=True, errors="coerce", format="ISO8601")
    if times.isna().any():
        row = int(times.isna().to_numpy().argmax())
        problem = f"{column.iloc[row]!r} (row {row + 1}, column {column.name!r}) is not a time"
        raise InputError(path, problem, "write times as 2021-01-01T00:00+01:00")
    return pd.DatetimeIndex(times)


def read_numbers(path, column):
    """Numbers of one column; empty fields are missing values.

    Parameters
    ----------
    path : pathlib.Path
        The file, for messages.
    column : pandas.Series of str
        One column of the table.

    Returns
    -------
    numpy.ndarray, (t,)
    """
    numbers = pd.to_numeric(column, errors="coerce")
    words = numbers.isna() & column.notna()
    if words.any():
        row = int(words.to_numpy().argmax())
        raise InputError(
            path, f"{column.iloc[row]!r} (row {row + 1}, column {column.name!r}) is not a number", "correct it"
        )
    return numbers.to_numpy(dtype=float)
