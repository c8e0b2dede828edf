"""Bounds and outcomes of effects that are switched off, against closed forms and against runs with and without them."""

from dataclasses import replace

import numpy as np
import pytest
from leaves import box, crowns_of
from mirror_street import EDGES, HEIGHT, MIDDLE, finish, street
from scenes import join, scene_of_triangles, strip
from scipy.special import expn
from small_city import write_small_city
from test_effects import bowl
from test_horizon import HOUR, with_sun
from test_trees import wall_and_tree
from weathers import BERLIN, plain_table, year_of

from citypv.core.commands.judge_light import judge_light
from citypv.core.effects import switched_off
from citypv.core.effects.plan_effects import describe_plan
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.settings.request import Request
from citypv.core.study import prepare_study, read_scene, read_year, trace_scene
from citypv.core.weather.weather import Weather

CHEAP = {"suns": "days:2", "samples": 16, "shadow_samples": 1, "threads": 1, "sky": "isotropic"}
LONG, HIGH, APART = 4000.0, 10.0, 8.0  # [m]


def year(direct=0.0, diffuse=1.0):
    """Berlin's year with some share of an even veil's direct and diffuse light."""
    data = with_sun(plain_table(year_of(2021)))
    data = data.assign(dni=direct * data["dni"], dhi=diffuse * data["dhi"])
    data["ghi"] = data["dhi"] + data["dni"] * np.maximum(np.cos(np.radians(data["apparent_zenith"])), 0)
    return Weather(label="", data=data, interval=HOUR, latitude=BERLIN[0], longitude=BERLIN[1], altitude=0.0)


def judged(scene, weather, key, change=None, **settings):
    """Bound of an effect that is switched off, before and after `change`, and its outcome."""
    request = Request(**CHEAP | {"effects": {key: False}} | settings)
    prepared = prepare_study(scene, weather, request)
    effect = prepared.plan[key]
    before = effect.bound
    if change:
        effect.bound = change(before)
    transfer = trace_scene(scene, weather, request, prepared=prepared)
    record = judge_light(transfer, prepared.plan, weather, request).record
    return before, next(one for one in record.effects if one["key"] == key)["outcome"]


def check(found, expected, slack=0.05):
    """Bound and outcome of a known share: at most so much too large, and as close as random paths tell."""
    bound, outcome = found
    assert expected <= bound <= (1 + 2 * slack) * expected
    assert outcome["left_out"] == pytest.approx(expected, rel=slack)
    assert outcome["holds"] is True


def facing_walls():
    """Two long walls that face each other, to the south and to the north: only the one to the south counts."""
    south = strip([-LONG / 2, 0, 0], [LONG, 0, 0], [0, 0, HIGH], 1)
    north = strip([LONG / 2, -APART, 0], [-LONG, 0, 0], [0, 0, HIGH], 1)
    scene = join([south, north])
    scene.surfaces.eligible[2:] = False
    return scene


BLACK = {"albedo": 0.0, "ground_albedo": 0.0}
BRIGHT = {"albedo": 0.9, "ground_albedo": 0.9, "max_bounces": 0}  # of which no reflection is followed


@pytest.mark.parametrize("settings", [BLACK, BRIGHT])
def test_sky_that_a_wall_hides_from_another(settings):
    """Hottel's strings: the walls see √(H² + d²) - d over H of each other, half of it above the horizon."""
    seen = (np.hypot(HIGH, APART) - APART) / HIGH
    check(judged(facing_walls(), year(), "sky-rays", **settings), 0.5 / (0.5 - seen / 2) - 1)


@pytest.mark.parametrize("settings", [BLACK, BRIGHT])
def test_sun_that_a_wall_hides_from_another(settings):
    """Of each hour's sun the upper part of the wall is lit: its shadow falls d · tan(elevation)/cos(azimuth) deep."""
    weather = year(direct=1.0, diffuse=1e-6)
    data = weather.data
    height, turn = np.radians(90 - data["apparent_zenith"]), np.radians(data["solar_azimuth"] - 180)
    before = (height > 0) & (np.cos(turn) > 1e-6)
    light = np.where(before, data["dni"] * np.cos(height) * np.cos(turn), 0)
    lit = np.clip(APART * np.tan(height) / np.where(before, np.cos(turn), 1) / HIGH, 0, 1)
    expected = light.sum() / (light * lit).sum() - 1
    assert expected > 0.2
    check(judged(facing_walls(), weather, "shadow-rays", **settings), expected)


