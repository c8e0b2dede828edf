"""NSRDB, DWD, TRY, hourly PVGIS and years that are put together, against pvlib called directly."""

import gzip
import json
import threading
import time
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import ClassVar

import numpy as np
import pandas as pd
import pvlib
import pytest
from small_city import write_small_city
from weathers import (
    BARROW,
    BERLIN,
    DATA,
    ERA5,
    HOUR,
    POTSDAM_2018,
    PVGIS,
    STOCKHOLM,
    annual_sums,
    lines_of,
    refuse,
    write_lines,
)

from citypv.core.settings.errors import InputError
from citypv.core.weather.read_weather import read_weather

pytestmark = pytest.mark.every_python

POTSDAM = (52.38, 13.06)


# --- NSRDB


@pytest.mark.slow
def test_nsrdb_of_quarters_of_an_hour():
    with gzip.open(STOCKHOLM, "rt") as file:
        table, place = pvlib.iotools.read_nsrdb_psm4(file, map_variables=True)
    weather = read_weather(STOCKHOLM, *BERLIN)
    assert weather.interval == pd.Timedelta(minutes=15)
    assert (weather.latitude, weather.longitude, weather.altitude) == (59.33, 18.06, 26)
    assert annual_sums(weather) == pytest.approx([814.8, 941.6, 385.0], abs=0.06)
    # The stamps, in UTC+1 here, are the middle of the intervals.
    middle = weather.data.index + weather.interval / 2
    assert (middle == table.index.tz_convert("UTC")).all()
    sun = pvlib.solarposition.get_solarposition(table.index, place["latitude"], place["longitude"])
    np.testing.assert_allclose(weather.data["apparent_zenith"], sun["apparent_zenith"], atol=1e-9)
    assert weather.data["pressure"].between(95e3, 106e3).all()


# --- DWD


@pytest.mark.slow
def test_dwd_station_against_its_own_columns():
    weather = read_weather(POTSDAM_2018, *BERLIN)
    rows = np.array([line.split() for line in lines_of(POTSDAM_2018)[6:]], float)
    assert (weather.latitude, weather.longitude, weather.altitude) == (
        52.47,
        13.4,
        50.0,
    )  # what the head says
    assert weather.data.index[0] == pd.Timestamp("2017-12-31T23:00Z")
    np.testing.assert_allclose(weather.data["ghi"], rows[:, 4] + rows[:, 5], atol=1e-9)
    np.testing.assert_allclose(weather.data["temp_air"], rows[:, 2])
    np.testing.assert_allclose(weather.data["wind_speed"], rows[:, 7])
    np.testing.assert_allclose(weather.data["pressure"], 100.0 * rows[:, 1])
    own = read_weather(POTSDAM_2018, *BERLIN, place=POTSDAM)
    assert (own.latitude, own.longitude) == POTSDAM
    high = own.data["apparent_zenith"].to_numpy() < 85
    zenith = pvlib.solarposition.get_solarposition(own.data.index + HOUR / 2, *POTSDAM)[
        "apparent_zenith"
    ].to_numpy()
    direct = own.data["dni"].to_numpy() * np.cos(np.radians(zenith))
    np.testing.assert_allclose(direct[high], rows[high, 4], atol=1e-6)


def dwd_lines(year, change=lambda lines: lines):
    """The table of 2018 as that of another year."""
    lines = lines_of(POTSDAM_2018)
    return change([line.replace("2018", str(year)) for line in lines[:6]] + lines[6:])


@pytest.mark.slow
def test_dwd_heads_of_several_kinds(tmp_path):
    def swap(lines):
        return ["#13.06\t52.38\t81.0\t1" if line.startswith("# 52,47") else line for line in lines]

    weather = read_weather(write_lines(tmp_path / "a.txt", dwd_lines(2018, swap)), *BERLIN)
    assert (weather.latitude, weather.longitude, weather.altitude) == (52.38, 13.06, 81.0)
    nowhere = [line for line in lines_of(POTSDAM_2018) if not line.startswith("# 52,47")]
    path = write_lines(tmp_path / "b.txt", nowhere)
    refuse(path, "no place in Germany", "--weather-place")
    assert read_weather(path, *BERLIN, place=POTSDAM).latitude == 52.38
    refuse(
        write_lines(tmp_path / "c.txt", [*nowhere[:100], *nowhere[101:]]),
        "row 96",
        "hour 97",
        place=BERLIN,
    )


