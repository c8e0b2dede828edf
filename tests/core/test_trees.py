"""Light through crowns: closed forms, and gather against forward."""

from dataclasses import replace

import numpy as np
import pytest
from leaves import ball, box, crowns_of
from scenes import (
    assert_mean,
    join,
    run_forward,
    run_gather,
    scene_of_triangles,
    strip,
    suns_towards,
)
from test_closed_forms import direct_relative
from weathers import BERLIN, plain_table, write_table, year_of

from citypv.core.accuracy.measure_effects import shares_of_effects
from citypv.core.city.canopy import Canopy
from citypv.core.effects.foliage import parse_months
from citypv.core.energy.pv_system import build_system
from citypv.core.light.prepare_scene import prepare_scene
from citypv.core.light.sun_sampling_error import trace_sun_samples
from citypv.core.light.trace_gather import trace_gather
from citypv.core.results.transfer_file import read_transfer, write_transfer
from citypv.core.run.study import compute_energy, read_year, trace_scene
from citypv.core.settings.errors import InputError
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request


def canopy_of(shape, per_metre=0.0, per_crossing=0.0):
    return Canopy(crowns_of(shape), np.array([per_metre]), np.array([per_crossing]))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("thickness", "direction"),
    [(0.5, (0.48, 0.6, -0.64)), (2.0, (0, 0, -1)), (4.0, (0.48, 0.6, -0.64))],
)
def test_a_sphere_of_leaves_lets_its_closed_form_through(thickness, direction):
    """Mean of exp(-x·chord/diameter) over parallel rays: 2/x² · (1 - (1 + x) e^-x)."""
    count, radius, direction = 200_000, 3.0, np.array(direction, float)
    across = np.cross(direction, [1, 0, 0]) / np.linalg.norm(np.cross(direction, [1, 0, 0]))
    distance = radius * np.sqrt((np.arange(count) + 0.5) / count)[:, None]
    turn = (np.arange(count) * np.pi * (3 - np.sqrt(5)))[:, None]
    origins = (
        distance * (np.cos(turn) * across + np.sin(turn) * np.cross(direction, across))
        - 9 * direction
    )
    canopy = canopy_of(ball([0, 0, 0], radius, 5), thickness / (2 * radius))
    found = canopy.transmittance(origins, np.broadcast_to(direction, origins.shape))[0].mean()
    expected = 2 / thickness**2 * (1 - (1 + thickness) * np.exp(-thickness))
    assert found == pytest.approx(expected, rel=0.005)


def test_the_way_through_a_crown_ends_where_the_ray_does():
    """Through, from inside, ending inside, beside; the box is 4 × 4 × 3 m, of one optical depth per
    metre.
    """
    canopy = canopy_of(box([0, 0, 0], [4, 4, 3]), 1.0)
    origins = np.array(
        [[2, 2, 10], [2, 2, 1], [2, 2, -1], [1, 1, -1], [-1, 2, 1], [2, 2, 10], [9, 9, 10]], float
    )
    directions = np.array(
        [[0, 0, -1], [0, 0, 1], [0, 0, 1], [0, 0, 1], [1, 0, 0], [0, 0, -1], [0, 0, -1]], float
    )
    depth = -np.log(
        canopy.transmittance(origins, directions, np.array([99, 99, 99, 2.5, 99, 8, 99]))[0]
    )
    assert depth == pytest.approx([3, 2, 3, 1.5, 4, 1, 0], abs=1e-5)


def test_one_number_for_each_crossing():
    canopy = canopy_of(box([0, 0, 0], [4, 4, 3]), per_crossing=-np.log(0.3))
    origins = np.array([[2, 2, 10], [2, 2, 1], [9, 9, 10]], float)
    directions = np.array([[0, 0.6, -0.8], [0, 0, 1], [0, 0, -1]], float)
    origins[0] -= 9 * directions[0] - [0, 0, -8]
    assert canopy.transmittance(origins, directions)[0] == pytest.approx(
        [0.3, 0.3**0.5, 1], rel=1e-6
    )


