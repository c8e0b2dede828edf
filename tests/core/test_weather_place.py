"""One place for the sun: distances, other longitudes, and what the command line says of the
weather.
"""

import json
import re

import numpy as np
import pytest
from test_tracing import three_houses
from weathers import BARROW, BERLIN, ERA5, TMY3

from citypv.__main__ import main
from citypv.core.run import study
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request
from citypv.core.sun.solar_position import sun_direction
from citypv.core.sun.sun_sampling import match_suns
from citypv.core.weather.read_weather import read_weather


def near_berlin(folder, longitude):
    """The weather of Berlin at another longitude, where the sun comes earlier: csv."""
    weather = read_weather(ERA5, *BERLIN).data
    path = folder / f"{longitude}.csv"
    turned = weather.set_axis(
        weather.index - np.timedelta64(round((longitude - BERLIN[1]) * 240), "s"), axis=0
    )
    turned[["ghi", "dhi", "temp_air", "wind_speed"]].rename_axis("time").to_csv(path)
    return path


@pytest.mark.slow
def test_distance_is_that_of_the_ellipsoid():
    weather = read_weather(TMY3, *BERLIN)
    site = three_houses().site
    # One degree of latitude at 52.5° N is 111.27 km (WGS 84).
    weather.latitude, weather.longitude = site.latitude + 1.0, site.longitude
    assert weather.distance_to(site) == pytest.approx(111.27, abs=0.03)
    weather.check_distance(site)
    weather.latitude = site.latitude + 1.5
    with pytest.raises(InputError, match=r"167 km.*--allow-distance 170"):
        weather.check_distance(site)
    weather.check_distance(site, 170.0)


@pytest.mark.parametrize("degrees", [1.4, 1.9, -3.3, 20.0, -70.0])
def test_the_distance_that_a_refusal_names_is_enough_and_ten_less_is_not(degrees):
    weather = read_weather(TMY3, *BERLIN)
    site = three_houses().site
    weather.latitude, weather.longitude = site.latitude + degrees, site.longitude
    with pytest.raises(InputError) as refusal:
        weather.check_distance(site)
    allowed = float(re.search(r"--allow-distance (\d+)", refusal.value.cure)[1])
    weather.check_distance(site, allowed)
    with pytest.raises(InputError):
        weather.check_distance(site, allowed - 10)


@pytest.mark.slow
def test_suns_are_those_of_the_weathers_place():
    scene = three_houses()
    request = Request(
        weather=str(BARROW), allow_distance=1e4, suns="hourly", samples=4, shadow_samples=1
    )
    weather = study.read_year(scene.site, request)
    transfer = study.trace_scene(scene, weather, request)
    data = weather.data
    match = match_suns(
        transfer.suns, data.index, weather.interval, weather.latitude, weather.longitude
    )
    sunny = match.weight[:, 0] > 0
    own = sun_direction(data["apparent_zenith"][sunny], data["solar_azimuth"][sunny])
    np.testing.assert_allclose(transfer.suns.direction[match.index[sunny, 0]], own, atol=1e-9)


@pytest.fixture(scope="module")
def traced(city, tmp_path_factory):
    folder = tmp_path_factory.mktemp("traced")
    common = ["simulate", str(city), "--weather", str(ERA5), "--quiet", "--samples", "16"]
    for name, suns in (("days", "typical-days:4"), ("grid", "sky-grid:64")):
        assert main([*common, "--suns", suns, "--out", str(folder / name)]) == 0
    return folder


def hours(folder):
    """Full load hours of all eligible surfaces, area-weighted [h]."""
    totals = json.loads((folder / "summary.json").read_text())["totals"]
    return totals["mwh_per_year"] / totals["kwp"] * 1000


@pytest.mark.slow
def test_yield_takes_any_longitude_of_the_latitude(traced, tmp_path, refused):
    path = near_berlin(tmp_path, 100.0)
    again = ["yield", str(traced / "days" / "transfer.nc"), "--quiet"]
    place = ["--weather-place", str(BERLIN[0]), "100"]
    assert main([*again, "--weather", str(path), *place, "--out", str(tmp_path / "east")]) == 0
    # The same weather under the same sun, 5.8 hours earlier.
    assert hours(tmp_path / "east") == pytest.approx(hours(traced / "days"), rel=0.01)
    said = refused(*again, "--weather", TMY3, "--out", tmp_path / "south")
    assert "latitude 52.5" in said and "sky-grid" in said
    assert (
        main(
            [
                *again,
                "--weather",
                str(TMY3),
                "--allow-distance",
                "1400",
                "--out",
                str(tmp_path / "south"),
            ]
        )
        == 0
    )


@pytest.mark.slow
def test_yield_takes_any_place_with_a_sky_grid(traced, tmp_path):
    again = ["yield", str(traced / "grid" / "transfer.nc"), "--quiet", "--weather", str(TMY3)]
    assert main([*again, "--out", str(tmp_path / "york")]) == 0
    weather = json.loads((tmp_path / "york" / "summary.json").read_text())["weather"]
    assert weather["latitude"] == 40.65
    assert weather["distance_km"] == pytest.approx(6386, rel=0.01)


@pytest.mark.slow
def test_what_was_found_out_is_said_and_kept(city, tmp_path, capfd):
    options = ["--weather", str(ERA5), "--samples", "4", "--suns", "typical-days:2"]
    assert main(["simulate", str(city), *options, "--out", str(tmp_path / "said")]) == 0
    assert "clear days fit the sun best" in capfd.readouterr().err
    weather = json.loads((tmp_path / "said" / "summary.json").read_text())["weather"]
    assert abs(weather["checks"]["2017"]["daylight_shift"]) <= 5
    assert weather["checks"]["2017"]["closure_residual"] is None
    assert any("clear days" in note for note in weather["notes"])