@pytest.mark.slow
def test_dwd_year_without_its_last_hour(tmp_path):
    short = write_lines(tmp_path / "short.txt", lines_of(POTSDAM_2018)[:-1])
    weather = read_weather(short, *BERLIN)
    assert len(weather.data) == 8760
    assert any("the last 1 h of 2018" in note for note in weather.notes)
    refuse(write_lines(tmp_path / "cut.txt", lines_of(POTSDAM_2018)[:-12]), "full years")


@pytest.mark.slow
def test_several_years_of_dwd_are_put_together(tmp_path):
    files = [write_lines(tmp_path / f"{year}.txt", dwd_lines(year)) for year in (2018, 2017)]
    weather = read_weather(files, *BERLIN)
    assert len(weather.data) == 2 * 8760
    assert weather.data.index.is_monotonic_increasing
    assert list(weather.checks) == ["2017", "2018"]
    assert annual_sums(weather)[0] == pytest.approx(2 * 1209.4, abs=0.1)
    # Twice the same year, and years of two places.
    with pytest.raises(InputError, match="is repeated"):
        read_weather([files[0], files[0]], *BERLIN)
    with pytest.raises(InputError, match="is not that of"):
        read_weather([files[0], BARROW], *BERLIN)


@pytest.mark.slow
def test_test_reference_year(tmp_path):
    rows = np.array([line.split() for line in lines_of(POTSDAM_2018)[6:]], float)
    times = pd.date_range("2021-01-01", periods=8760, freq="h")
    head = ["Koordinatensystem : Lambert konform konisch", "Rechtswert        : 4162500 Meter"]
    head += ["Hochwert          : 2733500 Meter", "Hoehenlage        : 81 Meter ueber NN", ""]
    head += [
        "     RW      HW MM DD HH     t    p  WR   WG N    x  RF    B    D   A    E IL",
        "*** ",
    ]
    body = [
        f"4162500 2733500 {time.month:2d} {time.day:2d} {time.hour + 1:2d} {row[2]} {row[1]:.0f} "
        f"{row[8]:.0f} {row[7]} "
        f"{row[6]:.0f} 3.5 85 {row[4]:.1f} {row[5]:.1f} 291 -281 0"
        for time, row in zip(times, rows, strict=True)
    ]
    weather = read_weather(write_lines(tmp_path / "TRY2015.dat", head + body), *BERLIN)
    # DWD's own file of this cell is called TRY_513564124162: 51.3564° N, 12.4162° E.
    assert (weather.latitude, weather.longitude) == pytest.approx((51.3564, 12.4162), abs=6e-5)
    assert weather.altitude == 81
    assert annual_sums(weather)[0] == pytest.approx(1209.4, abs=0.06)
    assert weather.data.index[0] == pd.Timestamp("2020-12-31T23:00Z")
    refuse(
        write_lines(tmp_path / "gap.dat", [*head, *body[:50], *body[51:]]),
        "row 51",
        "day 3, hour 4",
    )


# --- PVGIS


def hourly_pvgis(slope=0, components=True):
    """Head, names and rows of an hourly series of PVGIS made from ERA5 of Berlin."""
    data = read_weather(ERA5, *BERLIN).data
    stamps = data.index + HOUR / 2
    names = ["Gb(i)", "Gd(i)", "Gr(i)"] if components else ["G(i)"]
    values = (
        [data["ghi"] - data["dhi"], data["dhi"], 0 * data["dhi"]] if components else [data["ghi"]]
    )
    columns = [
        *values,
        90 - data["apparent_zenith"],
        data["temp_air"],
        data["wind_speed"],
        0 * data["ghi"],
    ]
    names = ["time", *names, "H_sun", "T2m", "WS10m", "Int"]
    rows = [
        [time.strftime("%Y%m%d:%H%M"), *(f"{value:.4f}" for value in row)]
        for time, row in zip(stamps, np.stack(columns, axis=1), strict=True)
    ]
    head = [
        "Latitude (decimal degrees):\t52.510",
        "Longitude (decimal degrees):\t13.390",
        "Elevation (m):\t34.0",
    ]
    head += [
        "Radiation database:\tPVGIS-ERA5",
        "",
        "",
        f"Slope: {slope} deg.",
        "Azimuth: 0 deg.",
        "",
    ]
    return head, names, rows


