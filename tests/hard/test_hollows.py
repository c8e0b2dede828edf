"""Gather and forward agree in hollows: a valley and a bowl drawn as one object."""

import numpy as np
import pytest
from real_cities import SUNS
from scenes import run_forward, run_gather
from scipy import stats
from test_closed_forms import direct_relative
from test_orientation import bowl, valley
from towns import box, city_of_polygons

from citypv.core.city.build_scene import build_scene

pytestmark = pytest.mark.slow

HOLLOWS = {  # faces of the sheet, and what stands in it
    "valley with sides of 10 %": (valley(), box((-5, -5, 0.6), (5, 5, 10.6))),
    "bowl 60 m wide": (bowl(), []),
    "valley with sides of 100 %": (valley(slope=1.0), []),
}


def hollow(name):
    """Scene of a sheet that looks up, surfaces first, and a house; without any other ground."""
    sheet, house = HOLLOWS[name]
    building = [0] * len(sheet) + [1] * len(house)
    thematic = ["TINRelief"] * len(sheet) + [""] * len(house)
    city = city_of_polygons([*sheet, *house], thematic, building)
    return build_scene(city, 52.5, 13.4, ground="none", patch_size=4.0), len(sheet)


def both_estimators(scene, photons=1000, rays=512):
    """Diffuse and annual direct light of the surfaces, and stated errors, by gather and by forward:
    four (2, n).
    """
    found = []
    for run, samples in ((run_gather, rays), (run_forward, photons)):
        transfer = run(scene, SUNS, samples=samples)
        found.append(np.stack([transfer.diffuse_relative, direct_relative(transfer) @ SUNS.weight]))
        found.append(
            np.stack(
                [transfer.diffuse_relative_standard_error, transfer.direct_annual_standard_error]
            )
        )
    return found


@pytest.mark.thorough
@pytest.mark.parametrize("name", HOLLOWS)
def test_gather_is_forward_in_a_hollow(name):
    """Surface by surface, and all of the sheet together, in stated errors."""
    scene, count = hollow(name)
    gather, stated, forward, error = both_estimators(scene)
    lit = scene.surfaces.kind != "downward"
    apart, both = (gather - forward)[:, lit], np.hypot(stated, error)[:, lit]
    steps = apart / np.maximum(both, 1e-4)
    area = scene.surfaces.area[:count] / scene.surfaces.area[:count].sum()
    whole = (gather - forward)[:, :count] @ area
    assert np.abs(steps).max() < 4.5
    # One case in a thousand is further apart; errors from few replicates scatter by themselves
    # (Student's t: 1.07).
    assert np.sqrt((steps**2).mean()) < 1.07 * np.sqrt(
        stats.chi2.ppf(0.999, steps.size) / steps.size
    )
    assert (np.abs(whole) < 0.004 * (forward[:, :count] @ area)).all()
    assert (
        stated[:, :count] < 0.02
    ).all()  # it says something: without reflections 0.01 to 0.1 would be missing
