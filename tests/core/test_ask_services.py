"""Years asked of services: servers of this machine answer as the services document, or refuse, or
wait.
"""

import time
from datetime import UTC, datetime
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pandas as pd
import pytest
from small_city import write_small_city
from weather_servers import ASKED, BOTH, ROUNDED, open_server, point_at, year
from weathers import BERLIN

from citypv.core.settings.errors import InputError
from citypv.core.weather import ask_services
from citypv.core.weather.ask_services import address_of, build_question
from citypv.core.weather.read_weather import check_sources, read_weather
from citypv.core.weather.sources import SERVICES, parse_asked


@pytest.fixture
def server(monkeypatch, tmp_path):
    """All services are this one."""
    with open_server() as server:
        point_at(monkeypatch, tmp_path, f"http://127.0.0.1:{server.server_port}")
        yield server


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
        np.testing.assert_allclose(
            given.loc[same, name], year().loc[same, name], atol=2 * ROUNDED[key]
        )
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
        return parse_qs(
            urlsplit(address_of(build_question(parse_asked(text), 52.51, longitude))).query
        )

    power, open_meteo = ask("nasa-power:2015-2023", 373.39), ask("open-meteo:2019")
    assert (power["start"], power["end"], power["time-standard"]) == (
        ["20150101"],
        ["20231231"],
        ["utc"],
    )
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
            {
                "message": (
                    "endyear: Incorrect value. Please, enter an integer between 2005 and 2023."
                )
            },
            "2023",
        ),
        ("nasa-power", 422, {"messages": ["Please submit a valid end date."]}, "a valid end date"),
        (
            "open-meteo",
            400,
            {"error": True, "reason": "Daily API request limit exceeded."},
            "limit exceeded",
        ),
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
    server.change = lambda data: data.drop(columns="temp_air").join(
        data["temp_air"][np.arange(8760) % 1000 != 17]
    )
    refuse_asking("open-meteo:2017", "no values for 9 hours", "other years")

    def rename(tree):
        hourly = tree["hourly"]
        return tree | {
            "hourly": {
                name.replace("wind_speed", "breeze"): values for name, values in hourly.items()
            }
        }

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


@pytest.mark.slow
def test_answers_are_kept_and_asked_for_again_only_if_missing(server, tmp_path):
    first, second = tmp_path / "a", tmp_path / "b"
    fresh = read_weather("nasa-power:2017", *BERLIN, keep=(first,))
    assert len(server.asked) == 1
    again = read_weather("nasa-power:2017", *BERLIN, keep=(second, first))
    assert len(server.asked) == 1
    np.testing.assert_allclose(again.data, fresh.data, rtol=1e-12)
    assert (again.data.index == fresh.data.index).all()
    assert (again.label, again.altitude, again.columns) == (
        fresh.label,
        fresh.altitude,
        fresh.columns,
    )
    (path,) = second.iterdir()
    text = path.read_text("utf-8")
    for words in (
        "# source: NASA POWER, http://127",
        "# licence: public domain",
        f"# date: {datetime.now(UTC):%Y-}",
    ):
        assert words in text
    assert "time-standard=utc" in text
    # Anyone can use it as a file, of that place.
    plain = read_weather(path, 0.0, 0.0)
    assert (plain.latitude, plain.longitude, plain.altitude) == (*BERLIN, 41.0)
    np.testing.assert_allclose(plain.data["ghi"], fresh.data["ghi"])
    path.unlink()
    read_weather("nasa-power:2017", *BERLIN, keep=(second,))
    assert len(server.asked) == 2


@pytest.mark.slow
def test_a_run_keeps_them_beside_its_results(server, tmp_path, refused):
    from citypv.core.commands.command_line import main

    city, out = write_small_city(tmp_path / "small.gml"), tmp_path / "out"
    run = [
        "simulate",
        str(city),
        "--weather",
        "open-meteo:2017",
        "--preset",
        "draft",
        "--out",
        str(out),
        "--quiet",
    ]
    assert main(run) == 0
    assert [path.name.split("_")[0] for path in (out / "asked_weather").iterdir()] == ["open-meteo"]
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
    assert (tmp_path / "yield" / "asked_weather").is_dir()
    # What fails leaves nothing behind.
    server.refuse = 429, {"error": True, "reason": "Minutely API request limit exceeded."}
    said = refused(
        "simulate", city, "--weather", "open-meteo:2016", "--out", tmp_path / "none", "--quiet"
    )
    assert "limit exceeded" in said and not (tmp_path / "none").exists()


@pytest.mark.slow
def test_nine_years_give_p90(server, tmp_path):
    """P50 and P90 of 2015 to 2023, years of 0.9 to 1.08 times the light of one: against their own
    quantiles.
    """
    import citypv

    factors = np.linspace(0.9, 1.08, 9)

    def years(data):
        parts = []
        for number, factor in enumerate(factors):
            times = pd.date_range(
                f"{2015 + number}-01-01",
                f"{2016 + number}-01-01",
                freq="h",
                inclusive="left",
                tz="UTC",
            )
            rows = np.minimum(np.arange(len(times)), 8759)
            table = data.iloc[rows].set_axis(times)
            parts.append(
                table.assign(**{name: table[name] * factor for name in ("ghi", "dhi", "dni")})
            )
        return pd.concat(parts)

    server.change = years
    result = citypv.simulate(
        write_small_city(tmp_path / "small.gml"), weather="pvgis:2015-2023", preset="draft"
    )
    assert len(server.asked) == 1
    totals = result.summary["totals"]
    # Of nine years the lowest is exceeded in nine of ten, the fifth in half: Weibull's plotting
    # position.
    ratio = totals["p90_mwh_per_year"] / totals["p50_mwh_per_year"]
    assert ratio == pytest.approx(factors[0] / factors[4], abs=0.01)


def test_services_say_what_they_have():
    for service in SERVICES:
        assert (
            service.licence
            and service.words
            and parse_asked(f"{service.key}:2019").service is service
        )
    assert parse_asked("pvgis").typical and parse_asked("weather.csv") is None
    assert parse_asked("C:2019") is None
    assert (parse_asked("era5:2010-2012").first, parse_asked("era5:2010-2012").last) == (2010, 2012)


def test_horizon_of_the_place(server):
    from citypv.core.sky.read_horizon import ask_horizon

    profile = [
        {"A": azimuth, "H_hor": 10.0 if azimuth == -90 else 1.0} for azimuth in range(-180, 181, 45)
    ]
    server.edit, server.horizon = (
        lambda tree: tree,
        {"outputs": {"horizon_profile": profile}, "meta": {}},
    )
    horizon = ask_horizon(47.0, 371.0)
    assert "lat=47.0&lon=11.0" in server.asked[0]
    # A = -90 is east; 0.25° apart from north on.
    assert (
        horizon.elevation[4 * 90] == 10
        and horizon.elevation[4 * 270] == 1
        and horizon.elevation[0] == 1
    )
    server.refuse = 400, {"message": "Location over the sea. Please, select another location"}
    with pytest.raises(
        InputError, match=r"--horizon pvgis: .*over the sea.*; give a file"
    ) as caught:
        ask_horizon(0.0, -30.0)
    assert "\n" not in str(caught.value)
