"""What is covered is geometry: it does not depend on how a run looks at it."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from real_cities import SUNS
from towns import boxes

from citypv.core.light.measure_cover import measure_cover
from citypv.core.light.trace_gather import trace_gather
from citypv.core.photons.trace_forward import trace_forward
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request

ROW = [  # houses that touch, each set back and of another height, so that neighbours cover corners of walls [m]
    ((11 * k, 1.3 * (k * 5 % 7), 0), (11 * k + 11, 9 + 1.7 * (k * 3 % 5), 7 + 2.9 * (k * 4 % 9))) for k in range(14)
]
ON_ROOFS = [  # chimneys and a penthouse
    ((11 * k + 4, 5.1, 7 + 2.9 * (k * 4 % 9)), (11 * k + 4 + size, 5.1 + size, 9 + 2.9 * (k * 4 % 9)))
    for k, size in ((1, 0.8), (3, 1.1), (4, 0.6), (6, 2.9), (9, 0.9), (12, 1.6))
]


@cache
def scene_of_row():
    return boxes(ROW + ON_ROOFS)


@cache
def covered_by_default():
    return covered_share(trace_gather)


def covered_share(trace, **settings):
    settings = {"samples": 64, "max_bounces": 1, "shadow_samples": 4, **settings}
    return trace(scene_of_row(), SUNS, Request(**settings), silent).covered_share


@pytest.mark.parametrize("settings", [
    *({"seed": seed} for seed in (1, 2, 3)), {"samples": 4}, {"samples": 1024}, {"threads": 2}, {"report": "all"},
    {"max_bounces": 0}, {"effects": {"sky-rays": True}},
])  # fmt: skip
def test_the_covered_share_does_not_depend_on_rays(settings):
    """The same to the last bit: cells are examined by rays that are the same in every run."""
    found = covered_share(trace_gather, **settings)
    partly = (found > 0) & (found < 1)
    assert partly.sum() > 20
    np.testing.assert_array_equal(found, covered_by_default())


def test_both_estimators_and_the_report_use_the_same_shares():
    """Photons, and `citypv inspect`, which traces nothing else."""
    np.testing.assert_array_equal(covered_share(trace_forward, samples=8, seed=3), covered_by_default())
    np.testing.assert_array_equal(measure_cover(scene_of_row()), covered_by_default())


def test_the_covered_share_is_that_of_the_boxes():
    """East walls that the next house hides in part: area of the overlap over that of the wall, to a cell of a patch."""
    found, error = covered_by_default(), []
    for k, (one, other) in enumerate(pairwise(ROW)):
        (_, y0, _), (_, y1, z1) = one
        (_, v0, _), (_, v1, w1) = other
        hidden = (min(y1, v1) - max(y0, v0)) * min(z1, w1) / ((y1 - y0) * z1)
        east = 6 * k + 3
        assert scene_of_row().surfaces.orientation[east] == "east"
        error.append(found[east] - hidden)
    assert np.abs(error).max() < 0.05
    assert abs(np.mean(error)) < 0.01
