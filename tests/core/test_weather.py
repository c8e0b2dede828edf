"""Weather against sums counted elsewhere, closed relations, and every kind of bad input."""

import json
import re

import numpy as np
import pandas as pd
import pvlib
import pytest
from thorough import mark_cases
from weathers import (
    BARROW,
    BERLIN,
    ERA5,
    HOUR,
    POTSDAM_2018,
    PVGIS,
    STOCKHOLM,
    TMY3,
    annual_sums,
    direct_horizontal,
    lines_of,
    plain_table,
    refuse,
    write_lines,
    write_table,
    year_of,
)

from citypv.core.energy.check_inputs import check_hours
from citypv.core.settings.errors import InputError
from citypv.core.weather.read_weather import read_weather

pytestmark = pytest.mark.every_python


def assert_sun_fits(weather):
    """The stamps are right: the sun of mid-interval explains the split better than one half an hour
    off.
    """
    data = weather.data[weather.data["apparent_zenith"] < 80]
    off = {}
    for minutes in (-30, 0, 30):
        times = data.index + weather.interval / 2 + pd.Timedelta(minutes=minutes)
        zenith = pvlib.solarposition.get_solarposition(times, weather.latitude, weather.longitude)[
            "apparent_zenith"
        ]
        ghi = data["dhi"].to_numpy() + data["dni"].to_numpy() * np.cos(
            np.radians(zenith.to_numpy())
        )
        off[minutes] = np.abs(ghi - data["ghi"].to_numpy()).mean()
    assert off[0] < 0.3 * min(off[-30], off[30])


# --- each format


@pytest.mark.slow
def test_epw_of_the_arctic():
    weather = read_weather(BARROW, *BERLIN)
    assert annual_sums(weather) == pytest.approx(
        [713.4, 674.5, 461.7], abs=12.0
    )  # EXPECTED; dni above 2° only
    assert annual_sums(weather)[0] == pytest.approx(713.4, abs=0.06)
    assert (weather.latitude, weather.longitude, weather.altitude) == (71.286, -156.767, 10.0)
    assert weather.data["temp_air"].mean() == pytest.approx(-11.82, abs=0.01)
    assert weather.data.index[0] == pd.Timestamp("2021-01-01T09:00Z")  # midnight, nine hours behind
    assert_sun_fits(weather)
    # Polar night and midnight sun.
    assert weather.data.loc["2021-12-05":"2022-01-01", "dni"].max() == 0
    assert (weather.data.loc["2021-06-01":"2021-07-01", "apparent_zenith"] < 90).all()


@pytest.mark.slow
def test_pvgis_csv_and_json_and_its_time_offset(tmp_path):
    weather = read_weather(PVGIS, *BERLIN)
    assert annual_sums(weather)[0] == pytest.approx(1435.9, abs=0.06)  # EXPECTED
    assert annual_sums(weather)[1:] == pytest.approx([1591.6, 570.9], abs=1.0)
    assert (weather.latitude, weather.longitude, weather.altitude) == (45.0, 8.0, 250.0)
    # The middle of the interval is the satellite's time, 0.1761 h after the stamp.
    middle = weather.data.index[0] + weather.interval / 2
    assert abs((middle - pd.Timestamp("2021-01-01T00:00Z")).total_seconds() - 0.1761 * 3600) < 1
    assert_sun_fits(weather)
    # The same as json.
    lines = lines_of(PVGIS)
    head = next(number for number, line in enumerate(lines) if line.startswith("time(UTC)"))
    names = lines[head].split(",")
    rows = [line.split(",") for line in lines[head + 1 : head + 1 + 8760]]
    hourly = [
        {names[0]: row[0]} | dict(zip(names[1:], map(float, row[1:]), strict=True)) for row in rows
    ]
    place = {
        "latitude": 45.0,
        "longitude": 8.0,
        "elevation": 250.0,
        "irradiance_time_offset": 0.1761,
    }
    tree = {"inputs": {"location": place}, "outputs": {"months_selected": [], "tmy_hourly": hourly}}
    tree["meta"] = {"inputs": {}}
    (tmp_path / "tmy.json").write_text(json.dumps(tree))
    pd.testing.assert_frame_equal(read_weather(tmp_path / "tmy.json", *BERLIN).data, weather.data)


