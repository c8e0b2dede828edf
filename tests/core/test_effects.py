"""The plan of effects, the number of reflections and effects of the modules, against closed forms,
runs and pvlib.
"""

from dataclasses import replace

import numpy as np
import pytest
from planes import DC, light_on_plane, run_chain
from radiosity import bowl
from scenes import run_gather, scene_of_triangles, strip, suns_towards
from small_city import house, write_gml, write_small_city
from test_tracing import SUNS, three_houses
from thorough import mark_cases
from transfers import unshaded_transfer

from citypv.core.accuracy.measure_effects import shares_of_effects, state_shares
from citypv.core.effects.beyond_scene import measure_reach, shade_at_edge
from citypv.core.effects.rays import LIMITS, count_surely
from citypv.core.energy import compute_energy as energy_under_test
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.pv_system import build_system
from citypv.core.light.prepare_scene import prepare_scene
from citypv.core.light.trace_gather import trace_gather
from citypv.core.run.study import prepare_study, read_scene, read_year, trace_scene
from citypv.core.settings.errors import InputError
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request
from citypv.core.sun.sun_sampling import choose_suns

TILT, AZIMUTH = [90, 90, 90, 30, 0], [180, 90, 0, 180, 0]
WALL = strip([0, 0, 0], [8, 0, 0], [0, 0, 8], 1)


def test_nothing_to_reflect_needs_one_reflection():
    """A wall alone: the far ground reflects onto it once, and no ray is traced."""
    transfer = run_gather(scene_of_triangles(*WALL), SUNS, max_bounces=None)
    assert transfer.record.max_bounces == 1
    assert transfer.record.hemisphere_rays == transfer.record.shadow_rays == 0
    assert transfer.record.effects[2]["bound"] == 0
    edge = next(effect for effect in transfer.record.effects if effect["key"] == "far-ground")
    assert edge["bound"] is None  # without a year nothing tells of it
    assert transfer.diffuse_relative == pytest.approx(0.5 + 0.25 / 2, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("azimuth", "turned"), mark_cases([(180, 1), (0, -1)], law=(0,)))
def test_a_dark_far_ground_costs_a_wall_what_pvlib_says(azimuth, turned):
    """An unshaded wall under a clear sky: the bound is its reflected light over all of
    its light.
    """
    vertices, triangles = WALL
    scene = scene_of_triangles(vertices, np.array(triangles)[:, ::turned])
    request = Request(
        sky="isotropic", weather="clear-sky", suns="days:2", far_ground=False, threads=1
    )
    weather = read_year(scene.site, request)
    plan, data = prepare_study(scene, weather, request).plan, weather.data
    direct, sky, ground, _ = (light.sum() for light in light_on_plane(data, 90, azimuth))
    assert not plan["far-ground"].on
    assert plan["far-ground"].bound == pytest.approx(ground / (direct + sky + ground), rel=1e-3)


@pytest.mark.slow
def test_a_dark_far_ground_costs_houses_less_than_its_bound(tmp_path):
    """The same run with and without it: no kind and orientation loses more."""
    path = write_small_city(tmp_path / "small.gml")
    settings = {
        "suns": "days:4",
        "weather": "clear-sky",
        "samples": 256,
        "shadow_samples": 4,
        "threads": 1,
    }
    light = {}
    for on in (True, False):
        request = Request(**settings, far_ground=on)
        scene = read_scene([path], request)
        weather = read_year(scene.site, request)
        prepared = prepare_study(scene, weather, request)
        traced = trace_gather(prepared.scene, prepared.suns, request, silent, prepared=prepared)
        light[on] = light_of_groups(traced, weather)
    lost = 1 - light[False] / light[True]
    assert 0.01 < lost.max() <= prepared.plan["far-ground"].bound < 0.6


@pytest.mark.parametrize("albedo", [0.25, 1.0])
def test_the_edge_of_the_near_ground_before_a_wall_alone(albedo):
    """At a distance of r heights a long row hides (1 - cos β)/2 of the sky, tan β = 1/r; here no
    ground is near: r = 0.

    Of a wall's light from an even sky ρ/2 over 1/2 + ρ/2 comes from the ground, of which it loses
    half.
    """
    request = Request(
        ground_albedo=albedo, weather="clear-sky", sky="isotropic", suns="days:2", threads=1
    )
    scene = scene_of_triangles(*WALL)
    plan = prepare_study(scene, read_year(scene.site, request), request).plan
    assert plan.reach == 0
    assert 0.5 * albedo / (1 + albedo) <= plan["far-ground"].bound < 0.5
    assert shade_at_edge(3.0, None)[0] == pytest.approx((np.sqrt(10) - 3) / (2 * np.sqrt(10)))


