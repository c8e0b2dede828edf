"""A town of 91,764 triangles against a reference traced with another engine (Mitsuba 3) to a noise of 0.0004."""

from pathlib import Path

import numpy as np
import pytest
from citypv.core.light.trace_transfer import trace_transfer
from citypv.core.progress import silent
from citypv.core.request import Request
from scenes import scene_of_triangles, suns_towards

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

    # The reported standard errors are of the size of the errors: half of them lie within the quartile of Student's t
    # with three degrees of freedom (0.765), give or take what patches add.
    error = transfer.diffuse_relative_standard_error[chosen]
    noisy = error > 0
    assert 0.6 < np.median(np.abs(diffuse[noisy]) / error[noisy]) < 0.95
