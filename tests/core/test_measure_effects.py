"""What effects change, from small runs with and without them, against closed forms and against whole runs."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from leaves import box, crowns_of
from mirror_street import EDGES, HEIGHT, MIDDLE, finish, street
from radiosity import bowl
from scenes import join, scene_of_triangles, strip
from scipy.special import expn
from small_city import house, write_gml
from test_trees import wall_and_tree
from transfers import unshaded_transfer
from weathers import BERLIN, HOUR, direct_horizontal, plain_table, year_of

from citypv.core.accuracy.measure_effects import MOST, choose_neighbourhood, compare_light, measure_effects
from citypv.core.accuracy.sun_sampling import CityYear
from citypv.core.effects.plan_effects import describe_plan
from citypv.core.light.prepare_scene import build_tree
from citypv.core.settings.request import Request
from citypv.core.study import compute_energy, prepare_study, read_scene, read_year, trace_scene
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.weather.add_sun import add_sun
from citypv.core.weather.weather import Record

CHEAP = {"samples": 256, "shadow_samples": 16, "threads": 1, "sky": "isotropic"}
BLACK = {"albedo": 0.0, "ground_albedo": 0.0}
LONG, HIGH, APART = 4000.0, 10.0, 8.0  # [m]
DEPTH = 0.7  # optical depth of a layer of leaves
# Hours in proportion to light, nearly.
LINEAR = {"effects": {"temperature": False, "aoi": False, "spectrum": False}, "inverter": None}


@cache
def year(direct=0.0, diffuse=1.0):
    """Berlin's year with some share of an even veil's direct and diffuse light."""
    weather = add_sun(Record(plain_table(year_of(2021)), *BERLIN, altitude=0.0, source="", label=""), HOUR)
    data = weather.data.assign(dni=direct * weather.data["dni"], dhi=diffuse * weather.data["dhi"])
    return replace(weather, data=data.assign(ghi=data["dhi"] + direct_horizontal(data)))


def measure(scene, weather, **settings):
    """Plan with what each effect changes."""
    request = Request(**CHEAP | {"suns": "days:12"} | settings)
    prepared = build_tree(prepare_study(scene, weather, request), request)
    measure_effects(CityYear(scene, prepared, weather, request))
    return prepared.plan


def share_of_light(having, without):
    """Share of the hours of a module that such light of an even sky makes, over DHI, rather than another one."""
    suns = choose_suns("days:2", *year().axis)
    transfer = unshaded_transfer(suns, [0, 0], [180, 180], albedo=0.0)
    transfer = replace(transfer, diffuse_relative=np.array([having, without], float))
    hours = compute_energy(transfer, year(), Request(sky="isotropic", **LINEAR)).full_load_hours
    return 1 - hours[1] / hours[0]


def facing_walls():
    """Two long walls that face each other, to the south and to the north: only the one to the south counts."""
    south = strip([-LONG / 2, 0, 0], [LONG, 0, 0], [0, 0, HIGH], 1)
    north = strip([LONG / 2, -APART, 0], [-LONG, 0, 0], [0, 0, HIGH], 1)
    scene = join([south, north])
    scene.surfaces.eligible[2:] = False
    return scene


def test_sky_that_a_wall_hides_from_another():
    """Hottel's strings: the walls see √(H² + d²) - d over H of each other, half of it above the horizon."""
    effect = measure(facing_walls(), year(), **BLACK, **LINEAR)["sky-rays"]
    left = 0.5 - (np.hypot(HIGH, APART) - APART) / HIGH / 2
    assert effect.share == pytest.approx(share_of_light(left, 0.5), rel=0.03)
    assert 0 < effect.share_standard_error < 0.1


def test_sun_that_a_wall_hides_from_another():
    """Of each hour's sun the upper part of the wall is lit: its shadow falls d · tan(elevation)/cos(azimuth) deep."""
    weather = year(direct=1.0, diffuse=1e-6)
    data = weather.data
    height, turn = np.radians(90 - data["apparent_zenith"]), np.radians(data["solar_azimuth"] - 180)
    before = (height > 0) & (np.cos(turn) > 1e-6)
    light = np.where(before, data["dni"] * np.cos(height) * np.cos(turn), 0)
    lit = np.clip(APART * np.tan(height) / np.where(before, np.cos(turn), 1) / HIGH, 0, 1)
    effect = measure(facing_walls(), weather, **BLACK, **LINEAR)["shadow-rays"]
    assert effect.share == pytest.approx(1 - light.sum() / (light * lit).sum(), rel=0.05)


