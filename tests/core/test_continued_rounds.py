"""Rounds that continue one net of points are one run with all their samples, and state their error as it does."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from test_merge_transfers import REQUEST, light_of, prepared_houses
from test_trees import wall_and_tree

from citypv.core.accuracy.trace_run import trace_round, trace_run
from citypv.core.light.prepare_scene import build_tree, prepare_scene, reseed
from citypv.core.light.rounds import Round, add_round
from citypv.core.light.trace_gather import trace_gather, trace_light
from citypv.core.rays.hemisphere_rays import merge_nets
from citypv.core.rays.sample_points import sobol_digits, sobol_points
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request
from citypv.core.study import prepare_study, read_scene, read_year, trace_scene

pytestmark = pytest.mark.once

NRW = Path(__file__).parents[1] / "data/citygml/nrw_LoD2_32_280_5659_1_NW.gml.gz"
DOUBLING, RUNS = (1, 2), 10  # rounds after the first: four times its samples


def prepared_as(seed):
    scene, suns, prepared = prepared_houses()
    return scene, suns, replace(reseed(prepared, seed), rounds=True)


@cache
def whole_run(seed, times):
    scene, suns, prepared = prepared_as(seed)
    request = replace(REQUEST, seed=seed, samples=times * 64, shadow_samples=times * 4)
    return trace_gather(scene, suns, request, silent, prepared=prepared)


def in_one_run(seed):
    """TracedState of one run with four times the samples."""
    _, suns, prepared = prepared_as(seed)
    return trace_light(prepared, suns, replace(REQUEST, seed=seed, samples=256, shadow_samples=16), silent).states[0]


def in_rounds(seed, sizes, counted=None):
    """TracedState of several rounds."""
    _, suns, prepared = prepared_as(seed)
    city = trace_light(prepared, suns, replace(REQUEST, seed=seed), silent)
    for size in sizes:
        city = add_round(city, Round(size, counted), silent)
    return city.states[0]


def full_patches():
    """Surfaces of patches that send all rays: (n,) bool."""
    scene, _, prepared = prepared_houses()
    full = np.zeros(len(scene.surfaces), bool)
    full[scene.triangle_surface[prepared.plan.receivers]] = True
    return full


def test_parts_of_the_sequence_are_the_first_points_moved_by_a_digital_shift():
    whole = sobol_digits(64)
    for size in (1, 4, 16, 32):
        for first in range(0, 64, size):
            assert np.array_equal(whole[first : first + size], whole[:size] ^ sobol_points([first]))


def test_two_halves_of_a_net_make_the_whole():
    """Each value lands in the rectangle of the finer grid in which its point lies, each in one of its own."""
    shift = np.random.default_rng(2).integers(0, 1 << 24, (5, 2), dtype=np.uint32)
    for points in (1, 2, 8, 16):
        shifts = shift, shift ^ sobol_points([points])[:, :2]
        values = np.arange(10.0 * points, dtype=np.float32).reshape(2, 5, points)
        assert np.array_equal(np.sort(merge_nets(shifts, values), axis=1), np.sort(np.hstack(values), axis=1))


@pytest.mark.parametrize("sizes", [(1, 2), (1, 1, 1)])
def test_points_and_sky_rays_are_those_of_one_run(sizes):
    full, one, city = full_patches(), whole_run(3, 4), in_rounds(3, sizes)
    rounds = city.transfer
    assert full.sum() > 100
    for name in ("sky_view_factor", "visible_share", "far_ground_view_factor"):
        assert getattr(rounds, name)[full] == pytest.approx(getattr(one, name)[full], abs=1e-6)
    (net,), rows = city.direct.annual.nets, city.direct.annual.rows
    assert len(rows) > 100
    assert net.light == pytest.approx(in_one_run(3).direct.annual.by_point[rows], rel=1e-5, abs=1e-7)
    assert rounds.record.rounds == 4
    assert rounds.record.hemisphere_rays >= one.record.hemisphere_rays


def test_their_error_is_that_of_one_run_and_is_stated():
    """Scatter of ten runs on some thousand surfaces, in light of the sky and of the suns."""
    first, rounds, one = (
        [light_of(found(seed)) for seed in range(RUNS)]
        for found in (lambda s: whole_run(s, 1), lambda s: in_rounds(s, DOUBLING).transfer, lambda s: whole_run(s, 4))
    )
    for part in (0, 1):
        scatter = [
            np.array([light[part] for light, _ in runs]).var(axis=0, ddof=1).mean() for runs in (first, rounds, one)
        ]
        assert scatter[1] < 1.05 * scatter[2] < 0.3 * scatter[0]
        stated = np.mean([errors[part] ** 2 for _, errors in rounds])
        assert 0.9 < stated / scatter[1] < 1.2


@pytest.mark.slow
def test_surfaces_that_a_round_is_not_for_keep_their_own_samples():
    """Others reflect light onto them that is better known, and these are as right as if all were sampled: replicates
    stay independent of each other."""
    full = full_patches()
    counted = full & (np.arange(len(full)) % 2 == 0)
    before, after = whole_run(0, 1), in_rounds(0, DOUBLING, counted).transfer
    still = full & ~counted
    for name in ("visible_share", "sky_view_factor", "far_ground_view_factor"):
        assert np.array_equal(getattr(before, name)[still], getattr(after, name)[still])
    (one, error), (other, stated) = light_of(before), light_of(after)
    assert (np.abs(other - one)[:, still] <= 3 * error[:, still]).all()
    assert (stated[:, still] <= 1.1 * error[:, still] + 1e-9).mean() > 0.95
    runs = [light_of(in_rounds(seed, DOUBLING, counted).transfer) for seed in range(RUNS)]
    for part in (0, 1):
        scatter = np.array([light[part] for light, _ in runs]).var(axis=0, ddof=1)
        stated = np.mean([errors[part] ** 2 for _, errors in runs], axis=0)
        # Partly covered patches state the larger of an estimate and a closed form, neither of which is too large by
        # itself: of four points that is 1.4 times too much direct light's variance, of sixteen nothing.
        for members, most in ((counted, 1.25), (still & (before.covered_share == 0), 1.25), (still, 1.7)):
            assert 0.85 < stated[members].mean() / scatter[members].mean() < most
        assert scatter[counted].mean() < 0.4 * scatter[still].mean()


@pytest.mark.thorough
def test_a_stated_band_holds_the_truth_as_often_as_students_t_says():
    """Three degrees of freedom, since replicates go on."""
    known = np.mean([light_of(in_rounds(seed, DOUBLING).transfer)[0] for seed in range(1, RUNS + 1)], axis=0)
    light, error = light_of(in_rounds(0, DOUBLING).transfer)
    noisy = error > 1e-6
    band = stats.t.ppf(0.975, 3) * error * np.sqrt(1 + 1 / RUNS)
    assert 0.9 <= (np.abs(light - known)[noisy] <= band[noisy]).mean() <= 0.99


@pytest.mark.parametrize("bounces", [0, 2])
def test_both_states_of_trees_go_on(bounces):
    """Rounds of all surfaces, then of some alone: light in leaf and bare as of a run of 16 times the samples."""
    scene = wall_and_tree()
    request = Request(
        samples=64, shadow_samples=4, max_bounces=bounces, threads=1, weather=["clear-sky"], suns="days:2"
    )
    weather = read_year(scene.site, request)
    prepared = replace(build_tree(prepare_scene(scene, request, weather=weather), request), rounds=True)
    run = trace_run(scene, weather, request, prepared=prepared)
    known = trace_scene(scene, weather, replace(request, samples=1024, shadow_samples=64, seed=9))
    alone = np.asarray(scene.surfaces.eligible)
    for part in (Round(1), Round(2, alone), Round(4, alone)):
        run = trace_round(run, part)
    total = run.transfer
    for found, expected in ((total, known), (total.bare, known.bare)):
        (light, error), (true, left) = light_of(found), light_of(expected)
        assert (np.abs(light - true) <= 6 * np.hypot(error, left) + 1e-6)[:, alone].all()
    assert total.record.rounds == 8


@pytest.mark.thorough
def test_rounds_do_not_lower_the_error_by_patch_size():
    """All rounds have the same patches: together they state the error that one run with all their samples states."""
    scene = read_scene([NRW], Request(patch_size=20.0))
    request = Request(patch_size=20.0, suns="days:4", max_bounces=2, threads=1)
    weather = read_year(scene.site, request)
    prepared = replace(build_tree(prepare_study(scene, weather, request), request), rounds=True)
    more = replace(request, samples=4 * request.samples, shadow_samples=4 * request.shadow_samples)
    one = trace_gather(scene, prepared.suns, more, silent, prepared=prepared)
    run = trace_run(scene, weather, request, prepared=prepared)
    for size in DOUBLING:
        run = trace_round(run, Round(size))
    total = run.transfer
    for part in ("diffuse_discretisation", "direct_discretisation"):
        told, known = (getattr(light.error_parts, part)[scene.surfaces.eligible] for light in (total, one))
        assert 0.8 < np.sqrt((told**2).mean() / (known**2).mean()) < 1.25
