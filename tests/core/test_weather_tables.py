"""Tables as other programs and sources write them: leap years, steps, zones, columns, signs, and
rows with faults.
"""

import gzip
import io

import numpy as np
import pandas as pd
import pvlib
import pytest
from thorough import mark_cases
from weathers import (
    BARROW,
    BERLIN,
    HOUR,
    PVGIS,
    STOCKHOLM,
    TMY3,
    lines_of,
    plain_table,
    refuse,
    write_lines,
    year_of,
)

from citypv.core.weather.read_weather import read_weather

pytestmark = pytest.mark.every_python

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


@pytest.mark.slow
def test_values_are_those_of_pvlib():
    with gzip.open(TMY3, "rt") as file:
        rows = file.readline().strip().strip('"').replace('""', '"') + "\n" + file.read()
    table, _ = pvlib.iotools.read_tmy3(
        io.StringIO(rows.replace("NEW YORK J F KENNEDY INT'L AR", "JFK"))
    )
    table = table.iloc[1:]  # the first row is a copy of the last
    weather = read_weather(TMY3, *BERLIN)
    for name in ("temp_air", "wind_speed", "ghi"):
        np.testing.assert_array_equal(weather.data[name], table[name])
    assert (weather.data.index.tz_convert("Etc/GMT+5").hour == (table.index.hour - 1) % 24).all()
    assert "repeated row" in weather.label and (weather.latitude, weather.longitude) == (
        40.65,
        -73.8,
    )


@pytest.mark.slow
def test_february_of_a_leap_year(tmp_path):
    """The last hour of 28 February 1996 has the stamp 24:00, and does not make the typical year a
    leap year.
    """
    original = read_weather(TMY3, *BERLIN)
    for number, midnight in enumerate(("02/28/1996,24:00", "03/01/1996,00:00")):
        lines = [
            line.replace("/1995,", "/1996,") if line.startswith("02/") else line
            for line in lines_of(TMY3)
        ]
        path = write_lines(
            tmp_path / f"{number}.csv",
            [line.replace("02/28/1996,24:00", midnight) for line in lines],
        )
        weather = read_weather(path, *BERLIN)
        pd.testing.assert_frame_equal(weather.data, original.data)
        assert not any("29 February" in note for note in weather.notes)


@pytest.mark.slow
@pytest.mark.parametrize("freq", mark_cases(["h", "30min", "15min"], kept=2))
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


@pytest.mark.slow
def test_columns_of_other_sources(tmp_path):
    lines = lines_of(TMY3)
    names = lines[1].split(",")
    doubled = [lines[0], lines[1].replace("DNI (W/m^2)", "DNI (W/m^2))"), *lines[2:]]
    found = read_weather(write_lines(tmp_path / "doubled.csv", doubled), *BERLIN).data
    np.testing.assert_array_equal(found[NAMES], read_weather(TMY3, *BERLIN).data[NAMES])
    at = names.index("Pressure (mbar)")
    empty = lines[:2] + [
        ",".join("" if i == at else v for i, v in enumerate(row.split(","))) for row in lines[2:]
    ]
    pressure = read_weather(write_lines(tmp_path / "empty.csv", empty), *BERLIN).data["pressure"]
    np.testing.assert_allclose(pressure, pvlib.atmosphere.alt2pres(5.0))
    renamed = [
        lines[0],
        lines[1].replace("Wspd", "Wind").replace("DNI", "Beam").replace("GHI", "Global"),
        *lines[2:],
    ]
    refuse(
        write_lines(tmp_path / "renamed.csv", renamed),
        "missing: ghi, or two of ghi, dhi, dni (there: dhi)",
    )
    wrong = [*lines[:9], lines[9].replace("/", "."), *lines[10:]]
    refuse(write_lines(tmp_path / "wrong.csv", wrong), "row 8", "MM/DD/YYYY")