@pytest.mark.parametrize("on", [True, False])
def test_light_that_a_layer_of_leaves_takes(on):
    """Of an even sky 2 E₃(τ) passes to level ground below it: the same share, whether a run has the trees or not."""
    scene = scene_of_triangles(*strip([-1, -1, 0], [2, 0, 0], [0, 2, 0], 1))
    scene = replace(scene, trees=crowns_of(box((-1e4, -1e4, 1), (1e4, 1e4, 2)), area_density=2 * DEPTH))
    effects = LINEAR["effects"] | ({} if on else {"trees": False})
    plan = measure(scene, year(), leaf_months="all", branch_area_density=0.0, **BLACK, effects=effects, inverter=None)
    assert plan["trees"].share == pytest.approx(share_of_light(2 * expn(3, DEPTH), 1.0), rel=0.03)
    assert plan["trees"].on == on and plan["trees"].bound is None
    (line,) = (one for one in describe_plan(plan) if one.startswith("trees"))
    assert "not known before the run; contributes −" in line and " ± " in line


def test_reflections_in_a_half_sphere():
    """E_n = 1/2 (albedo/2)^n: of all light albedo/2 is reflected."""
    albedo = 0.6
    effect = measure(bowl(6), year(), albedo=albedo, far_ground=False, max_bounces=8, **LINEAR)["reflections"]
    assert effect.share == pytest.approx(share_of_light(0.5 / (1 - albedo / 2), 0.5), rel=0.02)


def test_sky_in_a_mirror(tmp_path):
    """The street sees the facade with the share of Hottel's strings, and in it the sky's image."""
    scene, wide = street(), EDGES[-1]
    scene.surfaces.eligible[:] = False
    scene.surfaces.eligible[MIDDLE] = True
    seen = 0.5 * (1 - (np.hypot(wide, HEIGHT) - HEIGHT) / wide)
    mirror = finish(tmp_path, "surface,albedo,material\nfacade,0.6,mirror\nflat,0,\n")
    effect = measure(scene, year(), albedo_file=mirror, ground_albedo=0.0, **LINEAR)["specular"]
    assert effect.share == pytest.approx(share_of_light(1 - 0.4 * seen, 1 - seen), rel=0.05)


def test_sky_behind_a_ring_of_mountains(tmp_path):
    """A level surface sees cos² h of an even sky above a horizon of height h."""
    path = tmp_path / "ring.csv"
    path.write_text("azimuth,elevation\n0,20\n120,20\n240,20\n", encoding="utf-8")
    scene = scene_of_triangles(*strip([-2, -2, 0], [4, 0, 0], [0, 4, 0], 1))
    effect = measure(scene, year(), horizon=str(path), **BLACK, **LINEAR)["terrain-horizon"]
    assert effect.share == pytest.approx(share_of_light(np.cos(np.radians(20)) ** 2, 1.0), rel=0.03)


def test_errors_are_those_of_pairs_and_of_surfaces_drawn():
    """Shares of 10 % ± 1 % in three pairs; surfaces that differ count where more of the city is unseen."""
    on = np.full((3, 4), 10.0)
    off = on * np.array([0.89, 0.90, 0.91])[:, None]
    assert compare_light(on, off, 0.0) == pytest.approx((0.1, 0.01 / np.sqrt(3)))
    off = np.tile([8.0, 10.0, 8.0, 10.0], (3, 1))
    assert compare_light(on, off, 0.0) == pytest.approx((0.1, 0.0))
    assert compare_light(on, off, 0.25) == pytest.approx((0.1, 0.5 * 0.1 / np.sqrt(4)))
    assert compare_light(np.zeros((3, 4)), np.zeros((3, 4)), 1.0) == (0.0, 0.0)


@pytest.mark.slow
@pytest.mark.once
@pytest.mark.parametrize("trees", [pytest.param(False, marks=pytest.mark.thorough), True])
def test_whole_runs_with_and_without(tmp_path, trees):
    """Clear sky with Perez's horizon: of the houses in the middle of 36, what their square tells and two runs of all.

    And what a tree takes from a wall, whose state in leaf and bare counts with its months.
    """
    bright = {"ground_albedo": 0.5}  # so that the far ground counts
    request = Request(weather="clear-sky", threads=1, seed=7, **bright)
    rows = (house(f"h{k}", (22 * (k % 6), 19 * (k // 6)), (12, 10, 8 + k % 3)) for k in range(36))
    scene = wall_and_tree() if trees else read_scene([write_gml(tmp_path / "city.gml", *rows)], request)
    weather = read_year(scene.site, request)

    middle = choose_neighbourhood(prepare_study(scene, weather, request), MOST)[1]
    assert trees or middle.sum() < 0.6 * len(middle)

    def hours(**effects):
        one = replace(request, effects=effects)
        energy = compute_energy(trace_scene(scene, weather, one), weather, one)
        counted = np.where(energy.eligible & middle, energy.counted_area, 0)
        return counted @ np.nan_to_num(energy.full_load_hours)

    plan, whole = measure(scene, weather, sky="auto", **bright), hours()
    for key in ("trees",) if trees else ("sky-rays", "shadow-rays", "reflections", "far-ground", "perez"):
        true = 1 - hours(**{key: False}) / whole
        effect = plan[key]
        assert abs(true) > 0.001
        assert effect.share == pytest.approx(true, abs=3 * effect.share_standard_error + 0.002), key
        assert effect.share_standard_error < 0.5 * abs(true) + 0.001, key
