"""Targets out of reach are told before the run, with options that reach them."""

import re
from dataclasses import replace

import numpy as np
import pytest

from citypv.__main__ import main
from citypv.core.accuracy.check_reachable import check_reachable, find_cure
from citypv.core.accuracy.pilot import CityYear
from citypv.core.accuracy.sun_sampling import compare_hours
from citypv.core.accuracy.yield_errors import SAMPLED, YieldErrors, split_errors
from citypv.core.light.prepare_scene import build_tree
from citypv.core.settings.request import Request
from citypv.core.study import compute_energy, measure_sun_sampling, prepare_study, read_scene, read_year, trace_scene

CITY = ["--weather", "clear-sky", "--threads", "1"]


def foretold(city, **settings):
    """What is said before a run; and what the run itself finds to stay whatever the number of rays [%]."""
    request = Request(weather="clear-sky", threads=1, **settings)
    scene = read_scene([city], request)
    weather = read_year(scene.site, request)
    prepared = build_tree(prepare_study(scene, weather, request), request)
    told = check_reachable(CityYear(scene, prepared, weather, request))
    transfer = trace_scene(scene, weather, request, prepared=prepared)
    sampling = measure_sun_sampling(scene, weather, transfer, request, prepared=prepared)
    transfer = replace(transfer, record=replace(transfer.record, sun_sampling=sampling))
    errors = split_errors(transfer, weather, compute_energy(transfer, weather, request))
    return told, errors.at_share(without=SAMPLED)


@pytest.mark.once
def test_the_pilot_foretells_what_a_run_finds_and_the_option_that_helps(city):
    told, left = foretold(city, suns="days:4", samples=1024, target_error=0.3)
    assert left > 0.3
    stated = float(re.search(r"the choice of suns alone leaves ([\d.]+) ±", told)[1])
    assert stated == pytest.approx(left, rel=0.1)
    suns, size = re.search(r"give --suns (\S+)(?: --patch-size (\S+))?$", told).groups()
    told, left = foretold(city, suns=suns, patch_size=float(size or 10), samples=1024, target_error=0.3)
    assert told == ""
    assert left < 0.3


@pytest.mark.once
def test_it_is_said_before_the_first_suns_are_traced(city, tmp_path, capfd):
    options = ["--suns", "days:4", "--samples", "64", "--shadow-samples", "4", "--target-error", "0.1"]
    assert main(["simulate", str(city), "--out", str(tmp_path / "a"), *CITY, *options]) == 0
    told = capfd.readouterr().err
    assert told.count("0.1 % cannot be reached") == 1
    assert told.index("0.1 % cannot be reached") < told.index("sky and reflections")
    assert "can hardly be reached" not in told


def made(suns, discretisation):
    """Surfaces of 100 h with errors in percent."""
    parts = {"suns": suns, "discretisation": discretisation, "rays": 9.0}
    variance = {name: np.full(4, error**2) for name, error in parts.items()}
    return YieldErrors(variance, np.full(4, 100.0), np.ones(4), 1)


def test_the_cure_is_the_cheapest_that_suffices():
    """More suns before finer patches, whose error falls with their length: √(0.5² + (2/4)²) < 0.8 < √(0.5² + 1²)."""
    request = Request(suns="days:12", target_error=0.8)
    few, many = made(1.0, 0.1), made(0.5, 0.1)
    assert find_cure({"days:12": few, "days:52": many}, request) == "give --suns days:52"
    few, many = made(1.0, 2.0), made(0.5, 2.0)
    assert find_cure({"days:12": few, "days:52": many}, request) == "give --suns days:52 --patch-size 2.5"
    few = made(0.1, 1.0)
    assert find_cure({"days:12": few, "days:52": many}, request) == "give --patch-size 5"
    worst = made(0.0, 8.0)
    assert find_cure({"hourly": worst}, replace(request, suns="hourly")).startswith(
        "even --suns hourly --patch-size 1.25"
    )


def test_the_rms_of_drawn_patches_has_the_error_of_a_drawn_rms():
    """Of n normal numbers its standard error is σ / √(2 n)."""
    errors = np.random.default_rng(1).normal(0.0, 2.0, 20_000)
    found = compare_hours(100 + errors, np.full(20_000, 100.0), np.ones(20_000))
    assert found["rms"] == pytest.approx(2.0, rel=0.02)
    assert found["rms_standard_error"] == pytest.approx(2 / np.sqrt(40_000), rel=0.05)
