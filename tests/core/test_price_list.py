"""`citypv accuracy`: its predictions against runs of the same settings, its table, JSON and picture."""

import json
import time
from dataclasses import replace

import pytest
from small_city import HEAD, house

from citypv.__main__ import main
from citypv.core.accuracy.yield_errors import split_errors
from citypv.core.light.prepare_scene import build_tree, prepare_scene
from citypv.core.settings.request import Request
from citypv.core.study import compute_energy, measure_sun_sampling, read_scene, read_year, trace_scene

pytestmark = pytest.mark.once


def measure(city, **settings):
    """Error [%] on 95 % of the area as a run states it, and processor seconds of tracing."""
    request = Request(weather="clear-sky", threads=1, **settings)
    scene = read_scene([city], request)
    weather = read_year(scene.site, request)
    prepared = build_tree(prepare_scene(scene, request, weather=weather), request)
    started = time.process_time()
    transfer = trace_scene(scene, weather, request, prepared=prepared)
    seconds = time.process_time() - started
    sampling = measure_sun_sampling(scene, weather, transfer, request, prepared=prepared)
    transfer = replace(transfer, record=replace(transfer.record, sun_sampling=sampling))
    return split_errors(transfer, weather, compute_energy(transfer, weather, request)).at_share(), seconds


def test_predictions_are_those_of_runs(tmp_path, capfd):
    """Of 64 houses, from a quarter of them: errors within a factor of 1.5; seconds of 2 while other work goes on."""
    rows = [house(f"h{k}", (25 * (k % 8), 22 * (k // 8)), (12, 10, 8 + 7 * k % 10)) for k in range(64)]
    path, picture = tmp_path / "city.gml", tmp_path / "curve.png"
    path.write_text(f"{HEAD}{''.join(rows)}</CityModel>\n", encoding="utf-8")
    options = ["--weather", "clear-sky", "--threads", "1", "--json", "--plot", str(picture)]
    assert main(["accuracy", str(path), *options]) == 0
    listed = json.loads(capfd.readouterr().out)
    prices = {one["name"]: one for one in listed["prices"]}
    for name, settings in (
        ("draft", {"samples": 64, "shadow_samples": 4, "suns": "days:12"}),
        ("standard", {}),
        ("--samples 1024", {"samples": 1024}),
    ):
        error, seconds = measure(path, **settings)
        assert 1 / 1.5 < prices[name]["error"] / error < 1.5, name
        assert 0.5 < prices[name]["processor"] / seconds < 2, name
        assert prices[name]["seconds"] > listed["fixed"] > 0
    assert prices["draft"]["error"] > prices["standard"]["error"] > prices["reference"]["error"]
    left = [prices[f"--max-bounces {count}"]["bounces_left"] for count in range(6)]
    assert left == sorted(left, reverse=True) and left[-1] > 0
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_picture_of_no_known_kind_is_refused(city, capfd):
    assert main(["accuracy", str(city), "--plot", "curve.txt"]) == 2
    assert "--plot" in capfd.readouterr().err


def test_a_city_with_mirrors_has_a_price_list(city, tmp_path, capfd):
    """Its pilot follows mirrors as a run does."""
    finish = tmp_path / "finish.csv"
    finish.write_text("surface,albedo,material\nfacade,0.6,mirror\n")
    options = ["--weather", "clear-sky", "--threads", "1", "--suns", "days:4", "--albedo-file", str(finish), "--json"]
    assert main(["accuracy", str(city), *options]) == 0
    first = json.loads(capfd.readouterr().out)["prices"][0]
    assert first["name"] == "draft" and first["error"] > 0