def test_sam_csv_of_another_source(tmp_path):
    lines = lines_of(STOCKHOLM)
    lines[0] = lines[0].replace("Local Time Zone", "Zone")
    refuse(write_lines(tmp_path / "sam.csv", lines), "SAM csv of another source", "NSRDB")
    lines = lines_of(STOCKHOLM)
    lines[2] = lines[2].replace("Minute", "Min")
    refuse(write_lines(tmp_path / "minute.csv", lines), "Minute", "NSRDB", "csv")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("zone", "place"),
    mark_cases([(5.5, (28.6, 77.1)), (5.75, (27.7, 85.3)), (-3.5, (47.6, -52.7))], kept=2),
)
def test_nsrdb_in_zones_of_half_hours(tmp_path, zone, place):
    """Delhi, Kathmandu and St. John's: images at half past the hour of UTC."""
    stamps = year_of()
    middle = stamps - pd.Timedelta(hours=zone) + HOUR / 2
    zenith = pvlib.solarposition.get_solarposition(middle, *place)["zenith"]
    height = np.cos(np.radians(zenith)).clip(lower=0).to_numpy()
    lines = [
        "Source,Location ID,Latitude,Longitude,Time Zone,Elevation,Local Time Zone,Pressure "
        "Units,Version",
        f"NSRDB,1,{place[0]},{place[1]},{zone},216.5,{zone},mbar,3.2",
        "Year,Month,Day,Hour,Minute,GHI,DHI,Temperature,Wind Speed,Pressure",
        *(
            f"{time.year},{time.month},{time.day},{time.hour},30,{600 * h},{200 * h},20,2,980"
            for time, h in zip(stamps, height, strict=True)
        ),
    ]
    weather = read_weather(write_lines(tmp_path / "half.csv", lines), *BERLIN)
    assert (weather.latitude, weather.longitude, weather.altitude) == (*place, 216.5)
    assert (weather.data.index + weather.interval / 2 == middle).all()
    np.testing.assert_allclose(weather.data["ghi"], 600 * height)
    assert abs(weather.checks["2021"]["daylight_shift"]) <= 2
    # A year of each month's own is a typical one.
    months = [f"{2000 + int(line.split(',')[1])}{line[4:]}" for line in lines[3:]]
    typical = read_weather(write_lines(tmp_path / "typical.csv", lines[:3] + months), *BERLIN)
    assert "typical year" in typical.label and typical.data["ghi"].sum() == pytest.approx(
        weather.data["ghi"].sum()
    )


@pytest.mark.slow
def test_csv_as_spreadsheets_write_it(tmp_path):
    table = plain_table(year_of())
    table["dni"] = 400.0 * (table["ghi"] > 0)
    text = table.to_csv()
    expected = read_weather(write_lines(tmp_path / "plain.csv", text.splitlines()), *BERLIN).data
    upper = text.replace("ghi,dhi", " GHI ,DHI")
    found = read_weather(write_lines(tmp_path / "upper.csv", upper.splitlines()), *BERLIN).data
    pd.testing.assert_frame_equal(found, expected)  # a column in capitals is not left out
    head, *rows = text.splitlines()
    for name, words, changed in (
        ("twice", "ghi twice", text.replace("dhi", "GHI")),
        ("semicolons", "write commas", text.replace(",", ";")),
        ("german", "write commas", table.to_csv(sep=";", decimal=",")),
        ("tabs", "write commas", text.replace(",", "\t")),
        ("commas", "line 2", "\n".join([head, *(row.replace(".", ",") for row in rows)])),
    ):
        refuse(write_lines(tmp_path / f"{name}.csv", changed.splitlines()), words)


@pytest.mark.parametrize(
    ("path", "field", "row", "column"),
    [
        (BARROW, 13, 4008, "Global Horizontal Radiation"),
        (STOCKHOLM, 6, 4003, "DHI"),
        (TMY3, 2, 4002, "GHI"),
    ],
)
def test_words_among_numbers_are_named_by_row(tmp_path, path, field, row, column):
    lines = lines_of(path)
    fields = lines[row].split(",")
    lines[row] = ",".join([*fields[:field], "n/k", *fields[field + 1 :]])
    heads = {BARROW: 8, STOCKHOLM: 3, TMY3: 2}[path]
    refuse(
        write_lines(tmp_path / path.name.replace(".gz", ""), lines),
        f"row {row - heads + 1}",
        f"column '{column}",
    )


def test_typical_year_of_pvgis_with_rows_missing_or_cut(tmp_path):
    lines = lines_of(PVGIS)
    refuse(
        write_lines(tmp_path / "gap.csv", lines[:5000] + lines[5001:]), "8759 hours instead of 8760"
    )
    refuse(
        write_lines(tmp_path / "cut.csv", [*lines[:5000], lines[5000][:15]]),
        "4983 hours",
        "may be cut",
    )
    word = [*lines[:5000], lines[5000].replace(",", ",x", 1), *lines[5001:]]
    refuse(write_lines(tmp_path / "word.csv", word), "row 4983")
