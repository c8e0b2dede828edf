"""Houses that float above the ground as it is drawn: light comes in below, or does not, for both
estimators alike.
"""

import numpy as np
import pytest
from test_hollows import both_estimators
from test_slabs_and_sheets import PLAIN, assert_light, scene_of, sheet, sheets_of
from thorough import mark_cases
from towns import box

BELOW = sheet([-4, -3, 0], [8, 0, 0], [0, 6, 0])  # the ground under the house, a surface of its own
AROUND = [
    *sheet([-30, -30, 0], [60, 0, 0], [0, 27, 0]),
    *sheet([-30, 3, 0], [60, 0, 0], [0, 27, 0]),
    *sheet([-30, -3, 0], [26, 0, 0], [0, 6, 0]),
    *sheet([4, -3, 0], [26, 0, 0], [0, 6, 0]),
]


def house(floor):
    """8 × 6 × 10 m, closed; the second of its faces is the floor."""
    top, bottom, *walls = box((-4, -3, floor), (4, 3, floor + 10))
    return [top, bottom, *walls]


@pytest.mark.slow
def test_below_a_house_that_floats_it_is_as_light_as_paths_say():
    """The ground under it, its floor and its south wall, for the isotropic sky."""
    assert_light(scene_of(house(1.0), plain=[*BELOW, *AROUND]), [0, 6, 7], [])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("floor", "dark"), mark_cases([(0.0, True), (0.4, True), (2.0, False)], kept=1)
)
def test_gather_is_forward_at_a_house(floor, dark):
    """Diffuse and direct light of its walls and floor, and of the ground under it. Up to half a
    metre is how inaccurately houses are drawn on the ground: nothing passes below them."""
    scene = scene_of(house(floor), plain=[*BELOW, *AROUND])
    assert (scene.footprint[scene.triangle_surface == 6] == dark).all() and not sheets_of(scene)
    gather, stated, forward, error = both_estimators(scene, photons=250 if dark else 500)
    for light in (gather, forward):
        assert not light[:, 6].any() if dark else (light[:, [0, 6]] > 0.02).all()
    assert (np.abs(gather - forward) < 4.5 * np.hypot(stated, error) + 1e-3).all()


def test_a_house_beyond_its_ground_stands_as_it_did():
    """No ground is known under part of it, or under all of it: the floor is a footprint."""
    assert scene_of(house(2.0), plain=sheet([0, -30, 0], [30, 0, 0], [0, 60, 0])).footprint.any()
    assert scene_of(house(2.0), plain=None).footprint.any()
    laid = scene_of(house(2.0), plain=PLAIN, ground="feet")
    assert laid.footprint[
        np.isin(laid.triangle_surface, np.flatnonzero(laid.surfaces.kind == "downward"))
    ].all()
