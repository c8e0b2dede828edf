"""Hourly weather of the German Weather Service (DWD): station tables and test reference years
(TRY).
"""

import io
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pyproj

from ..read.open_input import read_text
from ..settings.errors import InputError, first_true
from ..sun.solar_position import solar_position
from .check_sun_times import measure_sun_times
from .weather import DAMAGED, TYPICAL_YEAR, Record

ZONE = pd.Timedelta(hours=1)  # Central European Time throughout the year
TABLE_COLUMNS = {"ghi": "G_Bh + G_Dh", "dhi": "G_Dh", "temp_air": "Ta", "wind_speed": "FF"}
TRY_COLUMNS = {"ghi": "B + D", "dhi": "D", "temp_air": "t", "wind_speed": "WG"}
NUMBER = r"[-+]?\d+(?:[.,]\d+)?"


def read_dwd(path, place=None):
    """Read a table of a station's year: lines of ``#``, then hour, p, Ta, RH, G_Bh, G_Dh, N, FF,
    DD.

    Hour 1 ends at 1:00 of UTC+1. G_Bh and G_Dh are the direct and the diffuse part on a horizontal
    plane. The header has latitude and longitude in either order, distinguished by what is possible
    in Germany. Up to three hours missing at the end of the year are filled with the values of the
    last one, if that has no light; a note reports it.

    Parameters
    ----------
    path : path-like
        The file; may be gz-compressed.
    place : tuple of float, optional
        Latitude and longitude [°], and altitude [m] if known, instead of those in the file.

    Returns
    -------
    Record
        ghi and dhi [Wm⁻²], temp_air [°C], wind_speed [ms⁻¹] and pressure [Pa].
    """
    path = Path(path)
    # Head with the names of columns, then rows of numbers.
    lines = read_text(path).splitlines()
    head = [line.lstrip("# ") for line in lines if line.startswith("#")]
    names = next(line.split() for line in head if "G_Bh" in line)
    rows = [line for line in lines if re.match(r"\s*\d", line)]
    table = _read_columns(path, names, rows, TABLE_COLUMNS | {"pressure": "p"})
    # Hours count from 1 without gaps.
    hours = _read_rows(path, rows)[0].to_numpy()
    if (first := first_true(hours != np.arange(1, len(hours) + 1))) is not None:
        raise InputError(
            path,
            f"row {first + 1} is of hour {hours[first]}",
            "give every hour of the year in order",
        )
    # The year from a line of the head, else from the file's name; without one the file is refused.
    year = next(
        (
            found
            for text in (*head, path.name)
            if (found := re.search(r"(?<!\d)(19|20)\d\d(?!\d)", text))
        ),
        None,
    )
    if year is None:
        raise InputError(path, "no year in its header or name", "put the year into the file's name")
    year = int(year[0])
    missing, notes = (8784 if pd.Timestamp(year, 1, 1).is_leap_year else 8760) - len(table), []
    # Up to three hours that lack at the end of a year are filled in at night, and refused by day.
    if 0 < missing <= 3:
        if table["ghi"].iloc[-1] > 0:
            raise InputError(
                path, f"the last {missing} hours of {year} are missing", "give the whole year"
            )
        table = pd.concat([table, table.iloc[[-1] * missing]], ignore_index=True)
        what = f"the last {missing} h of {year} (night) are missing in {path.name}"
        notes.append(f"{what}: filled with the hour before")
    table.index = pd.date_range(f"{year}-01-01", periods=len(table), freq="h", tz="UTC") - ZONE
    # The place that is given counts, else the one in the header.
    own, label = place or _find_place(path, head), f"DWD {path.name}"
    return Record(table, *own, str(path), label, notes, TABLE_COLUMNS)


def _read_rows(path, rows, **options):
    """Table of rows of numbers; `options` of pandas."""
    with InputError.parsing(path, "cannot be read as a table of DWD", DAMAGED):
        return pd.read_csv(io.StringIO("\n".join(rows)), sep=r"\s+", header=None, **options)


def _read_columns(path, names, rows, columns):
    """Table of our variables from rows of numbers: sums of the file's columns; pressure from hPa to
    Pa.
    """
    table = _read_rows(path, [row.replace(",", ".") for row in rows], dtype=float).set_axis(
        names, axis=1
    )
    missing = [
        part for parts in columns.values() for part in parts.split(" + ") if part not in names
    ]
    if missing:
        raise InputError(path, f"has no column {', '.join(missing)}", DAMAGED)
    table = table.mask(table <= -99.0)  # marks of missing values are -99 and -999
    sums = {
        name: sum(table[part] for part in parts.split(" + ")) for name, parts in columns.items()
    }
    data = pd.DataFrame(sums)
    return data.assign(pressure=100.0 * data["pressure"])


