"""`citypv accuracy`: its predictions against runs of the same settings, its table, JSON and
picture.
"""

import json
import time
from dataclasses import replace

import numpy as np
import pytest
from small_city import house, write_gml

from citypv.__main__ import main
from citypv.core.accuracy.sun_sampling import compare_hours
from citypv.core.accuracy.yield_errors import split_errors
from citypv.core.run.study import (
    compute_energy,
    measure_sun_sampling,
    prepare_study,
    read_scene,
    read_year,
    trace_scene,
)
from citypv.core.settings.request import Request


def trace_city(city, **settings):
    """A city traced: the errors it states, and processor seconds of tracing."""
    request = Request(weather="clear-sky", threads=1, **settings)
    scene = read_scene([city], request)
    weather = read_year(scene.site, request)
    prepared = prepare_study(scene, weather, request).build_tree(request)
    started = time.process_time()
    transfer = trace_scene(scene, weather, request, prepared=prepared)
    seconds = time.process_time() - started
    sampling = measure_sun_sampling(scene, weather, transfer, request, prepared=prepared)
    transfer = replace(transfer, record=replace(transfer.record, sun_sampling=sampling))
    return split_errors(transfer, weather, compute_energy(transfer, weather, request)), seconds


@pytest.mark.slow
@pytest.mark.thorough
def test_predictions_are_those_of_runs(tmp_path, capfd):
    """Errors within a factor of 1.5, seconds of 2 while other work goes on: of towers amid low
    houses, which differ.
    """
    rows = [
        house(f"h{k}", (25 * (k % 8), 22 * (k // 8)), (12, 10, 8 + 7 * k % 10)) for k in range(64)
    ]
    for k in (27, 28, 35, 36):
        rows[k] = house(f"h{k}", (25 * (k % 8) - 4, 22 * (k // 8) - 4), (22, 19, 50))
    path, picture = write_gml(tmp_path / "city.gml", *rows), tmp_path / "curve.png"
    options = ["--weather", "clear-sky", "--threads", "1", "--json", "--plot", str(picture)]
    assert main(["accuracy", str(path), *options]) == 0
    listed = json.loads(capfd.readouterr().out)
    prices = {one["name"]: one for one in listed["prices"]}
    for name, settings in (
        ("draft", {"samples": 64, "shadow_samples": 4, "suns": "days:12"}),
        ("--samples 1024", {"samples": 1024}),
    ):
        errors, seconds = trace_city(path, **settings)
        assert 1 / 1.5 < prices[name]["error"] / errors.at_share() < 1.5, name
        assert 0.5 < prices[name]["processor"] / seconds < 2, name
        assert prices[name]["seconds"] > listed["fixed"] > 0
    assert prices["draft"]["error"] > prices["standard"]["error"] > prices["reference"]["error"]
    left = [prices[f"--max-bounces {count}"]["bounces_left"] for count in range(6)]
    assert left == sorted(left, reverse=True) and left[-1] > 0
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_city_with_mirrors_has_a_price_list(city, tmp_path, capfd):
    """Its pilot follows mirrors as a run does."""
    finish = tmp_path / "finish.csv"
    finish.write_text("surface,albedo,material\nfacade,0.6,mirror\n")
    options = [
        "--weather",
        "clear-sky",
        "--threads",
        "1",
        "--suns",
        "days:4",
        "--albedo-file",
        str(finish),
        "--json",
    ]
    assert main(["accuracy", str(city), *options]) == 0
    first = json.loads(capfd.readouterr().out)["prices"][0]
    assert first["name"] == "draft" and first["error"] > 0


def test_the_rms_of_drawn_patches_has_the_error_of_a_drawn_rms():
    """Of n normal numbers its standard error is σ / √(2 n); two groups whose means are off by 3 %
    and -4 % of their own hours, one with twice the hours, are so by √((2 · 9 + 16) / 3) %.
    """
    errors = np.random.default_rng(1).normal(0.0, 2.0, 20_000)
    found = compare_hours(100 + errors, np.full(20_000, 100.0), np.ones(20_000), ["a"] * 20_000)
    two = compare_hours(
        np.array([206.0, 96.0]), np.array([200.0, 100.0]), np.ones(2), np.array(["b", "c"])
    )
    assert two["of_groups"] == pytest.approx(np.sqrt(34 / 3))
    assert two["bias"] == pytest.approx(100 * 2 / 300)
    assert found["rms"] == pytest.approx(2.0, rel=0.02)
    assert found["rms_standard_error"] == pytest.approx(2 / np.sqrt(40_000), rel=0.05)