@pytest.mark.slow
def test_clear_sky_is_an_upper_bound():
    weather = read_weather("clear-sky", *BERLIN, 34.0, year=2020)
    assert "upper bound" in weather.label
    assert len(weather.data) == 8784
    assert (weather.data["temp_air"] == 15).all() and (weather.data["wind_speed"] == 1).all()
    # The same by pvlib's own Location, hour by hour.
    middle = weather.data.index + HOUR / 2
    sky = pvlib.location.Location(*BERLIN, altitude=34.0).get_clearsky(middle)
    high = weather.data["apparent_zenith"].to_numpy() < 85
    np.testing.assert_allclose(weather.data["ghi"][high], sky["ghi"].to_numpy()[high], rtol=5e-3)
    real = read_weather(ERA5, *BERLIN)
    assert annual_sums(weather)[0] > 1.2 * annual_sums(real)[0]


@pytest.mark.slow
def test_csv_of_two_columns_of_irradiance(tmp_path):
    times = year_of()
    table = plain_table(times)
    weather = read_weather(write_table(tmp_path / "own.csv", table), *BERLIN)
    np.testing.assert_allclose(weather.data["ghi"], table["ghi"], rtol=1e-9)
    np.testing.assert_allclose(
        weather.data["dhi"] + direct_horizontal(weather.data), table["ghi"], atol=1e-9
    )
    # From ghi and dni, and from dhi and dni, the third comes out the same.
    for other in ("dhi", "ghi"):
        sunny = (
            weather.data[["ghi", "dhi", "dni", "temp_air", "wind_speed"]]
            .rename_axis("time")
            .drop(columns=other)
        )
        again = read_weather(write_table(tmp_path / f"no_{other}.csv", sunny), *BERLIN)
        high = weather.data["apparent_zenith"] <= 88
        np.testing.assert_allclose(again.data[other][high], weather.data[other][high], atol=1e-6)


@pytest.mark.slow
def test_csv_with_summer_time_offsets_and_quarter_hours(tmp_path):
    local = year_of(freq="15min").tz_convert("Europe/Berlin")
    table = plain_table(local)
    weather = read_weather(write_table(tmp_path / "quarters.csv", table), *BERLIN)
    assert weather.interval == pd.Timedelta(minutes=15)
    assert weather.data.index[0] == pd.Timestamp("2021-01-01T00:00Z")
    assert len(weather.data) == 4 * 8760


def test_files_that_are_no_weather(tmp_path):
    refuse(tmp_path / "missing.nc", "no such file")
    for name, content, word in (
        ("empty.csv", b"", "empty"),
        ("words.txt", b"this is no weather", "not in a known weather format"),
        ("bytes.bin", bytes(range(256)) * 8, "not in a known weather format"),
        ("header.csv", b"time,ghi,dhi,temp_air,wind_speed\n", "no rows below its header"),
        ("other.csv", b"a,b\n1,2\n", "weather variable"),
        ("cut.epw", b"LOCATION,Nowhere,-,USA,TMY3,1,10.0,10.0,1.0,5.0\nDESIGN", "has no hours"),
        ("head.epw", b"LOCATION,Nowhere\n", "cannot be read as epw"),
        ("cut.json", b'{"inputs": {"loc', "not JSON"),
        ("other.json", b'{"outputs": {}}', "PVGIS"),
        (
            "city.json",
            b'{"type": "CityJSON"}',
            "is a city (CityJSON), not weather; give it before the options, as CITY",
        ),
        ("city.gml", b'<?xml version="1.0"?>\n<CityModel xmlns="a,b"/>', "is a city (CityGML)"),
        ("city.obj", b"# a, b\nv 0.5 1 -2\nv 1e3 2 3\nv 1 2 3\nf 1 2 3\n", "is a city (OBJ)"),
        ("page.html", b"<html><body>Not found, sorry</body>", "not in a known weather format"),
        ("cut.nc", ERA5.read_bytes()[:300], "NetCDF"),
        ("cut_at_the_end.nc", ERA5.read_bytes()[:-3], "NetCDF"),
        ("cut.csv.gz", PVGIS.read_bytes()[:50_000], "cut.csv.gz"),
        ("broken.nc", b"\x89HDF\r\n\x1a\n" + bytes(200), "NetCDF"),
        ("broken.gz", b"\x1f\x8b\x08\x00rubbish", "decompression fails"),
    ):
        path = tmp_path / name
        path.write_bytes(content)
        refuse(path, word)


def test_an_epw_in_fahrenheit_lacks_nothing(tmp_path):
    """As from Las Vegas: at and above 99.9 an EPW has no value."""
    lines = [line.split(",") for line in lines_of(BARROW)]
    hot = [",".join([*line[:6], f"{float(line[6]) * 1.8 + 100}", *line[7:]]) for line in lines[8:]]
    refuse(
        write_lines(tmp_path / "f.epw", [*lines_of(BARROW)[:8], *hot]),
        "Dry Bulb Temperature",
        "in °C; give °C",
    )


