"""Years asked of services: servers of this machine answer as the services document, or refuse, or wait."""

import io
import json
import threading
import time
import zipfile
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import cache
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import SimpleNamespace
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pandas as pd
import pvlib
import pytest
from small_city import write_small_city
from weathers import BERLIN, ERA5, HOUR

from citypv.core.settings.errors import InputError
from citypv.core.weather import ask_services
from citypv.core.weather.ask_services import address_of, build_question
from citypv.core.weather.read_weather import check_sources, read_weather
from citypv.core.weather.sources import SERVICES, parse_asked

BOTH = ["ghi", "dhi"]
ROUNDED = {"pvgis": 0.006, "nasa-power": 0.006, "era5": 1e-6, "open-meteo": 0.06}  # [Wm⁻²] as each service writes
ASKED = {key: f"{key}:2017" for key in ROUNDED}


@cache
def year():
    """Berlin's 2017, by the start of each hour of that calendar year of UTC."""
    data = read_weather(ERA5, *BERLIN).data[["ghi", "dhi", "dni", "temp_air", "wind_speed"]]
    return pd.concat([data.iloc[1:], data.iloc[-24:-23].set_axis(data.index[-1:] + HOUR)])


def answer_pvgis(data):
    """An hourly series of PVGIS, json: the satellite's moment is the middle of the interval."""
    rows = [
        {"time": f"{time + HOUR / 2:%Y%m%d:%H%M}", "Gb(i)": round(row.ghi - row.dhi, 2), "Gd(i)": round(row.dhi, 2)}
        | {"Gr(i)": 0.0, "H_sun": 0.0, "T2m": row.temp_air, "WS10m": row.wind_speed, "Int": 0.0}
        for time, row in zip(data.index, data.itertuples(), strict=True)
    ]
    place = {"latitude": BERLIN[0], "longitude": BERLIN[1], "elevation": 40.0}
    return {"inputs": {"location": place}, "outputs": {"hourly": rows}, "meta": {"inputs": {}}}


def answer_power(data):
    """NASA POWER's json: stamps begin the hour."""
    columns = {"ALLSKY_SFC_SW_DWN": "ghi", "ALLSKY_SFC_SW_DIFF": "dhi", "ALLSKY_SFC_SW_DNI": "dni"}
    columns |= {"T2M": "temp_air", "WS10M": "wind_speed"}
    stamps = data.index.strftime("%Y%m%d%H")
    values = {name: dict(zip(stamps, data[ours].round(2), strict=True)) for name, ours in columns.items()}
    values["PS"] = dict.fromkeys(stamps, 100.2)
    units = dict.fromkeys(values, "Wh/m^2") | {"T2M": "C", "WS10M": "m/s", "PS": "kPa"}
    header = {"title": "NASA/POWER Source Native Resolution Hourly Data", "fill_value": -999.0, "time_standard": "UTC"}
    about = {name: {"units": unit, "longname": name} for name, unit in units.items()}
    place = {"type": "Point", "coordinates": [BERLIN[1], BERLIN[0], 41.0]}
    return {"geometry": place, "properties": {"parameter": values}, "header": header, "parameters": about, "times": {}}


def answer_open_meteo(data):
    """Open-Meteo's json: radiation ends at the stamp; the hour that ends at 0:00 is of the year before."""
    rolled = data.iloc[[-1, *range(len(data) - 1)]]
    columns = {"shortwave_radiation": "ghi", "diffuse_radiation": "dhi", "direct_normal_irradiance": "dni"}
    columns |= {"temperature_2m": "temp_air", "wind_speed_10m": "wind_speed"}
    hourly = {name: list(rolled[ours].round(1)) for name, ours in columns.items()}
    units = dict.fromkeys(columns, "W/m²") | {"time": "iso8601", "temperature_2m": "°C", "wind_speed_10m": "m/s"}
    head = {"latitude": 52.548, "longitude": 13.4, "elevation": 42.0, "utc_offset_seconds": 0, "timezone": "GMT"}
    return head | {"hourly_units": units, "hourly": {"time": list(data.index.strftime("%Y-%m-%dT%H:%M"))} | hourly}


def answer_era5(data):
    """A zip of the Climate Data Store's csv: sums of the hour that ends at the stamp."""
    rolled = data.iloc[[-1, *range(len(data) - 1)]]
    columns = {"valid_time": data.index.strftime("%Y-%m-%d %H:%M:%S"), "ssrd": 3600 * rolled["ghi"].to_numpy()}
    columns |= {
        "fdir": 3600 * (rolled["ghi"] - rolled["dhi"]).to_numpy(),
        "t2m": rolled["temp_air"].to_numpy() + 273.15,
    }
    columns |= {"u10": 0.6 * rolled["wind_speed"].to_numpy(), "v10": 0.8 * rolled["wind_speed"].to_numpy(), "sp": 1e5}
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        table = pd.DataFrame(columns).assign(latitude=52.5, longitude=13.5)
        archive.writestr("reanalysis.csv", table.to_csv(index=False))
    return packed.getvalue()


