"""A town of 91,764 triangles against a reference traced with another engine (Mitsuba 3) to a noise of 0.0004."""

from pathlib import Path

import numpy as np
import pytest
from scenes import scene_of_triangles, suns_towards
from scipy import stats

from citypv.core.light.trace_transfer import trace_transfer
from citypv.core.progress import silent
from citypv.core.request import Request

TOWN = Path(__file__).parents[1] / "data" / "town.npz"


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.slow
def test_town():
    town = np.load(TOWN)
    scene = scene_of_triangles(town["vertices"], town["triangles"])
    request = Request(samples=256, shadow_samples=16, far_ground=False)
    transfer = trace_transfer(scene, suns_towards(town["sun"]), request, silent)
    chosen = town["triangle"]
    cosine = np.maximum(scene.surfaces.normal[chosen] @ town["sun"].T, 0)
    assert rms(cosine * transfer.visible_share[chosen] - town["direct"]) <= 0.0145
    reflected = transfer.direct_reflected[chosen] - town["direct_reflected"]
    assert rms(reflected) <= 0.0045
    assert abs(reflected.sum() / town["direct_reflected"].sum()) <= 0.008
    diffuse = transfer.diffuse_relative[chosen] - (town["diffuse"] + town["diffuse_reflected"])
    assert rms(diffuse) <= 0.0145

    # Errors over their standard errors follow Student's t with the three degrees of freedom of four replicates, where
    # there is noise and no share of a patch is guessed to be covered.
    error = transfer.diffuse_relative_standard_error[chosen]
    clear = (error > 1e-4) & (transfer.covered_share[chosen] == 0)
    assert clear.sum() > 2000
    assert stats.kstest(diffuse[clear] / error[clear], "t", args=(3,)).pvalue > 0.01
