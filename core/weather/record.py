"""Weather as read from files, before checks and sun positions; joining several files."""

from dataclasses import dataclass, field, replace

import pandas as pd

from ..settings.errors import InputError

IRRADIANCES = ("ghi", "dhi", "dni")
SAME_PLACE = 0.05  # [°] by which the places of joined files may differ


@dataclass
class Record:
    """The values of one file at one place, as they were read."""

    data: pd.DataFrame  # index: UTC start of each interval; any of ghi, dhi, dni, temp_air, wind_speed, pressure
    latitude: float  # [°]
    longitude: float  # [°]
    altitude: float  # [m]
    source: str  # the file, for messages
    label: str  # shown with the results
    notes: list = field(default_factory=list)  # of str: what the user should know about the file


def join_records(records):
    """One record of several, in the order of time.

    Parameters
    ----------
    records : list of Record

    Returns
    -------
    Record

    Raises
    ------
    InputError
        If their places or columns differ.
    """
    first = records[0]
    if len(records) == 1:
        return first
    for other in records[1:]:
        if max(abs(other.latitude - first.latitude), abs(other.longitude - first.longitude)) > SAME_PLACE:
            problem = f"its place {other.latitude:g}°, {other.longitude:g}° is not that of {first.source}"
            problem += f" ({first.latitude:g}°, {first.longitude:g}°)"
            raise InputError(other.source, problem, "give years of one place, or --weather-place LATITUDE LONGITUDE")
        if set(other.data) != set(first.data):
            differing = ", ".join(sorted(set(other.data) ^ set(first.data)))
            raise InputError(other.source, f"not all files have {differing}", "give files with the same columns")
    records = sorted(records, key=lambda record: record.data.index[0])
    return replace(
        first,
        data=pd.concat([record.data for record in records]),
        source=", ".join(record.source for record in records),
        label=", ".join(record.label for record in records),
        notes=[note for record in records for note in record.notes],
    )


def change_record(record, time_shift=0.0, without="none"):
    """Shift the times and drop a column, as requested, with notes on it.

    Parameters
    ----------
    record : Record
    time_shift : float
        [min] added to the times.
    without : {"none", "ghi", "dhi", "dni"}
        Column to drop.

    Returns
    -------
    Record
    """
    if without not in ("none", *IRRADIANCES):
        raise InputError("--weather-without", f"{without!r} is unknown", f"give one of none, {', '.join(IRRADIANCES)}")
    data, notes = record.data, list(record.notes)
    if without in data:
        data = data.drop(columns=without)
        notes.append(f"{without} of the file is not used")
    if time_shift:
        data = data.set_axis(data.index + pd.Timedelta(minutes=time_shift), axis=0)
        notes.append(f"times shifted by {time_shift:+g} min")
    return replace(record, data=data, notes=notes)


def read_numbers(path, column):
    """Numbers of one column; empty fields are missing values.

    Parameters
    ----------
    path : path-like
        The file, for messages.
    column : pandas.Series
        One column of the table, one row for each interval.

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
