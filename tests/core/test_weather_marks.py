"""Test reference years, typical years in csv, EPW with several records an hour, formats that are
named, their table.
"""

import gzip
import re
import zipfile
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from thorough import mark_cases
from weathers import (
    BERLIN,
    DATA,
    ERA5,
    HOUR,
    POTSDAM_2018,
    PVGIS,
    ROOT,
    lines_of,
    refuse,
    write_lines,
)

from citypv.core.settings.errors import InputError
from citypv.core.weather import formats
from citypv.core.weather.formats import FORMATS, read_as, recognise_weather, table_of_formats
from citypv.core.weather.read_weather import read_weather

pytestmark = pytest.mark.every_python

PLACE = (*BERLIN, 34.0)
MAIN = ["ghi", "dhi", "dni"]


@pytest.fixture(scope="module")
def year():
    """Weather of Berlin, by the start of each hour."""
    return read_weather(ERA5, *BERLIN)


def read_record(path):
    """What the reader of a file's format makes of it, unchecked."""
    return read_as(recognise_weather(path), path, own=PLACE, place=None)


# --- test reference years of DWD


def try_lines(centred=False):
    """A test reference year of 2010 of Potsdam's 2018, whose hour 1 is 0:00 to 1:00 or centred at
    1:00.
    """
    rows = np.array([line.split() for line in lines_of(POTSDAM_2018)[6:]], float)
    light = rows[:, 4:6]
    light = (light + np.roll(light, -1, axis=0)) / 2 if centred else light
    head = [
        "TRY_04_Potsdam",
        "Lage: 52° 23' N <- B. 13° 04' O <- L. 81 Meter über NN",
        "",
        "  RG IS MM DD HH N  WR  WG  t p x",
    ]
    head[-1] = "RG IS MM DD HH N WR WG t p x RF W B D IK A E IL"
    times = pd.date_range("2021-01-01", periods=8760, freq="h")
    body = [
        f"4 1 {t.month} {t.day} {t.hour + 1} {r[6]:.0f} {r[8]:.0f} {r[7]} {r[2]} {r[1]:.0f} 3 85 0 "
        f"{b:.1f} {d:.1f} 1 291 -281 1"
        for t, r, (b, d) in zip(times, rows, light, strict=True)
    ]
    return [*head, "***", *body]


@pytest.mark.parametrize("centred", [False, True])
def test_reference_year_of_2010(tmp_path, centred):
    path = tmp_path / "TRY2010_04.dat"
    path.write_bytes("\n".join(try_lines(centred)).encode("latin-1"))
    weather = read_weather(path, *BERLIN)
    assert (weather.latitude, weather.longitude) == pytest.approx(
        (52 + 23 / 60, 13 + 4 / 60), abs=1e-5
    )
    assert weather.altitude == 81
    minute = 30 if centred else 0
    assert weather.data.index[0] == pd.Timestamp(f"2020-12-31T23:{minute:02d}Z")
    assert weather.data["ghi"].sum() / 1000 == pytest.approx(1209.4, abs=0.1)


def test_reference_years_that_are_cut(tmp_path):
    lines = try_lines()
    nowhere = [line for line in lines if not line.startswith("Lage")]
    refuse(write_lines(tmp_path / "a.dat", nowhere), "no place (Lage)", "--weather-place")
    refuse(write_lines(tmp_path / "b.dat", lines[:4]), "no hours")
    head = ["Koordinatensystem : Lambert konform konisch", "Rechtswert        : 3731500 Meter"]
    refuse(write_lines(tmp_path / "c.dat", head), "RW HW MM DD HH", "missing", "cut")


# --- typical years in csv, EPW with several records an hour


@pytest.mark.parametrize("zone", ["UTC", "Etc/GMT+7"])
def test_typical_year_in_csv(tmp_path, year, zone):
    """Months of different years, in the file's zone, are put into one."""
    times = pd.date_range("2017-01-01", periods=8760, freq="h", tz=zone)
    local = year.data[[*MAIN, "temp_air", "wind_speed"]].set_axis(times)
    mixed = [time.replace(year=2007 + time.month * 5 % 9) for time in local.index]
    local.set_axis(pd.DatetimeIndex(mixed, name="time"), axis=0).to_csv(tmp_path / "typical.csv")
    record = read_record(tmp_path / "typical.csv")
    assert (
        record.notes == ["months of different years, put into one"]
        and "typical year" in record.label
    )
    assert record.data.index.is_monotonic_increasing and len(record.data) == 8760
    assert set(pd.Series(record.data.index).diff().dropna()) == {pd.Timedelta("1h")}
    assert record.data.index.tz_convert(zone)[0].strftime("%m-%d %H:%M") == "01-01 00:00"
    np.testing.assert_allclose(record.data["ghi"], year.data["ghi"])