ANSWERS = {"seriescalc": answer_pvgis, "power": answer_power, "archive": answer_open_meteo, "file.zip": answer_era5}


class Handler(BaseHTTPRequestHandler):
    """Answers as the services do; `server.change` may change a year, `server.refuse` is (status, body)."""

    def do_GET(self):
        self.answer()

    def do_POST(self):
        self.body = self.rfile.read(int(self.headers["Content-Length"]))
        self.answer()

    def answer(self):
        server, path = self.server, urlsplit(self.path)
        server.asked.append(self.path)
        time.sleep(server.wait)
        base = f"http://127.0.0.1:{server.server_port}"
        status, body = 200, b""
        if server.refuse:
            status, body = server.refuse
        elif path.path.endswith("/execution"):
            server.sent = {"body": json.loads(self.body), "key": self.headers["PRIVATE-TOKEN"]}
            body = {"jobID": "7", "status": "accepted", "metadata": {}}
        elif path.path.endswith("/jobs/7"):
            body = {"status": "successful"}
        elif path.path.endswith("/jobs/7/results"):
            body = {"asset": {"value": {"href": f"{base}/file.zip"}}}
        else:
            body = server.edit(ANSWERS[path.path.rsplit("/", 1)[1]](server.change(year())))
        self.send_response(status)
        self.end_headers()
        self.wfile.write(body if isinstance(body, bytes) else json.dumps(body).encode())

    def log_message(self, *_):
        pass


@pytest.fixture
def server(monkeypatch, tmp_path):
    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        server.asked, server.wait, server.refuse, server.sent = [], 0, None, None
        server.change = server.edit = lambda data: data
        threading.Thread(target=server.serve_forever, daemon=True).start()
        point_at(monkeypatch, tmp_path, f"http://127.0.0.1:{server.server_port}")
        yield server
        server.shutdown()


def point_at(monkeypatch, tmp_path, base):
    """Ask another server instead of each service."""
    monkeypatch.setattr(pvlib.iotools.pvgis, "URL", f"{base}/api/")
    monkeypatch.setattr(pvlib.iotools.nasa_power, "URL", f"{base}/power")
    monkeypatch.setattr(ask_services, "OPEN_METEO_URL", f"{base}/v1/archive")
    (tmp_path / "cdsapirc").write_text(f"url: {base}\nkey: a-key-of-one's-own\n")
    monkeypatch.setenv("CDSAPI_RC", str(tmp_path / "cdsapirc"))
    monkeypatch.delenv("CDSAPI_URL", raising=False)
    monkeypatch.delenv("CDSAPI_KEY", raising=False)


def refuse_asking(text, *words):
    """Asking fails in one line that names the source and the words."""
    with pytest.raises(InputError) as caught:
        read_weather(text, *BERLIN)
    message = str(caught.value)
    assert "\n" not in message and message.startswith(f"--weather {text}: ")
    for word in words:
        assert word in message, message


@pytest.mark.parametrize("key", ASKED)
def test_a_year_of_each_service(server, key):
    weather = read_weather(ASKED[key], *BERLIN, 34.0)
    given, same = weather.data[BOTH], weather.data.index.intersection(year().index)
    assert len(same) >= 8759 and len(weather.data) == 8760
    for name in BOTH:
        np.testing.assert_allclose(given.loc[same, name], year().loc[same, name], atol=2 * ROUNDED[key])
    assert (weather.latitude, weather.longitude) == BERLIN
    assert weather.altitude == {"pvgis": 40, "nasa-power": 41, "open-meteo": 42, "era5": 34}[key]
    assert "2017, downloaded" in weather.label
    # Sunrise and sunset fit: half an hour of error in its stamps would be refused, or told.
    assert abs(weather.checks["2017"]["daylight_shift"]) <= 10


@pytest.mark.parametrize("key", ["pvgis", "nasa-power", "open-meteo"])
def test_the_address_is_what_the_server_was_asked(server, key):
    question = build_question(parse_asked(ASKED[key]), *BERLIN)
    read_weather(ASKED[key], *BERLIN)
    asked, planned = urlsplit(server.asked[0]), urlsplit(address_of(question))
    assert (asked.path, parse_qs(asked.query)) == (planned.path, parse_qs(planned.query))