def test_reach_of_the_ground():
    """40 m of ground around houses of up to 20 m: the house nearest to the edge is 24 m away from
    it.
    """
    scene = three_houses()
    patches = prepare_scene(scene, Request()).patches
    flat = scene.vertices[scene.triangles][:, :, 2].max(axis=1) == 0
    patches.ground[:] = flat
    assert measure_reach(scene, patches) == pytest.approx(24 / 20)
    patches.ground[:] = False
    assert measure_reach(scene, patches) == 0


@pytest.fixture(scope="module")
def open_planes(berlin):
    return unshaded_transfer(choose_suns("hourly", *berlin.axis), TILT, AZIMUTH)


def hours_by_pvlib(weather, without):
    """Full load hours of the planes, with some effects left out."""
    return [
        run_chain(weather.data, *plane, without=without)[1].sum()
        for plane in zip(TILT, AZIMUTH, strict=True)
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("without", "plain"),
    mark_cases(
        [
            ("aoi", True),
            ("spectrum", False),
            ("temperature", True),
            ("aoi spectrum temperature", False),
        ],
        kept=2,
    ),
)
def test_modules_without_some_effects_equal_pvlib(berlin, open_planes, without, plain, monkeypatch):
    monkeypatch.setattr(energy_under_test, "PLAIN_LIMIT", 1e12 if plain else 0)
    without = without.split()
    system = build_system(Request(effects=dict.fromkeys(without, False), **DC))
    hours = compute_energy(open_planes, berlin, system).full_load_hours
    np.testing.assert_allclose(hours, hours_by_pvlib(berlin, without), rtol=1e-9 if plain else 1e-4)


@pytest.mark.slow
def test_shares_of_the_modules_effects(berlin, open_planes):
    """(with - without)/with of the eligible area, from pvlib called directly."""
    shares = shares_of_effects(open_planes, berlin, build_system(Request(**DC)), 1)
    area = np.where(open_planes.surfaces.eligible, open_planes.surfaces.area, 0)
    whole = area @ hours_by_pvlib(berlin, ())
    assert set(shares) == {"aoi", "spectrum", "temperature"}
    for key, share in shares.items():
        off = area @ hours_by_pvlib(berlin, (key,))
        assert share == pytest.approx((whole - off) / whole, abs=1e-6)
    # Off or on, the share is the same one.
    switched = shares_of_effects(
        open_planes, berlin, build_system(Request(effects={"aoi": False}, **DC)), 1
    )
    assert switched["aoi"] == pytest.approx(shares["aoi"], abs=1e-9)


def test_an_effect_that_yield_switches_has_a_reason_and_no_bound():
    """Losses at the glass that were simulated when the city was traced, and are left out of this
    year's electricity.
    """
    was = {
        "key": "aoi",
        "on": True,
        "extent": "by the module's own law",
        "reason": "light is lost",
        "bound": 0.0,
    }
    summary = {"traced": {"effects": [was]}}
    state_shares(summary, {"aoi": (-0.02, 0.02, False)})
    (off,) = summary["traced"]["effects"]
    assert (off["on"], off["reason"], off["bound"]) == (False, "switched off", None)
    assert off["outcome"] == {"left_out": 0.02, "holds": True}
    state_shares(summary, {"aoi": (-0.02, 0.02, True)})
    (on,) = summary["traced"]["effects"]
    assert (on["on"], on["reason"], on["outcome"]) == (
        True,
        "switched on",
        {"left_out": 0.0, "holds": True},
    )


CHEAP = {"suns": "days:4", "samples": 64, "shadow_samples": 4, "threads": 1}
MANY = 30


def write_city(path, name):
    """Three houses, or a street of 10 m between two rows of 60 m that run east."""
    if name == "houses":
        return write_small_city(path)
    rows = [
        house(row, (0, north), (60, 12, 18), ridge=0.01) for row, north in (("a", 0), ("b", 22))
    ]
    return write_gml(path, *rows)