def test_real_years_in_csv_are_left_as_they_are(tmp_path, year):
    table = year.data[[*MAIN, "temp_air", "wind_speed"]].rename_axis("time")
    table.drop(table.index[4000:4024]).to_csv(tmp_path / "gap.csv")
    refuse(tmp_path / "gap.csv", "a gap in the time axis")


@pytest.mark.slow
def test_typical_year_of_pvlib_with_the_cure_that_is_named(tmp_path):
    with gzip.open(PVGIS, "rt") as file:
        lines = file.read().splitlines()
    start = next(number for number, line in enumerate(lines) if line.startswith("time(UTC)"))
    rows = [line.split(",") for line in lines[start + 1 : start + 8761]]
    names = {
        "T2m": "temp_air",
        "G(h)": "ghi",
        "Gb(n)": "dni",
        "Gd(h)": "dhi",
        "WS10m": "wind_speed",
    }
    table = pd.DataFrame(rows, columns=lines[start].split(","))
    table.index = pd.to_datetime(table.pop("time(UTC)"), format="%Y%m%d:%H%M", utc=True)
    table.rename(columns=names)[list(names.values())].to_csv(tmp_path / "tmy.csv")
    with pytest.raises(InputError) as caught:
        read_weather(tmp_path / "tmy.csv", 45.0, 8.0)
    shift = float(re.search(r"--time-shift (-?\d+)", str(caught.value))[1])
    mended, own = (
        read_weather(tmp_path / "tmy.csv", 45.0, 8.0, time_shift=shift),
        read_weather(PVGIS, 45.0, 8.0),
    )
    assert abs(mended.data.index[0] - own.data.index[0]) < pd.Timedelta(minutes=1)
    np.testing.assert_array_equal(mended.data["ghi"], own.data["ghi"])


def test_pressure_in_hpa_by_its_size(tmp_path, year):
    table = year.data[[*MAIN, "temp_air", "wind_speed", "pressure"]].rename_axis("time")
    table.assign(pressure=table["pressure"] / 100).to_csv(tmp_path / "hpa.csv")
    record = read_record(tmp_path / "hpa.csv")
    np.testing.assert_allclose(record.data["pressure"], year.data["pressure"])
    assert record.notes == ["pressure is in hPa, by its size"]


def epw_lines(year, parts, energy=False):
    """EPW of a year with several records an hour; [W/m²], or what each interval receives
    [Wh/m²].
    """
    head = [f"LOCATION,Berlin,-,DEU,-,0,{BERLIN[0]},{BERLIN[1]},0,34"]
    head += [
        f"{name},0"
        for name in ("DESIGN CONDITIONS", "TYPICAL/EXTREME PERIODS", "GROUND TEMPERATURES")
    ]
    head += ["HOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0", "COMMENTS 1,", "COMMENTS 2,"]
    head += [f"DATA PERIODS,1,{parts},Data,Sunday,1/1,12/31"]
    factor = 1 / parts if energy else 1
    for time, row in zip(year.data.index + HOUR, year.data.itertuples(), strict=True):
        start = time - HOUR
        for part in range(parts):
            ghi, dni, dhi = (factor * value for value in (row.ghi, row.dni, row.dhi))
            stamp = f"{start.year},{start.month},{start.day},{start.hour + 1},{60 * (part + 1) // parts}"
            values = (
                f"{row.temp_air},5,50,101000,0,0,300,{ghi},{dni},{dhi},0,0,0,0,180,{row.wind_speed}"
            )
            head.append(f"{stamp},A7,{values},5,5,20,77777,9,999999999,10,0.1,0,88,0.2,0,1")
    return head


@pytest.mark.parametrize(
    ("parts", "energy"), mark_cases([(2, False), (2, True), (4, True), (6, False)], kept=2)
)
def test_epw_with_several_records_an_hour(tmp_path, year, parts, energy):
    path = write_lines(tmp_path / "sub.epw", epw_lines(calendar_year(year), parts, energy))
    record = read_record(path)
    assert record.data.index[1] - record.data.index[0] == HOUR / parts
    hourly = record.data["ghi"].to_numpy().reshape(-1, parts).mean(axis=1)
    np.testing.assert_allclose(hourly, calendar_year(year).data["ghi"], atol=1e-6)
    assert f"{parts} records an hour" in record.notes[0]
    assert ("Wh/m² per interval" in record.notes[0]) == energy


def calendar_year(year):
    """The same values from 0:00 of 1 January on."""
    times = pd.date_range("2017-01-01", periods=len(year.data), freq="h", tz="UTC")
    return SimpleNamespace(data=year.data.set_axis(times))


def test_epw_with_an_hour_of_fewer_records(tmp_path, year):
    lines = epw_lines(calendar_year(year), 2)
    refuse(
        write_lines(tmp_path / "less.epw", [*lines[:100], *lines[101:]]),
        "has 1 records, others have 2",
    )