def test_addresses_ask_for_utc_and_whole_years():
    def ask(text, longitude=13.39):
        return parse_qs(urlsplit(address_of(build_question(parse_asked(text), 52.51, longitude))).query)

    power, open_meteo = ask("nasa-power:2015-2023", 373.39), ask("open-meteo:2019")
    assert (power["start"], power["end"], power["time-standard"]) == (["20150101"], ["20231231"], ["utc"])
    assert power["longitude"] == ["13.39"]
    ends = open_meteo["start_date"] + open_meteo["end_date"]
    assert (ends, open_meteo["timezone"]) == (["2019-01-01", "2019-12-31"], ["GMT"])
    pvgis = ask("pvgis:2005-2023")
    assert (pvgis["startyear"], pvgis["endyear"], pvgis["angle"]) == (["2005"], ["2023"], ["0"])
    assert pvgis["components"] == ["1"]


def test_era5_is_asked_with_the_users_own_key(server, monkeypatch):
    read_weather("era5:2017", *BERLIN)
    assert server.sent["key"] == "a-key-of-one's-own"
    inputs = server.sent["body"]["inputs"]
    assert inputs["date"] == ["2017-01-01/2017-12-31"]
    assert inputs["location"] == {"latitude": BERLIN[0], "longitude": BERLIN[1]}
    assert "total_sky_direct_solar_radiation_at_surface" in inputs["variable"]
    monkeypatch.setenv("CDSAPI_RC", "/nowhere")
    refuse_asking("era5:2017", "needs a key", ".cdsapirc", "pvgis")


@pytest.mark.parametrize(
    ("key", "status", "body", "words"),
    [
        (
            "pvgis",
            400,
            {"message": "endyear: Incorrect value. Please, enter an integer between 2005 and 2023."},
            "2023",
        ),
        ("nasa-power", 422, {"messages": ["Please submit a valid end date."]}, "a valid end date"),
        ("open-meteo", 400, {"error": True, "reason": "Daily API request limit exceeded."}, "limit exceeded"),
        ("era5", 403, {"title": "required licences not accepted"}, "licences not accepted"),
        ("pvgis", 529, b"<html>busy</html>", "529"),
        ("nasa-power", 503, b"<html>busy</html>", "refused"),
        ("open-meteo", 502, b"", "502"),
        ("era5", 500, b"", "refused"),
    ],
)
def test_refusals_are_told_in_the_services_words(server, key, status, body, words):
    server.refuse = status, body
    refuse_asking(ASKED[key], words, "climate")


@pytest.mark.parametrize("key", ASKED)
def test_half_an_answer(server, key):
    server.change = lambda data: data.iloc[:5000]
    refuse_asking(ASKED[key], "sent 5,000 of 8,760 hours", "again later")


def test_answers_with_gaps_and_changed_columns(server):
    server.change = lambda data: data.drop(columns="temp_air").join(data["temp_air"][np.arange(8760) % 1000 != 17])
    refuse_asking("open-meteo:2017", "no values for 9 hours", "other years")

    def rename(tree):
        hourly = tree["hourly"]
        return tree | {"hourly": {name.replace("wind_speed", "breeze"): values for name, values in hourly.items()}}

    server.change, server.edit = lambda data: data, rename
    refuse_asking("open-meteo:2017", "its columns may have changed")
    server.edit = lambda tree: tree | {"outputs": {"hours": tree["outputs"]["hourly"]}}
    refuse_asking("pvgis:2017", "sent no weather", "hourly")
    server.edit = lambda _: b'{"half": '
    for key in ("nasa-power", "open-meteo"):
        refuse_asking(ASKED[key], f"--weather {key}")


@pytest.mark.parametrize("key", ["pvgis", "nasa-power", "open-meteo"])
def test_a_server_that_does_not_answer_in_time(server, monkeypatch, key):
    monkeypatch.setattr(ask_services, "TIMEOUT", (0.2, 0.3))
    server.wait = 1.5
    start = time.monotonic()
    refuse_asking(ASKED[key], "did not answer in time", "again later")
    assert time.monotonic() - start < 1.4