def _find_place(path, head):
    """Latitude and longitude [°] and altitude [m] from the header line that contains
    numbers only.
    """
    for line in head:
        numbers = [float(number.replace(",", ".")) for number in re.findall(NUMBER, line)]
        if len(numbers) < 3 or not re.fullmatch(rf"\s*(?:{NUMBER}\s*)+", line):
            continue
        for latitude, longitude in (numbers[:2], numbers[1::-1]):
            place = {"latitude": latitude, "longitude": longitude}
            germany = {"latitude": (46.0, 56.0), "longitude": (5.0, 16.0)}  # [°]
            if all(low <= place[name] <= high for name, (low, high) in germany.items()):
                return latitude, longitude, numbers[2]
    raise InputError(
        path, "no place in Germany in its header", "give --weather-place LATITUDE LONGITUDE"
    )


def read_try(path, place=None):
    """Read a test reference year of 2017: Rechtswert and Hochwert, then RW HW MM DD HH t p WR WG N
    x RF B D A E IL.

    B and D are the direct and the diffuse part on a horizontal plane, in Central European Time
    (UTC+1): see `_lay_try`.

    Parameters
    ----------
    path : path-like
        The file; may be gz-compressed.
    place : tuple of float, optional
        As in `read_dwd`.

    Returns
    -------
    Record
    """
    path = Path(path)
    lines = read_text(path).splitlines()
    table = _read_try_table(path, lines, ["RW", "HW"])
    if place is None:
        values = []
        for name in ("Rechtswert", "Hochwert", "Hoehenlage"):
            matches = next(
                (re.search(rf":\s*({NUMBER})", line) for line in lines if line.startswith(name)),
                None,
            )
            if not matches:
                raise InputError(
                    path, f"no line {name} in its header", "give --weather-place LATITUDE LONGITUDE"
                )
            values.append(float(matches[1].replace(",", ".")))
        # Rechtswert and Hochwert stand in Lambert's conformal conic of Europe.
        globe = pyproj.Transformer.from_crs("EPSG:3034", "EPSG:4326", always_xy=True)
        longitude, latitude = globe.transform(*values[:2])
        place = round(latitude, 5), round(longitude, 5), values[2]
    return _lay_try(path, table, place)


def read_try_2010(path, place=None):
    """Read a test reference year of 2010: RG IS MM DD HH N WR WG t p x RF W B D IK A E IL of one of
    15 regions.

    As `read_try`; the place stands in the header's line Lage, in degrees and minutes.
    """
    path = Path(path)
    lines = read_text(path).splitlines()
    table = _read_try_table(path, lines, ["RG", "IS"])
    if place is None:
        # Degrees may be written in any encoding: what is between the numbers does not count.
        pattern = r"Lage\D*(\d+)\D+(\d+)\D*?N\D*?(\d+)\D+(\d+)\D*?[OE]\b\D*(\d+)?"
        match = re.search(pattern, "\n".join(lines[:40]))
        if not match:
            raise InputError(
                path, "no place (Lage) in its header", "give --weather-place LATITUDE LONGITUDE"
            )
        numbers = [float(number or 0) for number in match.groups()]
        place = (
            round(numbers[0] + numbers[1] / 60, 5),
            round(numbers[2] + numbers[3] / 60, 5),
            numbers[4],
        )
    return _lay_try(path, table, place)


def _read_try_table(path, lines, first_names):
    """Variables and hours of a test reference year, whose line of names begins with these."""
    start = next(
        (number for number, line in enumerate(lines) if line.split()[:2] == first_names), None
    )
    if start is None:
        problem = f"the line of column names ({' '.join(first_names)} MM DD HH …) is missing"
        raise InputError(path, problem, "download the file again; it may be cut")
    rows = [line for line in lines[start + 1 :] if re.match(r"\s*\d+\s+\d+\s", line)]
    if not rows:
        raise InputError(
            path, "no hours below its column names", "download the file again; it may be cut"
        )
    table = _read_columns(
        path, lines[start].split(), rows, TRY_COLUMNS | {"pressure": "p", "hour": "HH", "day": "DD"}
    )
    day, hour = table.pop("day").to_numpy(), table.pop("hour").to_numpy()
    table.index = pd.date_range(f"{TYPICAL_YEAR}-01-01", periods=len(table), freq="h", tz="UTC")
    if (first := first_true((day != table.index.day) | (hour != table.index.hour + 1))) is not None:
        problem = f"row {first + 1} is of day {day[first]:.0f}, hour {hour[first]:.0f}"
        raise InputError(path, problem, "give every hour of the year in order")
    return table


def _lay_try(path, table, place):
    """Record of a test reference year, put on the calendar of 2021.

    Radiation of hour 1 is the mean of 0:00 to 1:00, or, in files of 2017, centred at 1:00. The sun
    tells which one it is, to some minutes: half an hour lies between them.
    """
    half_hour, notes = pd.Timedelta(minutes=30), []
    data = table.set_axis(table.index - ZONE, axis=0)
    sun = solar_position(data.index, 2 * half_hour, *place[:2])
    light = data[["ghi", "dhi"]].clip(lower=0.0)
    shift = measure_sun_times(light, 2 * half_hour, place[0], sun).daylight_shift
    if shift is not None and 15 <= shift <= 45:
        data.index += half_hour
        notes.append("radiation of hour 1 is that of 0:30 to 1:30, by the sun")
    return Record(
        data, *place, str(path), f"DWD TRY {path.name} (typical year)", notes, TRY_COLUMNS
    )