# --- formats that are named, and what follows from the table

NINJA = "# Renewables.ninja PV (Point API) - 37.97\ntime,electricity\n2019-01-01 00:00,0\n"
SOLARGIS = "#15 MINUTE VALUES\n#File type: Solargis_TS\n#\nDate;Time;GHI;DNI;DIF\n"
SAM = (
    "Latitude,Longitude,Time "
    "Zone,Elevation\n40,-105,-7,1600\nYear,Month,Day,Hour,DNI,DHI,Wspd,Tdry\n"
)
TMY2 = " 14739 BOSTON                 MA  -5 N 42 22 W  71  2     5\n 84 1 1 1 0 0\n"
NAMED = {
    "a.grib": ("GRIB\x00\x00\x01\x02" + "x" * 50, "GRIB", "NetCDF"),
    "ninja.csv": (NINJA, "renewables.ninja", "kW/m²"),
    "solargis.csv": (SOLARGIS, "Solargis", "csv of times"),
    "boston.tm2": (TMY2, "TMY2", "EPW"),
    "sam.csv": (SAM + "2019,1,1,0,0,0,1,2\n", "SAM", "NSRDB"),
}


@pytest.mark.parametrize("name", NAMED)
def test_formats_that_are_not_read_are_named(tmp_path, name):
    text, title, cure = NAMED[name]
    (tmp_path / name).write_text(text)
    refuse(tmp_path / name, title, "which is not read", cure)


def test_the_manual_has_the_table():
    manual = (ROOT / "docs" / "reference" / "weather.md").read_text("utf-8")
    for part in table_of_formats():
        assert part in manual


def test_every_format_says_what_it_is():
    assert len({form.key for form in FORMATS}) == len(FORMATS)
    for form in FORMATS:
        assert bool(form.instead) != bool(form.stamp), form.key
        assert form.lies in ("", "begins", "ends", "centred")
        if form.reader:
            room, function = form.reader.split(".")
            assert hasattr(__import__(f"citypv.core.weather.{room}", fromlist=[function]), function)
    assert {".epw", ".nc", ".csv", ".json", ".dat", ".zip"} <= set(formats.suffixes_of_weather())


def test_files_of_the_tests_are_what_they_were():
    keys = {
        path.name.split(".")[0][:7]: recognise_weather(path).key
        for path in sorted(DATA.glob("*.gz"))
    }
    assert keys == {
        "984998_": "psm",
        "CHL_San": "epw",
        "EGY_Cai": "epw",
        "Germany": "dwd",
        "USA_AK_": "epw",
        "USA_NY_": "epw",
        "pvgis_t": "pvgis-json",
        "tmy3_74": "tmy3",
    }


DAMAGED = {
    "a.json": '{"utc_offset_seconds": 0, "elevation": 1}',
    "b.json": (
        '{"utc_offset_seconds": "x", "elevation": null, "hourly": {"time": ["2019-01-01T00:00"]}}'
    ),
    "c.json": '{"utc_offset_seconds": 0, "elevation": 1, "hourly": [1, 2]}',
    "d.json": '{"properties": {}, "geometry": {}}',
    "e.json": (
        '{"properties": {"parameter": {"T2M": {"2019": 1}}}, "geometry": {"coordinates": [1, 2, '
        "3]}}"
    ),
    "f.csv": (
        "latitude,longitude,elevation,utc_offset_seconds\n1,2\n\ntime,temperature_2m "
        "(°C)\n0,3\n1,3\n"
    ),
    "g.csv": "-BEGIN HEADER-\nNASA/POWER\n-END HEADER-\n",
    "h.csv": "# CAMS\n# Observation period;GHI\n1;2\n",
    "i.csv": "period_end,ghi\n,\n",
    "j.csv": "valid_time,latitude,longitude\n",
    "k.csv": "time,ghi\n",
    "l.dat": (
        "Lage: 52° 23' N 13° 04' O 81 Meter\nRG IS MM DD HH N WR WG t p\n4 1 1 1 1 0 0 1 1 1000\n"
    ),
    "m.epw": "LOCATION,a,b,c,d,1,52,13,1,30\n",
}


@pytest.mark.parametrize("name", DAMAGED)
def test_damaged_files_of_each_format_are_one_line(tmp_path, name):
    (tmp_path / name).write_text(DAMAGED[name])
    refuse(tmp_path / name)


def test_damaged_zips_are_one_line(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("a.csv", "x,y\n1,2\n")
    refuse(tmp_path / "a.zip", "no columns valid_time")
    content = (tmp_path / "a.zip").read_bytes()
    (tmp_path / "b.zip").write_bytes(content[:30] + b"other" + content[35:])
    refuse(tmp_path / "b.zip", "cannot be read as point series")
