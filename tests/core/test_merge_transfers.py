"""Merged rounds: their mean is that of independent runs, and its stated error is as large as its scatter."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from test_closed_forms import SUNS, direct_relative
from test_standard_errors import ANYWHERE, scene_and_suns
from test_tracing import three_houses
from transfers import merge_all

from citypv.core.light.merge_transfers import MOST_REPLICATES, merge_replicates, seed_of_round
from citypv.core.light.prepare_scene import build_tree, prepare_scene, reseed
from citypv.core.light.trace_gather import trace_gather
from citypv.core.light.transfer import variance_of_mean
from citypv.core.photons.trace_forward import trace_forward
from citypv.core.settings.errors import InputError
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request

pytestmark = pytest.mark.once

REQUEST = Request(samples=64, shadow_samples=4, max_bounces=2, threads=1)
ROUNDS, RUNS = 4, 12


@cache
def prepared_houses():
    scene, suns = scene_and_suns(ANYWHERE)
    return scene, suns, build_tree(prepare_scene(scene, REQUEST), REQUEST)


@cache
def traced(seed, index):
    scene, suns, prepared = prepared_houses()
    own = seed_of_round(seed, index)
    return trace_gather(scene, suns, replace(REQUEST, seed=own), silent, prepared=reseed(prepared, own))


def merged(seed, rounds=ROUNDS):
    return merge_all([traced(seed, index) for index in range(rounds)])


def light_of(transfer):
    """Diffuse and annual direct light of each surface, and their stated errors: two (2, n)."""
    light = np.stack([transfer.diffuse_relative, direct_relative(transfer) @ transfer.suns.weight])
    return light, np.stack([transfer.diffuse_relative_standard_error, transfer.direct_annual_standard_error])


def test_the_first_round_is_an_ordinary_run_and_others_have_numbers_of_their_own():
    scene, suns, prepared = prepared_houses()
    alone = trace_gather(scene, suns, replace(REQUEST, seed=5), silent)
    assert np.array_equal(alone.diffuse_relative, traced(5, 0).diffuse_relative)
    assert np.array_equal(alone.visible_share, traced(5, 0).visible_share)
    keys = [reseed(prepared, seed_of_round(5, index)).patches.key for index in range(20)]
    assert len(np.unique(np.concatenate(keys))) == 20 * len(keys[0])
    seeds = {seed_of_round(seed, index) for seed in range(50) for index in range(50)}
    assert len(seeds) == 2500


def test_merged_rounds_are_averages_and_stated_errors_fall():
    one, four = traced(0, 0), merged(0)
    mean = np.mean([traced(0, index).diffuse_relative for index in range(ROUNDS)], axis=0)
    assert four.diffuse_relative == pytest.approx(mean, rel=1e-12)
    mean = np.mean([traced(0, index).visible_share for index in range(ROUNDS)], axis=0)
    assert four.visible_share == pytest.approx(mean, abs=1e-6)
    mean = np.mean([traced(0, index).sources["horizon"].relative for index in range(ROUNDS)], axis=0)
    assert four.sources["horizon"].relative == pytest.approx(mean, rel=1e-12)
    assert np.array_equal(one.visible_share, traced(0, 0).visible_share)  # not overwritten
    parts, points = four.error_parts, [traced(0, index).error_parts.direct_points for index in range(ROUNDS)]
    assert parts.diffuse_passed_on.shape[1] == 4 * ROUNDS
    assert parts.direct_points.sum() == pytest.approx(np.mean([p.sum() for p in points]) / ROUNDS)
    stated = [np.mean(run.error_parts.direct_passed_on.var(axis=1, ddof=1)) for run in (one, four)]
    assert np.isfinite(stated).all()
    assert four.record.rounds == ROUNDS
    assert four.record.hemisphere_rays == ROUNDS * one.record.hemisphere_rays
    assert four.record.source_rays["horizon"] == ROUNDS * one.record.source_rays["horizon"] > 0
    assert four.record.degrees_of_freedom["diffuse"] == ROUNDS * 3


def test_replicates_side_by_side_state_the_variance_of_the_mean():
    """χ² of 3 K degrees of freedom: mean and variance of the estimate, also where replicates are added up."""
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
    rounds = [trace_forward(scene, SUNS, replace(request, seed=seed_of_round(0, k)), silent) for k in range(3)]
    whole = merge_all(rounds)
    variance = np.mean([one.diffuse_relative_standard_error**2 for one in rounds], axis=0) / 3
    assert whole.diffuse_relative_standard_error**2 == pytest.approx(variance, rel=1e-9)
    assert whole.record.photons["sky"]["emitted"] == sum(one.record.photons["sky"]["emitted"] for one in rounds)


def test_rounds_of_different_suns_are_refused():
    scene = three_houses()
    one = trace_gather(scene, SUNS, REQUEST, silent)
    turned = replace(SUNS, direction=SUNS.direction * [-1, 1, 1])
    with pytest.raises(InputError, match="of another scene"):
        merge_all([one, trace_gather(scene, turned, REQUEST, silent)])
