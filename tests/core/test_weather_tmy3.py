"""TMY3 csv as other programs and sources write it: leap years, steps, columns; and SAM csv of other sources."""

import gzip
import io

import numpy as np
import pandas as pd
import pvlib
import pytest
from weathers import BERLIN, HOUR, STOCKHOLM, TMY3, lines_of, plain_table, refuse, write_lines, year_of

from citypv.core.weather.read_weather import read_weather

NAMES = ["ghi", "dhi", "dni", "temp_air", "wind_speed"]
HEAD = [
    '0,"BERLIN",NA,1.0,52.51,13.39,35',
    "Date (MM/DD/YYYY),Time (HH:MM),GHI (W/m^2),DHI (W/m^2),Dry-bulb (C),Wspd (m/s)",
]


def write_tmy3(path, table, interval):
    """The table in TMY3's format, by the ends of its intervals in UTC+1."""
    rows = []
    for end, row in zip(table.index + interval + HOUR, table.itertuples(), strict=True):
        midnight = end == end.normalize()
        day = f"{end - interval if midnight else end:%m/%d/%Y}"
        hour = "24:00" if midnight else f"{end:%H:%M}"
        rows.append(f"{day},{hour},{row.ghi},{row.dhi},{row.temp_air},{row.wind_speed}")
    return write_lines(path, HEAD + rows)


def test_values_are_those_of_pvlib():
    with gzip.open(TMY3, "rt") as file:
        name = file.readline().strip().strip('"').replace('""', '"')
        path_of_rows = name + "\n" + file.read()
    table, _ = pvlib.iotools.read_tmy3(io.StringIO(path_of_rows.replace("NEW YORK J F KENNEDY INT'L AR", "JFK")))
    table = table.iloc[1:]  # the first row is a copy of the last
    weather = read_weather(TMY3, *BERLIN)
    for name in ("temp_air", "wind_speed", "ghi"):
        np.testing.assert_array_equal(weather.data[name], table[name])
    assert (weather.data.index.tz_convert("Etc/GMT+5").hour == (table.index.hour - 1) % 24).all()


def test_february_of_a_leap_year(tmp_path):
    """The last hour of 28 February 1996 has the stamp 24:00, and does not make the typical year a leap year."""
    original = read_weather(TMY3, *BERLIN)
    for number, midnight in enumerate(("02/28/1996,24:00", "03/01/1996,00:00")):
        lines = [line.replace("/1995,", "/1996,") if line.startswith("02/") else line for line in lines_of(TMY3)]
        path = write_lines(tmp_path / f"{number}.csv", [line.replace("02/28/1996,24:00", midnight) for line in lines])
        weather = read_weather(path, *BERLIN)
        pd.testing.assert_frame_equal(weather.data, original.data)
        assert not any("29 February" in note for note in weather.notes)


@pytest.mark.parametrize("freq", ["h", "30min", "15min"])
def test_real_years_and_steps_in_this_format(tmp_path, freq):
    interval = pd.Timedelta(1, "h") if freq == "h" else pd.Timedelta(freq)
    table = plain_table(year_of(2020, freq=freq) - HOUR)
    weather = read_weather(write_tmy3(tmp_path / "leap.csv", table, interval), *BERLIN)
    assert weather.interval == interval
    assert (weather.data.index == table.index).all()
    assert len(weather.data) == 8784 * (HOUR / interval)
    np.testing.assert_allclose(weather.data["ghi"], table["ghi"])
    assert "typical" not in weather.label
    assert abs(weather.checks["2020"]["daylight_shift"]) <= 2


def test_columns_of_other_sources(tmp_path):
    lines = lines_of(TMY3)
    names = lines[1].split(",")
    doubled = [lines[0], lines[1].replace("DNI (W/m^2)", "DNI (W/m^2))"), *lines[2:]]
    np.testing.assert_array_equal(
        read_weather(write_lines(tmp_path / "doubled.csv", doubled), *BERLIN).data[NAMES],
        read_weather(TMY3, *BERLIN).data[NAMES],
    )
    at = names.index("Pressure (mbar)")
    empty = lines[:2] + [",".join("" if i == at else v for i, v in enumerate(row.split(","))) for row in lines[2:]]
    pressure = read_weather(write_lines(tmp_path / "empty.csv", empty), *BERLIN).data["pressure"]
    np.testing.assert_allclose(pressure, pvlib.atmosphere.alt2pres(5.0))
    renamed = [lines[0], lines[1].replace("Wspd", "Wind").replace("DNI", "Beam").replace("GHI", "Global"), *lines[2:]]
    refuse(write_lines(tmp_path / "renamed.csv", renamed), "missing: wind_speed, two of ghi, dhi, dni (there: dhi)")
    wrong = [*lines[:9], lines[9].replace("/", "."), *lines[10:]]
    refuse(write_lines(tmp_path / "wrong.csv", wrong), "row 8", "MM/DD/YYYY")


def test_sam_csv_of_another_source(tmp_path):
    lines = lines_of(STOCKHOLM)
    lines[0] = lines[0].replace("Local Time Zone", "Zone")
    refuse(write_lines(tmp_path / "sam.csv", lines), "Local Time Zone", "NSRDB", "csv")
    lines = lines_of(STOCKHOLM)
    lines[2] = lines[2].replace("Minute", "Min")
    refuse(write_lines(tmp_path / "minute.csv", lines), "Minute", "NSRDB", "csv")