@pytest.mark.parametrize("key", ASKED)
def test_no_network(monkeypatch, tmp_path, key):
    # Port 9 of this machine: nobody answers.
    point_at(monkeypatch, tmp_path, "http://127.0.0.1:9")
    refuse_asking(ASKED[key], "cannot reach http://127.0.0.1:9", "--weather climate")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("nasa-power", "has no typical year"),
        ("nasa-power:", "'' are no years"),
        ("pvgis:20-23", "'20-23' are no years"),
        ("pvgis:2023-2005", "give pvgis:2005-2023"),
        ("nasa-power:1999-2003", "from 2001"),
        (f"era5:{datetime.now(UTC).year}", f"to {datetime.now(UTC).year - 1}"),
        ("open-meteo:1939", "from 1940"),
    ],
)
def test_years_that_cannot_be(text, words):
    with pytest.raises(InputError, match="--weather") as caught:
        check_sources(text)
    assert words in str(caught.value)


def test_answers_are_kept_and_asked_for_again_only_if_missing(server, tmp_path):
    first, second = tmp_path / "a", tmp_path / "b"
    fresh = read_weather("nasa-power:2017", *BERLIN, keep=(first,))
    assert len(server.asked) == 1
    again = read_weather("nasa-power:2017", *BERLIN, keep=(second, first))
    assert len(server.asked) == 1
    np.testing.assert_allclose(again.data, fresh.data, rtol=1e-12)
    assert (again.data.index == fresh.data.index).all()
    assert (again.label, again.altitude, again.columns) == (fresh.label, fresh.altitude, fresh.columns)
    (path,) = second.iterdir()
    text = path.read_text("utf-8")
    for words in ("# source: NASA POWER, http://127", "# licence: public domain", f"# date: {datetime.now(UTC):%Y-}"):
        assert words in text
    assert "time-standard=utc" in text
    # Anyone can use it as a file, of that place.
    plain = read_weather(path, 0.0, 0.0)
    assert (plain.latitude, plain.longitude, plain.altitude) == (*BERLIN, 41.0)
    np.testing.assert_allclose(plain.data["ghi"], fresh.data["ghi"])
    path.unlink()
    read_weather("nasa-power:2017", *BERLIN, keep=(second,))
    assert len(server.asked) == 2


def test_a_run_keeps_them_beside_its_results(server, tmp_path, refused):
    from citypv.core.commands.command_line import main

    city, out = write_small_city(tmp_path / "small.gml"), tmp_path / "out"
    run = ["simulate", str(city), "--weather", "open-meteo:2017", "--preset", "draft", "--out", str(out), "--quiet"]
    assert main(run) == 0
    assert [path.name.split("_")[0] for path in (out / "weather").iterdir()] == ["open-meteo"]
    assert main([*run, "--overwrite"]) == 0
    again = [
        "yield",
        str(out / "transfer.nc"),
        "--weather",
        "open-meteo:2017",
        "--out",
        str(tmp_path / "yield"),
        "--quiet",
    ]
    assert main(again) == 0
    assert len(server.asked) == 1
    assert (tmp_path / "yield" / "weather").is_dir()
    # What fails leaves nothing behind.
    server.refuse = 429, {"error": True, "reason": "Minutely API request limit exceeded."}
    said = refused("simulate", city, "--weather", "open-meteo:2016", "--out", tmp_path / "none", "--quiet")
    assert "limit exceeded" in said and not (tmp_path / "none").exists()


def test_nineteen_years_give_p90(server, tmp_path):
    """P50 and P90 of 2005 to 2023, years of 0.9 to 1.08 times the light of one: against their own quantiles."""
    import citypv

    factors = np.linspace(0.9, 1.08, 19)

    def years(data):
        parts = []
        for number, factor in enumerate(factors):
            times = pd.date_range(
                f"{2005 + number}-01-01", f"{2006 + number}-01-01", freq="h", inclusive="left", tz="UTC"
            )
            rows = np.minimum(np.arange(len(times)), 8759)
            table = data.iloc[rows].set_axis(times)
            parts.append(table.assign(**{name: table[name] * factor for name in ("ghi", "dhi", "dni")}))
        return pd.concat(parts)

    server.change = years
    result = citypv.simulate(write_small_city(tmp_path / "small.gml"), weather="pvgis:2005-2023", preset="draft")
    assert len(server.asked) == 1
    totals = result.summary["totals"]
    # Of 19 years the second lowest is exceeded in nine of ten, the tenth in half: Weibull's plotting position.
    ratio = totals["p90_mwh_per_year"] / totals["p50_mwh_per_year"]
    assert ratio == pytest.approx(factors[1] / factors[9], abs=0.01)


def test_services_say_what_they_have():
    for service in SERVICES:
        assert service.licence and service.words and parse_asked(f"{service.key}:2019").service is service
    assert parse_asked("pvgis").typical and parse_asked("weather.csv") is None
    assert parse_asked("C:2019") is None
    assert SimpleNamespace(**vars(parse_asked("era5:2010-2012"))).last == 2012


@contextmanager
def no_server():
    yield
