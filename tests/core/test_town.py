"""A town of 91,764 triangles against a reference traced with another engine (Mitsuba 3) to a noise
of 0.0004.
"""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scenes import rms, scene_of_triangles, suns_towards
from scipy import stats
from test_closed_forms import direct_relative

from citypv.core.light.trace_gather import trace_gather
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request

ERRORS_KNOWN = 1e-4  # a surface whose error is below it has met no noise yet
# above it the error is that of the shadow points, below it more and more that of reflections
SHADOWS_MATTER = 1e-3
TOWN = Path(__file__).parents[1] / "data" / "town.npz"


@cache
def traced_town(samples):
    """The town's arrays, the scene and the Transfer of one trace."""
    town = np.load(TOWN)
    scene = scene_of_triangles(town["vertices"], town["triangles"])
    request = Request(samples=samples, shadow_samples=16, far_ground=False)
    return town, scene, trace_gather(scene, suns_towards(town["sun"]), request, silent)


def diffuse_difference(town, transfer):
    """Estimate less reference, (3000,)."""
    return transfer.diffuse_relative[town["triangle"]] - (
        town["diffuse"] + town["diffuse_reflected"]
    )


def spread(values, freedom):
    """Spread of values over that of Student's t: by six quantiles of their sizes and, where t has
    one, by rms.
    """
    shares = np.array([0.5, 0.683, 0.8, 0.9, 0.95, 0.99])
    by_quantiles = np.quantile(np.abs(values), shares) / stats.t.ppf((1 + shares) / 2, freedom)
    return np.append(by_quantiles, rms(values) / stats.t.std(freedom))


@pytest.mark.thorough
@pytest.mark.slow
def test_town():
    town, scene, transfer = traced_town(256)
    chosen = town["triangle"]
    cosine = np.maximum(scene.surfaces.normal[chosen] @ town["sun"].T, 0)
    assert rms(cosine * transfer.visible_share[chosen] - town["direct"]) <= 0.0118
    reflected = transfer.direct_reflected[chosen] - town["direct_reflected"]
    assert rms(reflected) <= 0.0033
    assert abs(reflected.sum() / town["direct_reflected"].sum()) <= 0.008
    assert rms(diffuse_difference(town, transfer)) <= 0.0120


@pytest.mark.slow
def test_diffuse_errors_follow_student_s_t():
    """With the three degrees of freedom of four replicates, where there is noise."""
    town, _, transfer = traced_town(64)
    chosen = town["triangle"]
    error = transfer.diffuse_relative_standard_error[chosen]
    clear = error > ERRORS_KNOWN
    assert clear.sum() > 2900
    steps = diffuse_difference(town, transfer)[clear] / error[clear]
    assert stats.kstest(steps, "t", args=(3,)).pvalue > 0.01


@pytest.mark.slow
def test_direct_errors_are_conservative():
    """Over the mean of all suns; the reference's own noise is then 0.0004/√143 and counts for
    nothing.

    Sixteen cells make eight pairs. Where the shadow points make the error it has at most eight
    degrees of freedom, and the narrowest t to hold it against is that of eight. Pairs of unequal
    spread and the four replicates of the reflected part have fewer, four in the median
    (Satterthwaite's formula).
    """
    town, _, transfer = traced_town(64)
    chosen = town["triangle"]
    known = (town["direct"].astype(float) + town["direct_reflected"]).mean(axis=1)
    difference = (direct_relative(transfer) @ transfer.suns.weight)[chosen] - known
    error = transfer.direct_annual_standard_error[chosen]
    clear = error > ERRORS_KNOWN
    shadows = clear & (error > SHADOWS_MATTER)
    partly = clear & (transfer.covered_share[chosen] > 0)
    assert partly.sum() > 200
    assert np.quantile(np.abs(difference[partly] / error[partly]), 0.99) <= 1.10 * stats.t.ppf(
        0.995, 8
    )
    for members, freedom in ((shadows, 8), (clear, 4)):
        assert members.sum() > 2000
        found = spread(difference[members] / error[members], freedom)
        assert found.max() <= 1.10, found
        assert found.min() >= 0.6, found  # twice as large as need be, it would be no error any more