def light_of_groups(transfer, weather):
    """Irradiation of each kind and orientation that counts: (g,)."""
    surfaces, energy = transfer.surfaces, compute_energy(transfer, weather, threads=1, sky="perez")
    names, counts = (
        np.char.add(surfaces.kind, surfaces.orientation),
        np.asarray(surfaces.eligible, bool),
    )
    light = surfaces.area * np.nan_to_num(energy.poa_global_annual)
    return np.array([light[counts & (names == name)].sum() for name in np.unique(names[counts])])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("city", "albedo"), mark_cases([("houses", 0.6), ("street", 0.1), ("street", 0.25)], kept=1)
)
def test_no_group_loses_more_in_clear_and_overcast_years(tmp_path, city, albedo):
    """Beside a run with the same rays and many reflections."""
    light = {"albedo": albedo, "ground_albedo": albedo, "weather": "clear-sky", **CHEAP}
    scene = read_scene([write_city(tmp_path / "city.gml", city)], Request(**light))
    clear = read_year(scene.site, Request(**light))
    few, many = (
        trace_scene(scene, clear, Request(**light, max_bounces=count)) for count in (None, MANY)
    )
    (effect,) = (one for one in few.record.effects if one["key"] == "reflections")
    assert effect["outcome"]["holds"] and effect["outcome"]["left_out"] <= LIMITS.whole
    # what a closed cover of clouds lets through (Kasten, Czeplak 1980)
    below = 0.25 * clear.data["ghi"]
    overcast = replace(clear, data=clear.data.assign(ghi=below, dni=0.0, dhi=below))
    for weather in (clear, overcast):
        found, known = (light_of_groups(one, weather) for one in (few, many))
        assert 0 < (1 - found / known).max() <= LIMITS.group
        assert 0 < 1 - found.sum() / known.sum() <= LIMITS.whole


@pytest.mark.slow
@pytest.mark.parametrize("albedo", mark_cases([0.2, 0.4, 0.6, 0.8], law=(2,)))
def test_in_a_half_sphere_the_number_is_that_of_a_geometric_series(albedo):
    """E_n = 1/2 (albedo/2)^n everywhere under the sky, so (albedo/2)^(n+1) of the light lies beyond
    n reflections.
    """
    settings = {"albedo": albedo, "far_ground": False, "samples": 256, "shadow_samples": 16}
    transfer = run_gather(bowl(), suns_towards([[0, 0, 1]]), threads=1, **settings)
    assert transfer.record.max_bounces == next(
        n for n in range(1, 30) if (albedo / 2) ** (n + 1) <= LIMITS.whole
    )
    (effect,) = (one for one in transfer.record.effects if one["key"] == "reflections")
    expected = (albedo / 2) ** (transfer.record.max_bounces + 1)
    assert effect["outcome"]["left_out"] == pytest.approx(expected, rel=0.1)
    area = transfer.surfaces.area
    # facets are a little flatter than the sphere
    found = area @ transfer.diffuse_relative / area.sum()
    assert found == pytest.approx(0.5 / (1 - albedo / 2) * (1 - expected), rel=0.02)


def test_by_albedo_alone_where_no_solver_tells():
    """Photons are followed until ρⁿ⁺¹/(1 - ρ), the most that any scene reflects beyond, is below
    0.2 %.
    """
    assert [count_surely(albedo) for albedo in (0.1, 0.25, 0.6)] == [2, 4, 13]
    assert count_surely(1.0) == LIMITS.bounces


def test_a_retired_key_is_taken_with_one_note():
    """Its light is that of the plan; of a key that never was nothing is traced."""
    scene, notes = three_houses(), []
    lights = []
    for effects in ({}, {"reflectors": False}, {"reflectors": True}):
        prepared = prepare_scene(scene, Request(samples=64, threads=1, effects=effects))
        notes.append([line for line in prepared.plan.describe() if "reflectors" in line])
        lights.append(
            run_gather(scene, SUNS, samples=64, threads=1, effects=effects).diffuse_relative
        )
    assert [len(lines) for lines in notes] == [0, 1, 1]
    assert np.array_equal(lights[0], lights[1]) and np.array_equal(lights[0], lights[2])
    with pytest.raises(InputError, match="no effect is called 'reflector'"):
        prepare_scene(scene, Request(effects={"reflector": False}))
