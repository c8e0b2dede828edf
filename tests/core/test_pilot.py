"""What the pilot traces, how its seconds are scaled, and patches of other sizes counted."""

from dataclasses import replace

import pytest
from small_city import write_small_city

from citypv.core.accuracy.cost_curve import PredictedCity
from citypv.core.accuracy.pilot import count_patches, run_pilot
from citypv.core.accuracy.sun_sampling import CityYear
from citypv.core.light.prepare_scene import prepare_scene
from citypv.core.run.study import read_scene, read_year, trace_scene
from citypv.core.settings.request import Request


@pytest.fixture(scope="module")
def city(tmp_path_factory):
    """Three houses: CityYear."""
    request = Request(weather="clear-sky", threads=1)
    scene = read_scene([write_small_city(tmp_path_factory.mktemp("city") / "small.gml")], request)
    weather = read_year(scene.site, request)
    prepared = prepare_scene(scene, request, weather=weather).build_tree(request)
    return CityYear(scene, prepared, weather, request)


@pytest.fixture(scope="module")
def pilot(city):
    return run_pilot(city)


@pytest.mark.slow
def test_patches_are_those_that_a_run_with_more_rays_traces(city, pilot):
    rays = trace_scene(
        city.scene, city.weather, replace(city.request, samples=1024, suns="days:2")
    ).record
    counts = count_patches(city.prepared.patches, city.prepared.plan, rays.hemisphere_rays, 1024)
    assert pilot.run.counts == pytest.approx(counts, rel=0.1)
    assert len(pilot.errors.rows) == city.scene.surfaces.eligible.sum()


def test_seconds_follow_the_formula(pilot):
    """Those of the run for its own settings; its suns take as much longer as there are more,
    patches of both parts.
    """
    own, (before, suns) = pilot.run, pilot.run.seconds
    assert own.predict_seconds(replace(own, seconds=())) == pytest.approx(before + suns)
    assert own.predict_seconds(replace(own, suns=3 * own.suns)) == pytest.approx(before + 3 * suns)
    many = replace(own, counts=tuple(1e6 * count for count in own.counts))
    assert own.predict_seconds(many) == pytest.approx(1e6 * (before + suns), rel=0.01)
    changes = ({"samples": 4096}, {"shadow_samples": 256}, {"bounces": 1 + own.bounces})
    assert all(own.predict_seconds(replace(own, **one)) > before + suns for one in changes)


@pytest.mark.parametrize("size", [5.0, 2.5, 20.0])
def test_finer_patches_are_counted_before_they_are_made(size, city, pilot):
    """Of surfaces and of the ground within a third; where edges just fit, each is cut into four."""
    ways = city.request.suns, 0.0, city.request.patch_size
    priced = PredictedCity(pilot, dict.fromkeys(ways[:1], ()), {}, *ways[1:], city.prepared)
    found = priced.pieces(size)
    own = city.prepared.scene.triangle_surface >= 0
    path = city.scene.report.files[0]
    scene = prepare_scene(
        read_scene([path], replace(city.request, patch_size=size)), city.request
    ).scene
    assert found[own].sum() == pytest.approx((scene.triangle_surface >= 0).sum(), rel=1 / 3)
    assert found[~own].sum() == pytest.approx((scene.triangle_surface < 0).sum(), rel=1 / 3)
