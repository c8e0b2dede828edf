"""`citypv accuracy`: its predictions against runs of the same settings, its table, JSON and picture."""

import json
from dataclasses import replace

import numpy as np
import pytest
from small_city import write_small_city

from citypv.__main__ import main
from citypv.core.accuracy.pilot import fit_costs, terms_of_suns
from citypv.core.accuracy.survey import Survey, Work, work_of_city
from citypv.core.accuracy.yield_errors import split_errors
from citypv.core.settings.request import Request
from citypv.core.study import compute_energy, measure_sun_sampling, read_scene, read_year, trace_scene

pytestmark = pytest.mark.once


@pytest.fixture(scope="module")
def city(tmp_path_factory):
    return write_small_city(tmp_path_factory.mktemp("city") / "small.gml")


def error_of(city, **settings):
    """Error [%] on 95 % of the area as a run states it."""
    request = Request(weather="clear-sky", threads=1, **settings)
    scene = read_scene([city], request)
    weather = read_year(scene.site, request)
    transfer = trace_scene(scene, weather, request)
    sampling = measure_sun_sampling(scene, weather, transfer, request)
    transfer = replace(transfer, record=replace(transfer.record, sun_sampling=sampling))
    return split_errors(transfer, weather, compute_energy(transfer, weather, request)).at_share()


def test_predicted_errors_are_those_of_runs(city, tmp_path, capfd):
    """Of 18 surfaces, so that a factor of 2 is asked; on Berlin it is 1.25 (docs/accuracy.md)."""
    picture = tmp_path / "curve.png"
    options = ["--weather", "clear-sky", "--threads", "1", "--json", "--plot", str(picture)]
    assert main(["accuracy", str(city), *options]) == 0
    listed = json.loads(capfd.readouterr().out)
    prices = {one["name"]: one for one in listed["prices"]}
    for name, settings in (
        ("draft", {"samples": 64, "shadow_samples": 4, "suns": "days:12"}),
        ("standard", {}),
        ("--shadow-samples 64", {"shadow_samples": 64}),
    ):
        assert 0.5 < prices[name]["error"] / error_of(city, **settings) < 2, name
    assert prices["draft"]["error"] > prices["standard"]["error"] > prices["reference"]["error"]
    assert prices["--max-bounces 0"]["bounces_left"] > prices["--max-bounces 1"]["bounces_left"] > 0
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_costs_are_found_from_runs_that_follow_the_formula():
    settings = [(256, 16, 3), (64, 16, 3), (64, 4, 1)]
    works = [Work(patches=1, rays=rays, points=points, entries=rays**0.8) for rays, points, _ in settings]
    terms = [terms_of_suns(work, bounces, 294) for work, (*_, bounces) in zip(works, settings, strict=True)]
    costs = [2e-3, 1e-5, 3e-7]
    seconds = [sum(a * b for a, b in zip(row, costs, strict=True)) for row in terms]
    assert fit_costs(np.array(terms, float), np.array(seconds)) == pytest.approx(costs, rel=1e-6)


def test_work_is_counted_as_it_is_traced():
    """30 patches send all rays; 20 others and the ground that is met a quarter, and no fewer than 64."""
    grows = {"rays": np.array([64, 256, 1024]), "entries": np.array([40.0, 80.0, 160.0])}  # by the root of the rays
    survey = Survey(full=30, others=20, ground=100, shots=np.array([100, 1000]), met=np.array([20, 40]), **grows)
    work = work_of_city(survey, 256, 16)
    met = 40 + 20 * np.log10((30 * 256 + 20 * 64) / 1000)
    assert work.patches == pytest.approx(50 + met)
    assert work.rays == pytest.approx(30 * 256 + (20 + met) * 64)
    assert work.points == pytest.approx(30 * 16 + (20 + met) * 4)
    assert work.entries == pytest.approx(30 * 80 + (20 + met) * 40)
    assert work_of_city(survey, 10**9, 16).patches == 150  # never more ground than there is


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
