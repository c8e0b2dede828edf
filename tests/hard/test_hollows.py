"""Gather and forward agree in hollows: a valley and a bowl drawn as one object, and under balconies and arcades."""

import numpy as np
import pytest
from real_cities import SUNS
from scenes import run_forward, run_gather
from scipy import stats
from test_closed_forms import direct_relative
from test_narrow_gaps import light_by_gather, light_by_paths
from test_orientation import bowl, valley
from towns import box, boxes, city_of_polygons

from citypv.core.city.build_scene import build_scene

pytestmark = pytest.mark.slow

HOLLOWS = {  # faces of the sheet, and what stands in it
    "valley with sides of 10 %": (valley(), box((-5, -5, 0.6), (5, 5, 10.6))),
    "bowl 60 m wide": (bowl(), []),
    "valley with sides of 100 %": (valley(slope=1.0), []),
}
THOROUGH = [pytest.param(name, marks=pytest.mark.thorough) for name in list(HOLLOWS)[1:]]


def hollow(name):
    """Scene of a sheet that looks up, surfaces first, and a house; without any other ground."""
    sheet, house = HOLLOWS[name]
    building = [0] * len(sheet) + [1] * len(house)
    thematic = ["TINRelief"] * len(sheet) + [""] * len(house)
    city = city_of_polygons([*sheet, *house], thematic, building)
    return build_scene(city, 52.5, 13.4, ground="none", patch_size=4.0), len(sheet)


def both_estimators(scene, photons=1000, rays=512):
    """Diffuse and annual direct light of the surfaces, and stated errors, by gather and by forward: four (2, n)."""
    found = []
    for run, samples in ((run_gather, rays), (run_forward, photons)):
        transfer = run(scene, SUNS, samples=samples)
        found.append(np.stack([transfer.diffuse_relative, direct_relative(transfer) @ SUNS.weight]))
        found.append(np.stack([transfer.diffuse_relative_standard_error, transfer.direct_annual_standard_error]))
    return found


@pytest.mark.parametrize("name", [next(iter(HOLLOWS)), *THOROUGH])
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
    # One case in a thousand is further apart; errors from few replicates scatter by themselves (Student's t: 1.07).
    assert np.sqrt((steps**2).mean()) < 1.07 * np.sqrt(stats.chi2.ppf(0.999, steps.size) / steps.size)
    assert (np.abs(whole) < 0.004 * (forward[:, :count] @ area)).all()
    assert (stated[:, :count] < 0.02).all()  # it says something: without reflections 0.01 to 0.1 would be missing


def balconies():
    """A house with a slab of 3 × 1.5 m, 3 m up, and one of 6 × 2 m above it: undersides 7 and 13."""
    return boxes([((0, 0, 0), (12, 10, 12)), ((4, -1.5, 3), (7, 0, 3.2)), ((3, -2, 6), (9, 0, 6.2))], whole=True)


def arcade():
    """An upper storey that stands out by 3 m on two posts, 4 m up: its underside is 7."""
    posts = [((x, -3, 0), (x + 0.5, -2.5, 4)) for x in (0, 19.5)]
    return boxes([((0, 0, 0), (20, 10, 14)), ((0, -3, 4), (20, 0, 14)), *posts], whole=True)


UNDERSIDES = {"balcony of 6 m": (balconies, 13), "arcade": (arcade, 7)}


@pytest.mark.parametrize("name", UNDERSIDES)
def test_the_underside_says_how_far_it_is_off(name):
    """Patches of 10 m, compared with paths followed one by one: within twice the stated error, which is not vast."""
    make, surface = UNDERSIDES[name]
    scene = make()
    assert scene.surfaces.kind[surface] == "downward" and scene.surfaces.surface_tilt[surface] == pytest.approx(180)
    light, stated = light_by_gather(scene, surface)
    known, error = light_by_paths(scene, surface)
    assert (np.abs(light - known) < 2 * np.hypot(stated, error)).all()
    assert (stated < 0.6 * known).all()
