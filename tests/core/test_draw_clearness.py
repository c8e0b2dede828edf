"""The distributions that the built-in climate draws its days from, against their closed forms."""

import numpy as np
import pytest

from citypv.core.weather.draw_clearness import (
    draw_days,
    draw_normals,
    exponential_quantile,
    rank_days,
    scale_to_sums,
    solve_exponential,
)


def test_the_exponential_distribution_has_its_mean():
    # Mean of exp(γx) on 0 to 1: 1/(1 - exp(-γ)) - 1/γ; 0.58198 for γ = 1.
    assert solve_exponential(np.array([0.581976706869, 0.5, 0.418023293131])) == pytest.approx([1, 0, -1], abs=1e-7)
    quantile = (np.arange(10000) + 0.5) / 10000
    for mean in (0.1, 0.3, 0.5, 0.7, 0.9):
        assert exponential_quantile(solve_exponential(np.array(mean)), quantile).mean() == pytest.approx(mean, abs=1e-4)


@pytest.mark.once
def test_days_spread_as_bendt_has_it():
    """The share of days below a clearness index against Bendt's formula with γ of Herzog's fit."""
    month = np.repeat(np.arange(12), 400)
    quantile = rank_days(draw_normals(0, (4800,)), month)
    mean, least, largest = np.full((1, 12), 0.5), 0.05, 0.7
    days = draw_days(mean, np.full((1, 4800), largest), quantile, month)[0]
    assert days.mean() == pytest.approx(0.5, abs=0.002)
    xi = (largest - least) / (largest - 0.5)
    gamma = -1.498 + (1.184 * xi - 27.182 * np.exp(-1.5 * xi)) / (largest - least)
    for index in (0.2, 0.3, 0.4, 0.5, 0.6):
        below = (np.exp(gamma * least) - np.exp(gamma * index)) / (np.exp(gamma * least) - np.exp(gamma * largest))
        assert (days < index).mean() == pytest.approx(below, abs=0.02)


def test_days_follow_each_other_as_graham_has_it():
    quantile = rank_days(draw_normals(1, (36500,)), np.zeros(36500, int))
    assert np.corrcoef(quantile[1:], quantile[:-1])[0, 1] == pytest.approx(0.28, abs=0.02)  # 0.29 of normal numbers
    np.testing.assert_allclose(np.sort(quantile), (np.arange(36500) + 0.5) / 36500)


@pytest.mark.once
def test_normal_numbers_are_normal():
    drawn = draw_normals(7, (200_000,))
    assert drawn.mean() == pytest.approx(0, abs=4 / np.sqrt(200_000))
    assert drawn.std() == pytest.approx(1, abs=0.01)
    assert not np.array_equal(drawn[:100], draw_normals(8, (100,)))
    np.testing.assert_array_equal(draw_normals(-3, (5,)), draw_normals(-3, (5,)))


@pytest.mark.once
def test_sums_are_met_below_the_ceiling():
    rng = np.random.default_rng(0)
    clearness, outside = rng.uniform(0, 0.8, (3, 48)), np.ones((3, 48))
    scaled = scale_to_sums(clearness, np.full((3, 48), 0.75), outside, np.array([[5.0, 17.9]] * 3), np.array([0, 24]))
    np.testing.assert_allclose(np.add.reduceat(scaled, [0, 24], axis=1), [[5.0, 17.9]] * 3, rtol=1e-9)
    assert scaled.max() <= 0.75