def test_crowns_that_overlap_add_up_and_trunks_are_opaque():
    trunk = box([1.9, 1.9, 0], [2.1, 2.1, 2])
    crowns = crowns_of(box([0, 0, 2], [4, 4, 5]), box([1, 1, 3], [3, 3, 4]), trunk, trunks=[2])
    canopy = Canopy(crowns, np.array([0.2, 0.5, 9]), np.zeros(3))
    origins = np.array([[2.5, 2.5, 10], [2, 2, 10], [-1, 2, 1]], float)
    directions = np.array([[0, 0, -1], [0, 0, -1], [1, 0, 0]], float)
    assert canopy.transmittance(origins, directions)[0] == pytest.approx(
        [np.exp(-1.1), 0, 0], abs=1e-12
    )


def test_which_rays_end_in_a_row_of_crowns():
    """Along a row of 40 boxes of 1 m, 3 m apart, the depth up to the reach is known for
    every ray.
    """
    generator = np.random.default_rng(0)
    density, start = generator.uniform(0.05, 0.5, 40), 3.0 * np.arange(40)
    crowns = crowns_of(*(box([x, 0, 0], [x + 1, 1, 1]) for x in start))
    origins = np.column_stack([generator.uniform(-5, 120, 2000), np.full((2000, 2), 0.4)])
    reach, numbers = generator.uniform(0, 90, 2000), 1 - generator.random(2000)
    ends = origins[:, :1] + reach[:, None]
    inside = np.clip(np.minimum(ends, start + 1) - np.maximum(origins[:, :1], start), 0, None)
    expected = np.exp(-inside @ density)
    canopy = Canopy(crowns, density, np.zeros(40))
    rays = origins, np.broadcast_to([1.0, 0, 0], origins.shape), reach
    assert canopy.transmittance(*rays)[0] == pytest.approx(expected, rel=1e-5)
    clear = np.abs(expected - numbers) > 1e-5
    assert ((canopy.transmittance(*rays, numbers)[0] < numbers) == (expected < numbers))[
        clear
    ].all()
    assert 0.2 < (expected < numbers).mean() < 0.9


def test_one_sum_tells_which_rays_end_in_leaf_and_bare():
    """Deciduous and evergreen crowns and a trunk in a row: as each state by itself."""
    rng = np.random.default_rng(5)
    crowns = crowns_of(*(box((3 * k, 0, 0), (3 * k + 2, 9, 9)) for k in range(6)), trunks=[5])
    leaves, share = (
        np.array([0.3, 0.6, 0.2, 0.9, 0.1, 0.0]),
        np.array([0.2, 0.2, 1.0, 0.1, 0.0, 1.0]),
    )
    origins = rng.uniform((-5, 1, 1), (20, 8, 8), (64, 16, 3)).astype(np.float32)
    directions = rng.normal(size=(64, 16, 3)) * (1, 0.2, 0.2)
    directions = (directions / np.linalg.norm(directions, axis=2, keepdims=True)).astype(np.float32)
    reach = rng.uniform(1, 30, (64, 16))
    both = (Canopy(crowns, depth, np.zeros(6)) for depth in (leaves, leaves * share))
    alone = np.concatenate([canopy.stop_rays(origins, directions, reach) for canopy in both])
    found = Canopy(crowns, leaves, np.zeros(6), share).stop_rays(origins, directions, reach)
    assert (found == alone).all()
    assert 0 < found[1].mean() < 0.8 * found[0].mean()


def wall_and_tree(trees=True):
    """A wall and a floor of 20 × 20 m, cut into strips, with a crown in front of the wall."""
    wall = strip([-10, 0, 0], [20, 0, 0], [0, 0, 10], 5)
    floor = strip([-10, -20, 0], [20, 0, 0], [0, 20, 0], 10)
    scene = join([wall, floor])
    crown, trunk = ball([0, -4, 6], 3), box([-0.3, -4.3, 0], [0.3, -3.7, 4])
    return replace(scene, trees=crowns_of(crown, trunk, trunks=[1]) if trees else None)


SUNS = suns_towards([[0, -1, 0.8], [0.4, -1, 0.5], [-0.7, -0.5, 1.0]])


