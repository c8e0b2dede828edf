"""What effects change, from small runs with and without them, against closed forms and against
whole runs.
"""

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
from thorough import mark_cases
from transfers import unshaded_transfer
from weathers import BERLIN, HOUR, direct_horizontal, plain_table, year_of

from citypv.core.accuracy.measure_effects import compare_light, measure_effects
from citypv.core.accuracy.sun_sampling import CityYear
from citypv.core.run.study import compute_energy, prepare_study, read_scene, read_year, trace_scene
from citypv.core.settings.request import Request
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
    weather = add_sun(
        Record(plain_table(year_of(2021)), *BERLIN, altitude=0.0, source="", label=""), HOUR
    )
    data = weather.data.assign(dni=direct * weather.data["dni"], dhi=diffuse * weather.data["dhi"])
    return replace(weather, data=data.assign(ghi=data["dhi"] + direct_horizontal(data)))


def measure(scene, weather, **settings):
    """Plan with what each effect changes."""
    request = Request(**CHEAP | {"suns": "days:12"} | settings)
    prepared = prepare_study(scene, weather, request).build_tree(request)
    measure_effects(CityYear(scene, prepared, weather, request))
    return prepared.plan


def share_of_light(having, without):
    """Share of the hours of a module that such light of an even sky makes, over DHI, rather than
    another one.
    """
    suns = choose_suns("days:2", *year().axis)
    transfer = unshaded_transfer(suns, [0, 0], [180, 180], albedo=0.0)
    transfer = replace(transfer, diffuse_relative=np.array([having, without], float))
    hours = compute_energy(transfer, year(), Request(sky="isotropic", **LINEAR)).full_load_hours
    return 1 - hours[1] / hours[0]


def facing_walls():
    """Two long walls that face each other, to the south and to the north: only the one to the south
    counts.
    """
    south = strip([-LONG / 2, 0, 0], [LONG, 0, 0], [0, 0, HIGH], 1)
    north = strip([LONG / 2, -APART, 0], [-LONG, 0, 0], [0, 0, HIGH], 1)
    scene = join([south, north])
    scene.surfaces.eligible[2:] = False
    return scene


@pytest.mark.slow
def test_sky_that_a_wall_hides_from_another():
    """Hottel's strings: the walls see √(H² + d²) - d over H of each other, half of it above the
    horizon.
    """
    effect = measure(facing_walls(), year(), **BLACK, **LINEAR)["sky-rays"]
    left = 0.5 - (np.hypot(HIGH, APART) - APART) / HIGH / 2
    assert effect.share == pytest.approx(share_of_light(left, 0.5), rel=0.03)
    assert 0 < effect.share_standard_error < 0.1


