"""Houses that float above the ground as it is drawn: light comes in below, or does not, for both estimators alike."""

import numpy as np
import pytest
from test_hollows import both_estimators
from test_orientation import bowl
from test_slabs_and_sheets import PLAIN, assert_light, scene_of, sheet, sheets_of
from towns import box, city_of_polygons

from citypv.core.city.build_scene import build_scene

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


def over_a_bowl(floor):
    """Scene of the house over a bowl of 96 faces, which is the only ground; its floor is 97."""
    sheet, body = bowl(), house(floor)
    thematic = ["TINRelief"] * len(sheet) + [""] * len(body)
    city = city_of_polygons([*sheet, *body], thematic, [0] * len(sheet) + [1] * len(body))
    return build_scene(city, 52.5, 13.4, ground="none", patch_size=4.0)


@pytest.mark.slow
@pytest.mark.parametrize("floor", [1.0, 2.0])
def test_below_a_house_that_floats_it_is_as_light_as_paths_say(floor):
    """The ground under it, its floor and its south wall, for the isotropic sky."""
    scene = scene_of(house(floor), plain=[*BELOW, *AROUND])
    assert not scene.footprint.any() and not sheets_of(scene)
    assert_light(scene, [0, 6, 7], [])


@pytest.mark.slow
@pytest.mark.parametrize(("ground", "floor"), [("plain", 1.0), pytest.param("bowl", 2.0, marks=pytest.mark.thorough)])
def test_gather_is_forward_below_a_house_that_floats(ground, floor):
    """Diffuse and direct light of the ground under it, of its floor and its walls."""
    scene = over_a_bowl(floor) if ground == "bowl" else scene_of(house(floor), plain=[*BELOW, *AROUND])
    gather, stated, forward, error = both_estimators(scene)
    under = np.flatnonzero(scene.surfaces.kind == "downward")
    steps = np.abs(gather - forward) / np.maximum(np.hypot(stated, error), 1e-3)
    area = scene.surfaces.area[: under[0] - 1] / scene.surfaces.area[: under[0] - 1].sum()
    whole = (gather - forward)[:, : under[0] - 1] @ area
    assert (np.abs(whole) < 0.004 * (forward[:, : under[0] - 1] @ area)).all()
    assert (forward[:, under] > 0.02).all()
    assert steps[:, under].max() < 4.5 and steps[:, under[0] + 1 :].max() < 4.5
    if ground == "plain":
        assert steps[:, 0].max() < 4.5


@pytest.mark.slow
@pytest.mark.parametrize("floor", [0.0, 0.4])
def test_what_stands_is_dark_below_for_both(floor):
    """Up to half a metre is how inaccurately houses are drawn on the ground: nothing passes below them."""
    scene = scene_of(house(floor), plain=[*BELOW, *AROUND])
    assert scene.footprint[scene.triangle_surface == 6].all()
    gather, stated, forward, error = both_estimators(scene, photons=250)
    assert not gather[:, 6].any() and not forward[:, 6].any()
    assert (np.abs(gather - forward)[:, 7:] < 4.5 * np.hypot(stated, error)[:, 7:] + 1e-3).all()


def test_a_house_beyond_its_ground_stands_as_it_did():
    """No ground is known under part of it, or under all of it: the floor is a footprint."""
    assert scene_of(house(2.0), plain=sheet([0, -30, 0], [30, 0, 0], [0, 60, 0])).footprint.any()
    assert scene_of(house(2.0), plain=None).footprint.any()
    laid = scene_of(house(2.0), plain=PLAIN, ground="feet")
    assert laid.footprint[np.isin(laid.triangle_surface, np.flatnonzero(laid.surfaces.kind == "downward"))].all()