def test_the_sky_through_a_roof_of_leaves():
    """A wide layer of leaves over a floor: E = 2 ∫ exp(-τ/μ) μ dμ = 2 E₃(τ)."""
    from scipy.special import expn

    scene = scene_of_triangles(
        [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    )
    scene.trees = crowns_of(box([-4000, -4000, 5], [4000, 4000, 7]))
    request = Request(samples=4096, max_bounces=0, far_ground=False, leaf_area_density=0.6)
    transfer = trace_gather(scene, suns_towards([[0, 0, 1], [0, 0.8, 0.6]]), request, silent)
    expected = 2 * expn(3, 0.6)
    assert_mean(
        transfer.diffuse_relative,
        np.maximum(transfer.diffuse_relative_standard_error, 0.003),
        expected,
    )
    assert transfer.visible_share.mean(axis=0) == pytest.approx(np.exp([-0.6, -1.0]), abs=0.2)


@pytest.mark.thorough
def test_gather_and_forward_agree_behind_a_tree():
    """Both attenuate every segment: sky, sun, and light between wall and floor."""
    scene = wall_and_tree()
    settings = {
        "albedo": 0.6,
        "ground_albedo": 0.5,
        "max_bounces": 3,
        "leaf_area_density": 0.8,
        "threads": 1,
    }
    settings["sky"] = "perez"
    one = run_gather(scene, SUNS, samples=2048, shadow_samples=128, **settings)
    other = run_forward(scene, SUNS, samples=30_000, **settings)
    bare = run_gather(wall_and_tree(trees=False), SUNS, samples=1024, shadow_samples=64, **settings)
    for find in (
        lambda found: (found.diffuse_relative, found.diffuse_relative_standard_error),
        lambda found: (
            direct_relative(found) @ found.suns.weight,
            found.direct_annual_standard_error,
        ),
        lambda found: (found.sources["horizon"].relative, found.sources["horizon"].standard_error),
    ):
        (value, error), (expected, own), (without, _) = map(find, (one, other, bare))
        assert (np.abs(value - expected) < 4.5 * np.hypot(error, own)).all()
        assert np.median(np.hypot(error, own)) < 0.1 * np.abs(value - without).max()


def test_a_scene_without_trees_has_no_second_scene_and_the_same_light():
    request = Request(samples=64, shadow_samples=4)
    prepared = prepare_scene(wall_and_tree(trees=False), request)
    assert prepared.canopy is None and not prepared.plan["trees"].on
    off = Request(samples=64, shadow_samples=4, effects={"trees": False})
    one, other = (
        trace_gather(wall_and_tree(), SUNS, off, silent),
        trace_gather(prepared.scene, SUNS, request, silent),
    )
    assert (one.diffuse_relative == other.diffuse_relative).all() and (
        one.visible_share == other.visible_share
    ).all()


def test_crowns_keep_patches_from_their_closed_form():
    """A wall alone has nothing in front of it, a wall behind a tree does."""
    scene = join([strip([-10, 0, 0], [20, 0, 0], [0, 0, 10], 5)])
    crowned = replace(scene, trees=crowns_of(ball([0, -4, 6], 3)))
    alone, behind = (prepare_scene(one, Request()).plan.unobstructed for one in (scene, crowned))
    assert alone.all() and not behind.any()


def test_the_check_of_suns_sees_the_trees_of_its_plan():
    """Also where a plan without trees has used the tree of triangles since."""
    scene, request = wall_and_tree(), Request(samples=16, shadow_samples=16)
    scene.surfaces.eligible = np.ones(len(scene.surfaces), bool)
    prepared = prepare_scene(scene, request).build_tree(request)
    transfer = trace_gather(scene, SUNS, request, silent, prepared=prepared)
    treeless = replace(prepared, plan=replace(prepared.plan, foliage=None))
    found = []
    for plan in (prepared, treeless, prepared):
        (few,) = trace_sun_samples(scene, transfer, [SUNS], request, silent, prepared=plan)
        found.append(few.visible_share)
    assert (found[0] == found[2]).all()
    assert found[1].sum() > 1.05 * found[0].sum()


def test_results_do_not_depend_on_threads():
    request = Request(samples=64, shadow_samples=4, threads=1)
    found = trace_gather(wall_and_tree(), SUNS, request, silent)
    again = trace_gather(wall_and_tree(), SUNS, replace(request, threads=3), silent)
    assert (found.diffuse_relative == again.diffuse_relative).all()
    assert (found.visible_share == again.visible_share).all()


def test_months_and_density_of_leaves():
    assert parse_months("auto", 52.5) == (5, 6, 7, 8, 9, 10)
    assert parse_months("auto", -33.0) == (1, 2, 3, 4, 11, 12)
    assert parse_months("auto", 1.3) == parse_months("all") == tuple(range(1, 13))
    assert parse_months("4-10") == (4, 5, 6, 7, 8, 9, 10) and parse_months("11-2,5") == (
        1,
        2,
        5,
        11,
        12,
    )
    assert parse_months("none") == ()
    with pytest.raises(InputError, match="--leaf-months: 'May' is not a month"):
        parse_months("May")
    with pytest.raises(InputError, match="--leaf-area-density: -1 is out of range"):
        Request(leaf_area_density=-1).check()


@pytest.mark.slow
def test_each_month_has_the_light_of_its_state(tmp_path):
    """Months with leaves have the energy of a run in leaf all year, the others that of a bare one;
    files keep both.
    """
    times = year_of(2021)
    write_table(tmp_path / "weather.csv", plain_table(times))
    scene = wall_and_tree()
    settings = {
        "weather": [str(tmp_path / "weather.csv")],
        "weather_place": BERLIN,
        "suns": "days:6",
    }
    settings |= {"samples": 64, "shadow_samples": 4, "max_bounces": 1, "threads": 1}
    found = {}
    for months in ("4-9", "all", "none"):
        request = Request(leaf_months=months, **settings)
        weather = read_year(scene.site, request)
        transfer = trace_scene(scene, weather, request)
        found[months] = transfer, compute_energy(transfer, weather, request)
    (seasonal, energy), (_, in_leaf), (_, bare) = found.values()
    assert seasonal.leaf_months == (4, 5, 6, 7, 8, 9) and found["all"][0].bare is None
    summer = np.isin(np.arange(1, 13), seasonal.leaf_months)
    expected = np.where(summer, in_leaf.full_load_hours_by_month, bare.full_load_hours_by_month)
    np.testing.assert_allclose(energy.full_load_hours_by_month, expected, rtol=1e-6, equal_nan=True)
    walls = scene.surfaces.kind == "facade"
    assert (bare.full_load_hours[walls] > 1.1 * in_leaf.full_load_hours[walls]).any()
    assert (energy.poa_global_annual > 0.999 * in_leaf.poa_global_annual).all()
    assert (energy.poa_global_annual < 1.001 * bare.poa_global_annual).all()
    # The same rays tell for both states: not a bit differs from two runs.
    for state, alone in ((seasonal, found["all"][0]), (seasonal.bare, found["none"][0])):
        for name in ("sky_view_factor", "diffuse_relative", "visible_share", "direct_reflected"):
            assert (getattr(state, name) == getattr(alone, name)).all(), name
    # What single effects make of the hours is looked at in both states, under the same sky.
    off = compute_energy(seasonal, weather, Request(effects={"aoi": False}, **settings))
    whole, without = (surfaces_mean(scene.surfaces, one) for one in (energy, off))
    shares = shares_of_effects(seasonal, weather, build_system(request), 1, sky=energy.sky)
    assert energy.sky == "perez" and shares["aoi"] == pytest.approx(
        (whole - without) / whole, abs=1e-6
    )
    write_transfer(tmp_path / "transfer.nc", seasonal)
    again = compute_energy(read_transfer(tmp_path / "transfer.nc"), weather, request)
    np.testing.assert_allclose(
        again.full_load_hours, energy.full_load_hours, rtol=1e-6, equal_nan=True
    )
    assert (energy.full_load_hours_standard_error[walls] > 0).all()


def surfaces_mean(surfaces, energy):
    """Mean full load hours of the eligible surfaces by area."""
    return np.average(
        energy.full_load_hours[surfaces.eligible], weights=surfaces.area[surfaces.eligible]
    )