@pytest.mark.slow
def test_hourly_series_of_pvgis(tmp_path):
    head, names, rows = hourly_pvgis()
    path = write_lines(
        tmp_path / "hourly.csv", [*head, ",".join(names), *map(",".join, rows), "", "T2m: air"]
    )
    weather, plain = read_weather(path, 0.0, 0.0), read_weather(ERA5, *BERLIN)
    assert (weather.latitude, weather.longitude, weather.altitude) == (52.51, 13.39, 34.0)
    pd.testing.assert_index_equal(
        weather.data.index, plain.data.index, check_names=False, exact=False
    )
    np.testing.assert_allclose(
        weather.data[["ghi", "dhi", "dni"]], plain.data[["ghi", "dhi", "dni"]], atol=0.01
    )
    # The same as json.
    hourly = [
        {
            name: value if name == "time" else float(value)
            for name, value in zip(names, row, strict=True)
        }
        for row in rows
    ]
    place = {"latitude": 52.51, "longitude": 13.39, "elevation": 34.0}
    mounting = {
        "fixed": {
            "slope": {"value": 0, "optimal": False},
            "azimuth": {"value": 0, "optimal": False},
        }
    }
    inputs = {"location": place, "mounting_system": mounting}
    tree = {"inputs": inputs, "outputs": {"hourly": hourly}, "meta": {"inputs": {}}}
    (tmp_path / "hourly.json").write_text(json.dumps(tree))
    pd.testing.assert_frame_equal(
        read_weather(tmp_path / "hourly.json", 0.0, 0.0).data, weather.data
    )
    mounting["fixed"]["slope"]["value"] = 30
    (tmp_path / "tilted.json").write_text(json.dumps(tree))
    refuse(tmp_path / "tilted.json", "slope of 30")


@pytest.mark.slow
def test_hourly_series_that_cannot_be_used(tmp_path):
    for name, settings, word in (
        ("slope", {"slope": 35}, "slope of 35"),
        ("sum", {"components": False}, "Gb(i)"),
    ):
        head, names, rows = hourly_pvgis(**settings)
        path = write_lines(
            tmp_path / f"{name}.csv", [*head, ",".join(names), *map(",".join, rows), ""]
        )
        refuse(path, word, "hourly data with slope 0")


# -- typical years from PVGIS: a local server that answers as it did, one that refuses, none --

ANSWER = gzip.decompress((DATA / "pvgis_tmy_45.000_8.000_2005_2023.json.gz").read_bytes())
REFUSAL = b'{"message": "Location over the sea. Please, select another location", "status": 400}'


class Server(BaseHTTPRequestHandler):
    asked: ClassVar[list] = []

    def do_GET(self):
        self.asked.append(self.path)
        known = "lat=45" in self.path
        self.send_response(200 if known else 400)
        self.end_headers()
        self.wfile.write(
            {True: ANSWER, False: REFUSAL}[known] if "lat=9" not in self.path else b"<html>"
        )

    def log_message(self, *_):
        pass


@pytest.fixture
def server(monkeypatch):
    with HTTPServer(("127.0.0.1", 0), Server) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        monkeypatch.setattr(
            pvlib.iotools.pvgis, "URL", f"http://127.0.0.1:{server.server_port}/api/"
        )
        Server.asked.clear()
        yield
        server.shutdown()
        thread.join()


@pytest.mark.slow
def test_downloaded_is_as_read_from_a_file(server):
    downloaded, read = read_weather("pvgis", 45.0, 368.0), read_weather(PVGIS, 45.0, 8.0)
    assert Server.asked == ["/api/tmy?lat=45.0&lon=8.0&outputformat=json"]
    assert (downloaded.latitude, downloaded.longitude, downloaded.altitude) == (45.0, 8.0, 250.0)
    assert downloaded.data.index[0] == read.data.index[0]
    np.testing.assert_allclose(downloaded.data["ghi"], read.data["ghi"], atol=0.01)
    assert "PVGIS" in downloaded.label and "downloaded" in downloaded.label


def test_refusal_is_told_in_the_servers_words(server):
    with pytest.raises(InputError, match=r"Location over the sea.*climate") as caught:
        read_weather("pvgis", 0.0, -30.0)
    assert "\n" not in str(caught.value)


def test_an_answer_that_is_no_typical_year(server):
    with pytest.raises(InputError, match="pvgis"):
        read_weather("pvgis", 9.0, 8.0)


def test_without_a_network_it_ends_at_once(tmp_path, monkeypatch, refused):
    # Port 9 of this machine: nobody answers.
    monkeypatch.setattr(pvlib.iotools.pvgis, "URL", "http://127.0.0.1:9/api/")
    city, start = write_small_city(tmp_path / "small.gml"), time.monotonic()
    out = tmp_path / "out"
    said = refused("simulate", city, "--weather", "pvgis", "--out", out, "--quiet")
    assert time.monotonic() - start < 10
    assert "cannot reach http://127.0.0.1:9/api/" in said and "--weather climate" in said
    assert not out.exists()
