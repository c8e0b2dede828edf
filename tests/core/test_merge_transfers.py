"""Rounds: merged ones are means of independent runs, those that continue one net of points are one
run with all their samples; their stated errors are as large as their scatter.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from test_closed_forms import SUNS, direct_relative
from test_standard_errors import ANYWHERE, scene_and_suns
from test_tracing import three_houses
from test_trees import wall_and_tree
from transfers import merge_all

from citypv.core.light.merge_transfers import MOST_REPLICATES, merge_replicates, seed_of_round
from citypv.core.light.prepare_scene import prepare_scene
from citypv.core.light.rounds import add_round
from citypv.core.light.trace_forward import trace_forward
from citypv.core.light.trace_gather import trace_gather, trace_light
from citypv.core.light.trace_run import trace_run
from citypv.core.light.transfer import variance_of_mean
from citypv.core.run.study import read_year, trace_scene
from citypv.core.settings.errors import InputError
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request

REQUEST = Request(samples=64, shadow_samples=4, max_bounces=2, threads=1)
ROUNDS = 4


@cache
def prepared_houses():
    scene, suns = scene_and_suns(ANYWHERE)
    return scene, suns, prepare_scene(scene, REQUEST).build_tree(REQUEST)


@cache
def traced(seed, index):
    scene, suns, prepared = prepared_houses()
    own = seed_of_round(seed, index)
    return trace_gather(
        scene, suns, replace(REQUEST, seed=own), silent, prepared=prepared.reseed(own)
    )


def light_of(transfer):
    """Diffuse and annual direct light of each surface, and their stated errors: two (2, n)."""
    light = np.stack([transfer.diffuse_relative, direct_relative(transfer) @ transfer.suns.weight])
    return light, np.stack(
        [transfer.diffuse_relative_standard_error, transfer.direct_annual_standard_error]
    )


@pytest.mark.slow
def test_the_first_round_is_an_ordinary_run_and_others_have_numbers_of_their_own():
    scene, suns, prepared = prepared_houses()
    alone = trace_gather(scene, suns, replace(REQUEST, seed=5), silent)
    assert np.array_equal(alone.diffuse_relative, traced(5, 0).diffuse_relative)
    assert np.array_equal(alone.visible_share, traced(5, 0).visible_share)
    keys = [prepared.reseed(seed_of_round(5, index)).patches.key for index in range(20)]
    assert len(np.unique(np.concatenate(keys))) == 20 * len(keys[0])
    seeds = {seed_of_round(seed, index) for seed in range(50) for index in range(50)}
    assert len(seeds) == 2500


@pytest.mark.slow
def test_merged_rounds_are_averages_and_stated_errors_fall():
    rounds = [traced(0, index) for index in range(ROUNDS)]
    one, four = rounds[0], merge_all(rounds)
    mean = np.mean([single.diffuse_relative for single in rounds], axis=0)
    assert four.diffuse_relative == pytest.approx(mean, rel=1e-12)
    mean = np.mean([single.visible_share for single in rounds], axis=0)
    assert four.visible_share == pytest.approx(mean, abs=1e-6)
    mean = np.mean([single.sources["horizon"].relative for single in rounds], axis=0)
    assert four.sources["horizon"].relative == pytest.approx(mean, rel=1e-12)
    parts, points = four.error_parts, [single.error_parts.direct_points for single in rounds]
    assert parts.diffuse_passed_on.shape[1] == 4 * ROUNDS
    assert parts.direct_points.sum() == pytest.approx(np.mean([p.sum() for p in points]) / ROUNDS)
    assert four.record.rounds == ROUNDS
    assert four.record.hemisphere_rays == ROUNDS * one.record.hemisphere_rays
    assert four.record.source_rays["horizon"] == ROUNDS * one.record.source_rays["horizon"] > 0
    assert four.record.degrees_of_freedom["diffuse"] == ROUNDS * 3


def test_replicates_side_by_side_state_the_variance_of_the_mean():
    """χ² of 3 K degrees of freedom: mean and variance of the estimate, also where replicates are
    added up.
    """
    generator = np.random.default_rng(3)
    for rounds in (2, 5, 3 * MOST_REPLICATES // 4):
        values = generator.normal(size=(4000, rounds, 4))
        total = values[:, 0]
        for index in range(1, rounds):
            weights = index / (index + 1), 1 / (index + 1)
            total = merge_replicates(total, values[:, index], weights[1], index)
        assert total.shape[1] == min(4 * rounds, MOST_REPLICATES)
        stated, freedom = variance_of_mean(total), 3 * min(rounds, MOST_REPLICATES // 4)
        assert stated.mean() == pytest.approx(1 / (4 * rounds), rel=5 * np.sqrt(2 / freedom / 4000))
        assert stated.var() == pytest.approx(2 / freedom / (4 * rounds) ** 2, rel=0.25)


def test_forward_rounds_merge_too():
    scene, request = three_houses(), Request(estimator="forward", samples=8, threads=1)
    rounds = [
        trace_forward(scene, SUNS, replace(request, seed=seed_of_round(0, k)), silent)
        for k in range(3)
    ]
    whole = merge_all(rounds)
    variance = np.mean([one.diffuse_relative_standard_error**2 for one in rounds], axis=0) / 3
    assert whole.diffuse_relative_standard_error**2 == pytest.approx(variance, rel=1e-9)
    assert whole.record.photons["sky"]["emitted"] == sum(
        one.record.photons["sky"]["emitted"] for one in rounds
    )


def test_rounds_of_different_suns_are_refused():
    scene = three_houses()
    one = trace_gather(scene, SUNS, REQUEST, silent)
    turned = replace(SUNS, direction=SUNS.direction * [-1, 1, 1])
    with pytest.raises(InputError, match="of another scene"):
        merge_all([one, trace_gather(scene, turned, REQUEST, silent)])


DOUBLING, RUNS = (1, 2), 10  # rounds after the first: four times its samples


def prepared_as(seed):
    scene, suns, prepared = prepared_houses()
    return scene, suns, replace(prepared.reseed(seed), rounds=True)


@cache
def whole_run(seed, times):
    scene, suns, prepared = prepared_as(seed)
    request = replace(REQUEST, seed=seed, samples=times * 64, shadow_samples=times * 4)
    return trace_gather(scene, suns, request, silent, prepared=prepared)


def in_one_run(seed):
    """TracedState of one run with four times the samples."""
    _, suns, prepared = prepared_as(seed)
    return trace_light(
        prepared, suns, replace(REQUEST, seed=seed, samples=256, shadow_samples=16), silent
    ).states[0]


def in_rounds(seed, sizes):
    """TracedState of several rounds."""
    _, suns, prepared = prepared_as(seed)
    city = trace_light(prepared, suns, replace(REQUEST, seed=seed), silent)
    for size in sizes:
        city = add_round(city, size, silent)
    return city.states[0]


def full_patches():
    """Surfaces of patches that send all rays: (n,) bool."""
    scene, _, prepared = prepared_houses()
    full = np.zeros(len(scene.surfaces), bool)
    full[scene.triangle_surface[prepared.plan.receivers]] = True
    return full


@pytest.mark.slow
@pytest.mark.parametrize("sizes", [(1, 2), (1, 1, 1)])
def test_points_and_sky_rays_are_those_of_one_run(sizes):
    full, one, city = full_patches(), whole_run(3, 4), in_rounds(3, sizes)
    rounds = city.transfer
    assert full.sum() > 100
    for name in ("sky_view_factor", "visible_share", "far_ground_view_factor"):
        assert getattr(rounds, name)[full] == pytest.approx(getattr(one, name)[full], abs=1e-6)
    (net,), rows = city.direct.annual.nets, city.direct.annual.rows
    assert len(rows) > 100
    assert net.light == pytest.approx(
        in_one_run(3).direct.annual.by_point[rows], rel=1e-5, abs=1e-7
    )
    assert rounds.record.rounds == 4
    assert np.array_equal(
        city.traced.samples, 4 * in_rounds(3, ()).traced.samples
    )  # of covered patches too
    assert rounds.record.hemisphere_rays >= one.record.hemisphere_rays


@pytest.mark.thorough
def test_their_error_is_that_of_one_run_and_is_stated():
    """Scatter of ten runs on some thousand surfaces, in light of the sky and of the suns."""
    ways = (
        lambda s: whole_run(s, 1),
        lambda s: in_rounds(s, DOUBLING).transfer,
        lambda s: whole_run(s, 4),
    )
    first, rounds, one = ([light_of(found(seed)) for seed in range(RUNS)] for found in ways)
    for part in (0, 1):
        values = ([light[part] for light, _ in runs] for runs in (first, rounds, one))
        scatter = [np.var(light, axis=0, ddof=1) for light in values]
        means = [one.mean() for one in scatter]
        assert means[1] < 1.05 * means[2] < 0.3 * means[0]
        stated = np.mean([errors[part] ** 2 for _, errors in rounds], axis=0)
        # Four points at a time do not tell how even all points of other surfaces are: their error
        # is stated larger.
        for members, most in ((full_patches(), 1.15), (~full_patches(), 3.0)):
            assert 0.9 < stated[members].mean() / scatter[1][members].mean() < most


@pytest.mark.slow
@pytest.mark.parametrize("bounces", [0, 2])
def test_both_states_of_trees_go_on(bounces):
    """Light in leaf and bare is that of a run of 16 times the samples."""
    scene = wall_and_tree()
    request = replace(REQUEST, max_bounces=bounces, weather=["clear-sky"], suns="days:2")
    weather = read_year(scene.site, request)
    prepared = replace(
        prepare_scene(scene, request, weather=weather).build_tree(request), rounds=True
    )
    run = trace_run(scene, weather, request, prepared=prepared)
    known = trace_scene(scene, weather, replace(request, samples=1024, shadow_samples=64, seed=9))
    for size in (1, 2, 4):
        run = run.add_round(size)
    total = run.transfer
    for found, expected in ((total, known), (total.bare, known.bare)):
        (light, error), (true, left) = light_of(found), light_of(expected)
        assert (np.abs(light - true) <= 6 * np.hypot(error, left) + 1e-6).all()
    assert total.record.rounds == 8