def test_shade_at_the_foot_of_the_walls_where_no_ground_is_given():
    """A wall without anything before it gets ρ/2 of the sky's light from the ground, of which its row hides half."""
    scene = scene_of_triangles(*strip([-LONG / 2, 0, 0], [LONG, 0, 0], [0, 0, HIGH], 1))
    bound, outcome = judged(scene, year(), "far-ground", effects={}, albedo=0.5, ground_albedo=0.5)
    assert outcome == {"left_out": pytest.approx(0.5 * 0.25 / 0.75, rel=1e-4), "holds": True}
    assert bound == pytest.approx(0.5 * 0.25 / 0.75, rel=1e-4)
    # Under a sunny year the ground's share in the light of the walls is another than in that of the sky alone.
    bound, outcome = judged(facing_walls(), year(direct=1.0, diffuse=0.2), "far-ground", effects={})
    assert 0.01 < outcome["left_out"] <= bound and outcome["holds"] is True


@pytest.mark.parametrize("albedo", [0.25, 0.6])
def test_reflections_in_a_half_sphere(albedo):
    """E_n = 1/2 (albedo/2)^n: albedo/2 lies beyond the first light, of the worst of many groups a little more."""
    bound, outcome = judged(bowl(), year(), "reflections", albedo=albedo, far_ground=False)
    assert albedo / 2 <= bound <= 1.3 * albedo / 2
    assert outcome == {"left_out": pytest.approx(albedo / 2, rel=0.1), "holds": True}


DEPTH = 0.7


def below_leaves():
    """Level ground below a layer of leaves between heights of 1 and 2 m, practically to the horizon."""
    scene = scene_of_triangles(*strip([-1, -1, 0], [2, 0, 0], [0, 2, 0], 1))
    return replace(scene, trees=crowns_of(box((-1e4, -1e4, 1), (1e4, 1e4, 2)), area_density=2 * DEPTH))


@pytest.mark.parametrize("bare", [None, 0.2])
def test_light_that_a_layer_of_leaves_takes(bare):
    """Of an even sky 2 E₃(τ) passes: in leaf all year, or in half of it, where the bound is that of leaves all year."""
    months = "all" if bare is None else "5-10"
    settings = {"leaf_months": months, "branch_area_density": bare or 0.0, **BLACK}
    weather = year()
    bound, outcome = judged(below_leaves(), weather, "trees", **settings)
    passed = 2 * expn(3, DEPTH)
    assert 1 / passed - 1 <= bound <= 1.1 * (1 / passed - 1)
    if bare is not None:
        summer = np.isin((weather.data.index + HOUR / 2).month, range(5, 11))
        share = weather.data["ghi"][summer].sum() / weather.data["ghi"].sum()
        passed = share * passed + (1 - share) * 2 * expn(3, 0.5 * bare)
    assert outcome == {"left_out": pytest.approx(1 / passed - 1, rel=0.03), "holds": True}


def test_the_plan_says_that_too_much_light_is_found():
    plan = prepare_study(below_leaves(), year(), Request(**CHEAP | BLACK | {"effects": {"trees": False}})).plan
    (line,) = (one for one in describe_plan(plan) if one.startswith("trees"))
    assert f"finds at most {100 * plan['trees'].bound:.2f} % too much light" in line and plan["trees"].bound > 0


@pytest.mark.parametrize("key", ["sky-rays", "trees"])
def test_a_wrong_bound_is_found_out(key):
    """A tenth less than what is left out does not hold; a tenth more does."""
    scene, settings = (
        (facing_walls(), BLACK) if key == "sky-rays" else (below_leaves(), {"leaf_months": "all", **BLACK})
    )
    seen = (np.hypot(HIGH, APART) - APART) / HIGH
    expected = 1 / (1 - seen) - 1 if key == "sky-rays" else 1 / (2 * expn(3, DEPTH)) - 1
    for factor in (0.9, 1.1):
        _, outcome = judged(scene, year(), key, lambda _, factor=factor: factor * expected, **settings)
        assert outcome["holds"] is (factor > 1)