@pytest.mark.slow
@pytest.mark.law
def test_sun_that_a_wall_hides_from_another():
    """Of each hour's sun the upper part of the wall is lit: its shadow falls d ·
    tan(elevation)/cos(azimuth) deep.
    """
    weather = year(direct=1.0, diffuse=1e-6)
    data = weather.data
    height, turn = np.radians(90 - data["apparent_zenith"]), np.radians(data["solar_azimuth"] - 180)
    before = (height > 0) & (np.cos(turn) > 1e-6)
    light = np.where(before, data["dni"] * np.cos(height) * np.cos(turn), 0)
    lit = np.clip(APART * np.tan(height) / np.where(before, np.cos(turn), 1) / HIGH, 0, 1)
    effect = measure(facing_walls(), weather, **BLACK, **LINEAR)["shadow-rays"]
    assert effect.share == pytest.approx(1 - light.sum() / (light * lit).sum(), rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("on", mark_cases([True, False], kept=1))
def test_light_that_a_layer_of_leaves_takes(on):
    """Of an even sky 2 E₃(τ) passes to level ground below it: the same share, whether a run has the
    trees or not.
    """
    scene = scene_of_triangles(*strip([-1, -1, 0], [2, 0, 0], [0, 2, 0], 1))
    scene = replace(
        scene, trees=crowns_of(box((-1e4, -1e4, 1), (1e4, 1e4, 2)), area_density=2 * DEPTH)
    )
    effects = LINEAR["effects"] | ({} if on else {"trees": False})
    plan = measure(
        scene,
        year(),
        leaf_months="all",
        branch_area_density=0.0,
        **BLACK,
        effects=effects,
        inverter=None,
    )
    assert plan["trees"].share == pytest.approx(share_of_light(2 * expn(3, DEPTH), 1.0), rel=0.03)
    assert plan["trees"].on == on and plan["trees"].bound is None
    (line,) = (one for one in plan.describe() if one.startswith("trees"))
    assert "not known before the run; contributes −" in line and " ± " in line


@pytest.mark.thorough
def test_reflections_in_a_half_sphere():
    """E_n = 1/2 (albedo/2)^n: of all light albedo/2 is reflected."""
    albedo = 0.6
    effect = measure(bowl(6), year(), albedo=albedo, far_ground=False, max_bounces=8, **LINEAR)[
        "reflections"
    ]
    assert effect.share == pytest.approx(share_of_light(0.5 / (1 - albedo / 2), 0.5), rel=0.02)


@pytest.mark.slow
@pytest.mark.thorough
def test_sky_in_a_mirror(tmp_path):
    """The street sees the facade with the share of Hottel's strings, and in it the sky's image."""
    scene, wide = street(), EDGES[-1]
    scene.surfaces.eligible[:] = False
    scene.surfaces.eligible[MIDDLE] = True
    seen = 0.5 * (1 - (np.hypot(wide, HEIGHT) - HEIGHT) / wide)
    mirror = finish(tmp_path, "surface,albedo,material\nfacade,0.6,mirror\nflat,0,\n")
    effect = measure(scene, year(), albedo_file=mirror, ground_albedo=0.0, **LINEAR)["specular"]
    assert effect.share == pytest.approx(share_of_light(1 - 0.4 * seen, 1 - seen), rel=0.05)


@pytest.mark.slow
def test_sky_behind_a_ring_of_mountains(tmp_path):
    """A level surface sees cos² h of an even sky above a horizon of height h."""
    path = tmp_path / "ring.csv"
    path.write_text("azimuth,elevation\n0,20\n120,20\n240,20\n", encoding="utf-8")
    scene = scene_of_triangles(*strip([-2, -2, 0], [4, 0, 0], [0, 4, 0], 1))
    effect = measure(scene, year(), horizon=str(path), **BLACK, **LINEAR)["terrain-horizon"]
    assert effect.share == pytest.approx(share_of_light(np.cos(np.radians(20)) ** 2, 1.0), rel=0.03)


def test_errors_are_those_of_pairs():
    """Shares of 10 % ± 1 % in three pairs."""
    on = np.full(3, 40.0)
    assert compare_light(on, on * [0.89, 0.90, 0.91]) == pytest.approx((0.1, 0.01 / np.sqrt(3)))
    assert compare_light(np.zeros(3), np.zeros(3)) == (0.0, 0.0)


KEYS = "sky-rays", "shadow-rays", "reflections", "far-ground", "perez"


@pytest.mark.slow
@pytest.mark.parametrize("trees", [pytest.param(False, marks=pytest.mark.thorough), True])
def test_whole_runs_with_and_without(tmp_path, trees):
    """Clear sky with Perez's horizon: what is told of 36 houses, and what two runs tell.

    And what a tree takes from a wall, whose state in leaf and bare counts with its months.
    """
    rows = [house(f"h{k}", (22 * (k % 6), 19 * (k // 6)), (12, 10, 8 + k % 3)) for k in range(36)]
    scene = wall_and_tree() if trees else read_rows(tmp_path, rows)
    compare_with_runs(scene, ("trees",) if trees else KEYS)


@pytest.mark.slow
def test_a_city_whose_middle_is_not_like_the_rest(tmp_path):
    """Nine towers close together among 135 low houses far apart: the middle is shaded, the city is
    not.
    """
    middle = [k for k in range(144) if k % 12 in (4, 5, 6) and k // 12 in (4, 5, 6)]
    rows = [
        house(f"h{k}", (40 * (k % 12), 40 * (k // 12)), (12, 10, 6))
        for k in range(144)
        if k not in middle
    ]
    rows += [
        house(f"t{k}", (196 + 18 * (k % 3), 196 + 16 * (k // 3)), (12, 10, 40)) for k in range(9)
    ]
    # A quarter of the rays for each of four times as many houses: the same scatter of their sums.
    compare_with_runs(read_rows(tmp_path, rows), KEYS)


@pytest.mark.thorough
def test_trees_in_one_quarter_of_a_city(tmp_path):
    """Crowns before southern walls of 30 of 120 houses: all of the city tells their part."""
    scene = read_rows(
        tmp_path, [house(f"h{k}", (24 * (k % 12), 24 * (k // 12)), (10, 8, 6)) for k in range(120)]
    )
    crowns = []
    for name in (f"h{k}_south" for k in range(120) if k % 12 < 6 and k // 12 < 5):
        row = scene.surfaces.surface_id.index(name)
        wall = (
            scene.vertices[scene.triangles[scene.triangle_surface == row]]
            .reshape(-1, 3)
            .mean(axis=0)
        )
        middle = wall + 4 * scene.surfaces.normal[row]
        crowns.append(box(np.add(middle, [-3, -3, -2]), np.add(middle, [3, 3, 5])))
    compare_with_runs(replace(scene, trees=crowns_of(*crowns)), ("trees",))


BRIGHT = {"ground_albedo": 0.5}  # so that the far ground counts


def read_rows(folder, rows):
    """Scene of some houses."""
    return read_scene([write_gml(folder / "city.gml", *rows)], Request(**BRIGHT))


def compare_with_runs(scene, keys, **few):
    """What each effect is told to change is what two runs of the whole city tell, within what is
    stated.
    """
    request = Request(weather="clear-sky", threads=1, seed=7, **BRIGHT, **few)
    weather = read_year(scene.site, request)

    def hours(**effects):
        switched = replace(request, effects=effects)
        energy = compute_energy(trace_scene(scene, weather, switched), weather, switched)
        return (energy.capacity_factor.sum(axis=0) @ energy.group_area).item()

    plan, whole = measure(scene, weather, sky="auto", suns=request.suns, **BRIGHT), hours()
    for key in keys:
        true, effect = 1 - hours(**{key: False}) / whole, plan[key]
        # Shares of two whole runs scatter as well: those of the 36 houses by 0.0005 over five
        # seeds.
        error = np.hypot(effect.share_standard_error, 0.0005)
        assert abs(true) > 0.001
        assert effect.share == pytest.approx(true, abs=3 * error), key
        assert effect.share_standard_error < 0.02 * abs(true) + 0.0001, key
