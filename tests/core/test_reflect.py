"""Reflections against powers of the whole matrix."""

from functools import partial

import numpy as np
import pytest
from scipy import sparse
from thorough import mark_cases

from citypv.core.effects.rays import LIMITS
from citypv.core.light.form_factor_products import multiply
from citypv.core.light.form_factors import FormFactors, Rows, leave_rows
from citypv.core.light.solve_radiosity import find_bounces, solve_radiosity, sum_reflections

PATCHES, CELLS, REPLICATES, RAYS = 300, 16, 4, 50


def random_form_factors(generator):
    """Patches 0 to 199 with rays that meet any patch, in two parts; the others meet nothing."""
    rows = []
    for first in (0, 100):
        keys = np.sort(
            generator.integers(0, PATCHES * CELLS * REPLICATES, (100, RAYS)).astype(np.int32),
            axis=1,
        )
        start = np.arange(101) * RAYS
        rows.append(Rows(np.arange(first, first + 100), start, keys.ravel(), 64))
    return FormFactors([rows], PATCHES, CELLS, np.repeat([64, 0], [200, 100]))


@pytest.mark.parametrize(
    ("sources", "bounces"),
    mark_cases([(1, 0), (7, 1), (33, 2), (1, 3), (7, 4), (33, 5), (1, 2), (7, 0)], kept=3),
)
def test_any_number_of_bounces(sources, bounces):
    """The sum of E₁ = F (ρ ∘ E₀) + far and E_{n+1} = F (ρ ∘ E_n)."""
    generator = np.random.default_rng(1000 * sources + bounces)
    form_factors = random_form_factors(generator)
    first, far = generator.random((2, PATCHES, sources)).astype(np.float32)
    factor = generator.random(PATCHES).astype(np.float32)
    matrix = (
        form_factors.as_matrix()
        .toarray()
        .reshape(PATCHES, REPLICATES, PATCHES)
        .mean(axis=1)
        .astype(float)
    )
    light = [first.astype(float)]
    for bounce in range(bounces):
        light.append(matrix @ (factor[:, None] * light[-1]) + (far if bounce == 0 else 0))
    whole = np.sum(light[1:], axis=0) if bounces else np.zeros_like(first)
    assert solve_radiosity(form_factors, factor, first, far, bounces) == pytest.approx(
        whole, rel=1e-5, abs=1e-6
    )


@pytest.mark.parametrize("sources", [1, 5])
def test_cells_hand_on_each_by_its_own_factor(sources):
    """What a cell sends is its factor times the light of its patch."""
    generator = np.random.default_rng(sources)
    form_factors = random_form_factors(generator)
    arriving = generator.random((PATCHES, sources)).astype(np.float32)
    factor = generator.random((PATCHES, CELLS)).astype(np.float32)
    second = np.zeros((PATCHES, sources))
    for rows in form_factors.rows:
        patch, cell = np.divmod(rows.key // REPLICATES, CELLS)
        sent = factor[patch, cell][:, None] * arriving[patch].astype(float) / (64 * REPLICATES)
        np.add.at(second, np.repeat(rows.chosen, RAYS), sent)
    reflected = sum_reflections(partial(multiply, form_factors, factor), arriving.copy(), 2)
    assert reflected == pytest.approx(arriving + second, rel=1e-5)


@pytest.mark.slow
def test_rays_of_further_rounds_count_as_those_of_one():
    """A patch with rays of two rounds has the mean of both; the others stay as they are."""
    generator = np.random.default_rng(3)
    form_factors, other = random_form_factors(generator), random_form_factors(generator)
    before, after = (one.as_matrix().toarray() for one in (form_factors, other))
    whole = FormFactors([[]], PATCHES, CELLS, np.zeros(PATCHES, int))
    for rows in form_factors.rows:
        whole.put(rows)
    whole.rounds.append([])
    new = leave_rows(other.rows[0], np.arange(100) % 3 == 0)
    whole.put(new)
    taken = np.repeat(np.isin(np.arange(PATCHES), new.chosen), REPLICATES)
    mean = np.where(taken[:, None], (before + after) / 2, before)
    assert whole.as_matrix().toarray() == pytest.approx(mean, abs=1e-7)
    factor, light = (
        generator.random((PATCHES, CELLS)).astype(np.float32),
        np.ones((PATCHES, 2), np.float32),
    )
    products = [multiply(one, factor, light) for one in (whole, form_factors, other)]
    mean = np.where(taken[::REPLICATES, None], (products[1] + products[2]) / 2, products[1])
    assert products[0] == pytest.approx(mean, rel=1e-5)


def test_reflections_end_at_the_residual():
    """Of a room in which every ray hits: E_n = ρⁿ, so ρⁿ⁺¹ of the light is left, and its ratio is ρ
    at once.
    """
    rows = Rows(
        np.arange(2),
        256 * np.arange(3),
        np.repeat([CELLS * REPLICATES, 0], 256).astype(np.int32),
        64,
    )
    form_factors = FormFactors([[rows]], 2, CELLS, np.full(2, 64))
    grey, white = (
        partial(multiply, form_factors, np.full((2, CELLS), albedo, np.float32))
        for albedo in (0.5, 1)
    )
    groups, light = sparse.csr_matrix([[1.0, 0], [1.0, 1.0]]), np.full((2, 1), 0.5, np.float32)
    count, left = find_bounces(grey, light, groups, groups @ np.ones((2, 1)))
    assert count == 8
    assert (
        find_bounces(white, 2 * light, groups, groups @ np.ones((2, 1)))[0] == LIMITS.bounces
    )  # none is enough
    assert left == pytest.approx(0.5**9 / (1 - 0.5**9), rel=1e-4)
