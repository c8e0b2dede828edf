"""What the pilot and the effects trace, how costs are fitted, and patches of other sizes counted."""

from dataclasses import replace

import pytest
from small_city import write_small_city

from citypv.core.accuracy.pilot import (
    CityYear,
    PilotRun,
    count_patches,
    fit_costs,
    run_pilot,
    terms_before_suns,
    terms_of_suns,
)
from citypv.core.accuracy.price_list import PricedCity
from citypv.core.light.prepare_scene import build_tree, prepare_scene
from citypv.core.settings.request import Request
from citypv.core.study import read_scene, read_year, trace_scene


@pytest.fixture(scope="module")
def city(tmp_path_factory):
    """Three houses: CityYear."""
    request = Request(weather="clear-sky", threads=1)
    scene = read_scene([write_small_city(tmp_path_factory.mktemp("city") / "small.gml")], request)
    weather = read_year(scene.site, request)
    prepared = build_tree(prepare_scene(scene, request, weather=weather), request)
    return CityYear(scene, prepared, weather, request)


@pytest.fixture(scope="module")
def pilot(city):
    return run_pilot(city)


def test_patches_are_those_that_a_run_with_more_rays_traces(city, pilot):
    rays = trace_scene(city.scene, city.weather, replace(city.request, samples=1024, suns="days:2")).record
    counts = count_patches(city.prepared.patches, city.prepared.plan, rays.hemisphere_rays, 1024)
    assert pilot.run.counts == pytest.approx(counts, rel=0.1)
    assert len(pilot.errors.rows) == city.scene.surfaces.eligible.sum()


def test_seconds_are_scaled_to_those_of_the_whole_city(pilot):
    """To the last one for its own settings; more rays, points, suns and reflections take longer."""
    own = replace(pilot.run, seconds=())
    processor = sum(pilot.run.seconds)
    assert pilot.predict_seconds(own) == pytest.approx((processor * pilot.run.pace, processor))
    changes = ({"samples": 4096}, {"shadow_samples": 256}, {"suns": 4 * own.suns})
    slow = replace(pilot, run=replace(pilot.run, pace=7.0))  # beside other work
    assert slow.predict_seconds(own) == pytest.approx((7 * processor, processor))
    assert all(pilot.predict_seconds(replace(own, **one)) > pilot.predict_seconds(own) for one in changes)


@pytest.mark.parametrize("size", [5.0, 2.5, 20.0])
def test_finer_patches_are_counted_before_they_are_made(size, city, pilot):
    """Of surfaces within a third; where edges just fit, each is cut into four."""
    ways = city.request.suns, 0.0, 0.0, city.request.patch_size
    priced = PricedCity(pilot, dict.fromkeys(ways[:1], ()), {}, *ways[1:], city.prepared)
    found = priced.pieces(replace(priced.knobs_of(city.request, ways[0]), patch_size=size))
    own = city.prepared.scene.triangle_surface >= 0
    path = city.scene.report.files[0]
    scene = prepare_scene(read_scene([path], replace(city.request, patch_size=size)), city.request).scene
    assert found[own].sum() == pytest.approx((scene.triangle_surface >= 0).sum(), rel=1 / 3)


def test_costs_are_found_from_runs_that_follow_the_formula():
    """Also those of a run of other patches, rays, points, reflections and suns, on a machine that is slower by 1.7."""
    runs = [
        PilotRun(*setting, 144, counts)
        for setting, counts in (((64, 4, 1), (600, 150)), ((64, 64, 3), (600, 150)), ((1024, 16, 3), (600, 160)))
    ]
    whole = PilotRun(32, 16, 3, 48, (30_000, 12_000))
    other = PilotRun(1024, 64, 5, 600, (8000, 2000))
    for terms, costs in ((terms_before_suns, [1e-5, 3e-7]), (terms_of_suns, [3e-8, 1e-8, 2e-10])):
        told = [terms(run) for run in runs], [terms(run) @ costs for run in runs]
        found = fit_costs(*told, terms(whole), 1.7 * (terms(whole) @ costs))
        assert terms(other) @ found == pytest.approx(1.7 * (terms(other) @ costs), rel=1e-6)
