"""Weather as plain csv with the names of pvlib: what users write themselves, and what is kept of
services.
"""

import io
import re
from pathlib import Path

import pandas as pd

from ..read.open_input import read_text
from ..settings.errors import InputError, first_true
from .weather import DAMAGED, Record, coerce_year, read_numbers

NAMES = ["ghi", "dhi", "dni", "temp_air", "wind_speed", "pressure"]


def read_weather_csv(path, own):
    """Read a csv whose first column is the start of each interval, with its UTC offset, and whose
    names are pvlib's.

    Columns: two or three of ghi, dhi, dni [Wm⁻²]; temp_air [°C]; wind_speed [ms⁻¹]; optionally
    pressure [Pa], or hPa, which its size tells. Lines that start with # are skipped, but for "#
    latitude: 52.5", longitude and altitude. Months of different years that make one typical year
    are put into one calendar year.

    Parameters
    ----------
    path : path-like
        The file; may be gz-compressed.
    own : tuple of float
        Latitude and longitude [°] and altitude [m] of the place, if it is not in the file.

    Returns
    -------
    Record
        Of the weather columns that are there, by the start of each interval; notes tell of hPa and
        of a typical year.

    Raises
    ------
    InputError
        Columns are not separated by commas or stand twice, none is a weather variable, or there are
        no rows.
    """
    path = Path(path)
    text = read_text(path)
    # The header is the first line that is no remark; commas separate.
    header = next(
        (line for line in text.splitlines() if line.strip() and not line.startswith("#")), ""
    )
    if header.count(",") < 2 and re.search(r"[;\t]", header):
        raise InputError(
            path,
            "its columns are separated by other signs than commas",
            "write commas between columns, and points in numbers",
        )
    with InputError.parsing(path, "cannot be read as csv", DAMAGED):
        table = pd.read_csv(
            io.StringIO(text), comment="#", skipinitialspace=True, dtype=str, header=None
        )
    # Names are taken as pvlib's, whatever their capitals, and each once.
    given = [str(name).strip() for name in table.iloc[0]]
    names = [name.lower() if name.lower() in NAMES else name for name in given]
    twice = [name for name in NAMES if names.count(name) > 1]
    if twice:
        raise InputError(
            path, f"its header has {twice[0]} twice", "leave one of the two columns out"
        )
    table = table.iloc[1:].reset_index(drop=True).set_axis(names, axis=1)
    names = [name for name in NAMES if name in table]
    if not names:
        raise InputError(
            path,
            f"no column of the header ({', '.join(map(str, table.columns[:8]))}) is a weather "
            "variable",
            "name the columns ghi, dhi, dni, temp_air, wind_speed, pressure",
        )
    # Times stand in the first column; numbers of the others by name.
    times = _read_times(path, table.iloc[:, 0])
    data = pd.DataFrame({name: read_numbers(path, table[name]) for name in names}).set_axis(
        times, axis=0
    )
    notes, columns = [], dict(zip(table.columns, given, strict=True))
    # A median pressure between 300 and 1,150 means hPa, which become Pa.
    if "pressure" in data and 300 < data["pressure"].median() < 1150:
        data["pressure"] *= 100.0
        notes.append("pressure is in hPa, by its size")
    if table.empty:
        raise InputError(path, "has no rows below its header", DAMAGED)
    # A typical year by its months is put into one calendar year.
    local = times.tz_convert(_zone_of(str(table.iloc[0, 0])))
    if typical := _is_typical(local):
        data, _ = coerce_year(data.set_axis(local, axis=0))
        notes.append("months of different years, put into one")
    # The place as the file says, or as it was given.
    head = dict(
        re.findall(r"^# *(latitude|longitude|altitude): *(-?[\d.]+)\s*$", text, re.MULTILINE)
    )
    place = [
        float(head.get(name, value))
        for name, value in zip(("latitude", "longitude", "altitude"), own, strict=True)
    ]
    label = f"csv {path.name}{' (typical year)' if typical else ''}"
    return Record(data, *place, str(path), label, notes, columns)


def _read_times(path, column):
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
    times = pd.to_datetime(column, utc=True, errors="coerce", format="ISO8601")
    zoned = column.str.contains(r"(?:Z|UTC|[+-]\d{2}(?::?\d{2})?)\s*$")
    if (row := first_true(times.isna() | ~zoned)) is not None:
        what = "is not a time" if zoned.iloc[row] else "has no time zone"
        raise InputError(
            path,
            f"the time {column.iloc[row]!r} (row {row + 1}, column {column.name!r}) {what}",
            "write times with their UTC offset, such as 2021-01-01T00:00+01:00",
        )
    return pd.DatetimeIndex(times)


def _zone_of(stamp):
    """Zone of the UTC offset at the end of a time, UTC for Z and none."""
    offset = re.search(r"[+-]\d\d(?::?\d\d)?$", stamp.strip())
    return pd.Timestamp(f"2000-01-01T00:00{offset[0]}").tz if offset else "UTC"


def _is_typical(times):
    """Whether times, in the zone of their file, are one year whose months come from different
    years.
    """
    if len(times) < 2 or len(set(times.year)) < 2:
        return False
    steps = (times[1:] - times[:-1]).to_series()
    years_of_month = pd.Series(times.year).groupby(times.month).nunique()
    whole = len(times) * steps.mode().iloc[0] in (pd.Timedelta(days=365), pd.Timedelta(days=366))
    return whole and not (steps == steps.iloc[0]).all() and (years_of_month == 1).all()