def light_of_groups(scene, weather, **settings):
    """Irradiation of each kind and orientation, and the plan of the run."""
    request = Request(suns="days:6", samples=256, shadow_samples=16, threads=1, seed=7, **settings)
    prepared = prepare_study(scene, weather, request)
    transfer = trace_scene(scene, weather, request, prepared=prepared)
    energy = compute_energy(transfer, weather, threads=1, sky="perez")
    names = np.char.add(transfer.surfaces.kind, transfer.surfaces.orientation)
    weight = scene.surfaces.area * energy.poa_global_annual * scene.surfaces.eligible
    return np.array([weight[names == name].sum() for name in np.unique(names[scene.surfaces.eligible])]), prepared.plan


@pytest.mark.slow
@pytest.mark.once
@pytest.mark.parametrize("trees", [False, True])
def test_whole_runs_with_and_without(tmp_path, trees):
    """Clear sky with Perez's horizon: what each effect changes in each group is measured, and lies within its bound.

    Houses, and a wall behind a tree, whose state in leaf and bare counts with its months.
    """
    request = Request(weather="clear-sky", threads=1)
    scene = wall_and_tree() if trees else read_scene([write_small_city(tmp_path / "small.gml")], request)
    weather = read_year(scene.site, request)
    whole, _ = light_of_groups(scene, weather)
    for key in ("trees",) if trees else ("sky-rays", "shadow-rays", "reflections", "far-ground"):
        without, plan = light_of_groups(scene, weather, effects={key: False})
        changed = np.abs(without / whole - 1)
        found = switched_off.shares_of_groups(switched_off.light_of_year(plan.inputs, key, 11, leafy=False))
        for (share, error), true in zip(found, changed, strict=True):
            assert share == pytest.approx(true, abs=4 * error + 0.01), key
        assert 0.01 < changed.max() <= plan[key].bound, key


MIRROR = "surface,albedo,material\nfacade,0.6,mirror\nflat,0,\n"


def mirror_street():
    """A mirror facade that looks south, and the street before it, a quarter as wide in the middle."""
    scene = street()
    scene.surfaces.eligible[:] = False
    scene.surfaces.eligible[MIDDLE] = True
    return scene


@pytest.mark.parametrize("key", ["specular", "reflections"])
def test_sky_in_a_mirror_that_is_black(tmp_path, key):
    """The street sees the facade with the share of Hottel's strings, and in it the sky's image.

    Without reflections, which only the mirror has, the same is missing.
    """
    wide = EDGES[-1]
    seen = 0.5 * (1 - (np.hypot(wide, HEIGHT) - HEIGHT) / wide)
    settings = {"albedo_file": finish(tmp_path, MIRROR), "ground_albedo": 0.0}
    check(judged(mirror_street(), year(), key, **settings), 0.6 * seen / (1 - seen + 0.6 * seen))


def test_sun_in_a_mirror_that_is_black(tmp_path):
    """Each hour's sun is thrown back as far as the facade's height over its tangent, at the same cosine."""
    weather = year(direct=1.0, diffuse=1e-6)
    data = weather.data
    height, turn = np.radians(90 - data["apparent_zenith"]), np.radians(data["solar_azimuth"] - 180)
    light = data["dni"] * np.maximum(np.sin(height), 0)
    before = (height > 0) & (np.cos(turn) > 0)
    lit = np.where(before, np.clip(HEIGHT * np.cos(turn) / np.tan(np.where(before, height, 1)) / EDGES[-1], 0, 1), 0)
    # The sun behind the facade does not reach the street close to it.
    behind = (height > 0) & ~before
    shade = np.where(behind, np.clip(-HEIGHT * np.cos(turn) / np.tan(np.where(behind, height, 1)) / EDGES[-1], 0, 1), 0)
    gained, own = 0.6 * (light * lit).sum(), (light * (1 - shade)).sum()
    settings = {"albedo_file": finish(tmp_path, MIRROR), "ground_albedo": 0.0}
    check(judged(mirror_street(), weather, "specular", **settings), gained / (own + gained))