@pytest.mark.slow
@pytest.mark.parametrize("dropped", mark_cases([1, 3, 20], kept=1))
def test_an_epw_without_its_last_columns_is_read(tmp_path, dropped):
    """As of TMY2: without albedo and rain; without DHI and wind: taken from others."""
    lines = lines_of(BARROW)
    path = write_lines(
        tmp_path / "short.epw", [*lines[:8], *(line.rsplit(",", dropped)[0] for line in lines[8:])]
    )
    if dropped == 20:
        notes = read_weather(path, 71.3, -156.6).notes
        words = "Diffuse Horizontal Radiation, Wind Speed: no value at all"
        assert any(words in note for note in notes), notes
        return
    found, whole = read_weather(path, 71.3, -156.6).data, read_weather(BARROW, 71.3, -156.6).data
    pd.testing.assert_frame_equal(found, whole)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("path", "names"),
    mark_cases(
        [
            (BARROW, {"ghi": "Global Horizontal Radiation", "dni": "Direct Normal Radiation"}),
            (TMY3, {"ghi": "GHI (W/m^2)", "dhi": "DHI (W/m^2)", "temp_air": "Dry-bulb (C)"}),
            (STOCKHOLM, {"dhi": "DHI", "wind_speed": "Wind Speed"}),
            (
                POTSDAM_2018,
                {"ghi": "G_Bh + G_Dh", "dni": "dni (from G_Bh + G_Dh and G_Dh)", "temp_air": "Ta"},
            ),
            (PVGIS, {"ghi": "G(h)", "dni": "Gb(n)"}),
            (ERA5, {"dhi": "ssrd - fdir", "dni": "dni (from ssrd and ssrd - fdir)"}),
        ],
        kept=3,
    ),
)
def test_messages_use_the_names_of_the_file(path, names):
    weather = read_weather(path, *BERLIN)
    assert {name: weather.columns[name] for name in names} == names
    weather.data.loc[weather.data.index[416], "dni"] = 2068.0
    with pytest.raises(
        InputError, match=re.escape(f"{weather.columns['dni']} of the weather: hour 416 is 2068")
    ):
        check_hours(weather)


@pytest.mark.slow
def test_tables_with_faults(tmp_path):
    good = plain_table(year_of())
    unknown = good["ghi"].where(good.index != good.index[50])
    faults = {
        "naive": (good.tz_localize(None), ["has no time zone", "row 1"]),
        "one_irradiance": (good.drop(columns="ghi"), ["missing: ghi, or two of ghi, dhi, dni"]),
        "gap": (good.drop(good.index[100:103]), ["gap", "2021-01-05 04:00", "2021-01-05 07:00"]),
        "twice": (pd.concat([good[:10], good[9:]]), ["twice", "2021-01-01 09:00"]),
        "disorder": (good.iloc[::-1], ["out of order"]),
        "nan": (good.assign(ghi=unknown), ["ghi is missing at 2021-01-03 02:00"]),
        "negative": (good.assign(dhi=good["dhi"] - 30), ["dhi is -30", "2021-01-01 00:00"]),
        "kelvin": (good.assign(temp_air=285.0), ["temp_air is 285"]),
        "half_a_year": (good[:4380], ["182.5", "full years"]),
        "infinite": (good.assign(ghi=np.inf), ["ghi is missing"]),
    }
    for name, (table, words) in faults.items():
        refuse(write_table(tmp_path / f"{name}.csv", table), *words)
    text = (tmp_path / "kelvin.csv").read_text().replace("285.0", "warm", 1)
    (tmp_path / "word.csv").write_text(text)
    refuse(tmp_path / "word.csv", "'warm'", "row 1", "temp_air")


@pytest.mark.slow
def test_epw_of_a_real_leap_year_without_its_leap_day(tmp_path):
    lines = lines_of(BARROW)
    rows = [",".join(["2012", *line.split(",")[1:]]) for line in lines[8:]]
    path = write_lines(tmp_path / "2012.epw", lines[:8] + rows)
    weather = read_weather(path, *BERLIN)
    assert annual_sums(weather)[0] == pytest.approx(713.4, abs=0.06)
    # A real year that is no leap year keeps its calendar.
    write_lines(path, lines[:8] + [row.replace("2012", "2014", 1) for row in rows])
    assert read_weather(path, *BERLIN).data.index[0] == pd.Timestamp("2014-01-01T09:00Z")


def test_unknown_point():
    with pytest.raises(InputError, match="--weather-point"):
        read_weather(ERA5, *BERLIN, point="cubic")
