"""Sobol's points against those of scipy, and against what makes them a net."""

import itertools

import numpy as np
import pytest
from scipy.stats import qmc

from citypv.core.light.sobol_points import sobol_points


@pytest.mark.parametrize("count", [1, 8, 64, 4096])
def test_points_are_scipy_s(count):
    """Scipy numbers them by Gray's code, so 2^k of them are the same set."""
    ours, theirs = sobol_points(count, 4), qmc.Sobol(4, scramble=False).random(count)
    assert ours.dtype == np.float32
    assert np.array_equal(ours[np.lexsort(ours.T)], theirs[np.lexsort(theirs.T)].astype(np.float32))


@pytest.mark.parametrize("axis", range(4))
def test_every_slice_holds_one(axis):
    assert np.array_equal(np.sort(sobol_points(256, 4)[:, axis]), np.arange(256) / np.float32(256))


@pytest.mark.parametrize("axes", list(itertools.combinations(range(3), 2)))
def test_every_cell_of_the_square_holds_its_share(axes):
    """Of 4,096 points every box of 2^-a by 2^-b holds 2^(12 - a - b), for a + b up to 9."""
    points = sobol_points(4096, 4)[:, list(axes)]
    for a in range(10):
        place = np.floor(points * [1 << a, 1 << (9 - a)]).astype(int)
        assert (np.bincount(place[:, 0] * (1 << (9 - a)) + place[:, 1], minlength=512) == 8).all()
