"""Which faces are sheets, lit on both sides, and which footprints keep the ground below
them dark.
"""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from own_rays import BACK, OwnRays
from test_slabs_and_sheets import HOUSE, PLAIN, ROOT, UNDER, scene_of, sheet, sheets_of
from towns import box, city_of_polygons

from citypv.core.city.build_scene import build_scene
from citypv.core.city.terrain import Layer, Terrain
from citypv.core.patches.patches import Patches
from citypv.core.read.read_city import read_city


@pytest.mark.parametrize("missing", range(7))
def test_what_encloses_is_no_sheet(missing):
    """A house, one with a face missing, one face of it turned; the whole is judged the same in
    another order.
    """
    faces = [face for number, face in enumerate(HOUSE) if number != missing]
    scene = scene_of(faces, box((5, 0, 0), (12, 8, 5)))
    assert not scene.sheet.any()
    turned = [face[::-1] if number == 0 else face for number, face in enumerate(faces)]
    assert not scene_of(turned).sheet.any()


OTHERS = {
    "hall without a floor": box((-20, -20, 0), (20, 20, 5))[:1]
    + box((-20, -20, 0), (20, 20, 5))[2:],
    "room drawn from inside": [face[::-1] for face in box((-5, -5, 0), (5, 5, 5))],
    "cladding": HOUSE + sheet([-4, -0.1, 1], [8, 0, 0], [0, 0, 6]),
    "storeys in a house": HOUSE + sheet([-5, 0, 3], [10, 0, 0], [0, 8, 0]),
    "sheet on the ground": HOUSE + sheet([-4, -8, 0.05], [8, 0, 0], [0, 6, 0]),
}


@pytest.mark.parametrize("name", OTHERS)
def test_what_is_no_sheet_either(name):
    assert not scene_of(OTHERS[name]).sheet.any()


def test_ground_without_a_name_is_no_sheet():
    """A valley with sides of 45°: from below the sky is seen beyond its rim."""
    valley = sheet([-30, 0, 0], [60, 0, 0], [0, 30, 30]) + sheet(
        [-30, -30, 30], [60, 0, 0], [0, 30, -30]
    )
    houses = [box((x, -3, -2), (x + 6, 3, 9)) for x in (-20, 0, 14)]
    assert not scene_of(valley, *houses, plain=None).sheet.any()


def test_sheets_are_the_same_in_any_order():
    objects = [
        HOUSE,
        *(part for name in ("sail", "billboard above ground") for part in UNDER[name][0][1:]),
    ]
    scene = scene_of(*objects)
    polygons = [face for part in [PLAIN, *objects] for face in part]
    building = [number for number, part in enumerate([PLAIN, *objects]) for _ in part]
    order = np.random.default_rng(5).permutation(len(polygons))
    thematic = np.where(order == 0, "TINRelief", "").tolist()
    city = city_of_polygons([polygons[k] for k in order], thematic, [building[k] for k in order])
    again = build_scene(city, 52.5, 13.4, ground="none", patch_size=4.0)
    assert sheets_of(scene) == sorted(order[sheets_of(again)].tolist()) == [7, 8]


HANGING = {
    "slab": box((-8, -12, 3), (8, -2, 3.3)),
    "slab far away": box((12, -12, 3), (20, -2, 3.3)),
    "carport that looks down": sheet([-3, -7, 2.5], [0, 6, 0], [6, 0, 0]),
    "billboard": sheet([-3, -12, 4], [6, 0, 0], [0, 0, 3]),
}


@pytest.mark.parametrize(
    ("name", "given"), list(product(HANGING, ("nothing", "a plain", "terrain")))[::2]
)
def test_the_ground_goes_on_below_what_hangs(name, given):
    """It does not climb to it, and no wall is carried down to it: rays from below the thing meet
    ground at 0 m.
    """
    terrain = None
    if given == "terrain":
        corners = np.array([[-90, -90, 0], [90, -90, 0], [90, 90, 0], [-90, 90, 0]], float)
        terrain = Terrain("here", [Layer(corners, np.array([[0, 1, 2], [0, 2, 3]]))], [])
    scene = scene_of(
        HOUSE,
        HANGING[name],
        plain=PLAIN if given == "a plain" else None,
        ground="auto",
        terrain=terrain,
    )
    laid = (scene.triangle_surface < 0) & ~scene.footprint
    # The scene's origin lies at the middle of its bounds; its lowest point is the ground.
    assert scene.vertices[scene.triangles[laid]][..., 2].max() < 0.01
    lowest = len(scene.surfaces) - len(HANGING[name])
    assert not scene.footprint[scene.triangle_surface >= lowest].any()


@pytest.mark.slow
def test_what_rests_stays_a_footprint():
    """Towers on a podium, one drawn 0.3 m too high; a slab on the ground; a house on an embankment
    of 2 m.
    """
    podium, tower = box((-10, -10, 0), (10, 10, 4)), box((-4, -4, 4), (4, 4, 20))
    high, slab = box((5, 5, 4.3), (9, 9, 20)), box((-25, -8, 0), (-15, 2, 0.3))
    for ground in ("none", "auto"):
        scene = scene_of(podium, tower, high, slab, ground=ground)
        floors = scene.surfaces.kind[scene.triangle_surface] == "downward"
        assert scene.footprint[floors & (scene.triangle_surface >= 0)].all()
        assert not scene.sheet.any()


@pytest.mark.slow
def test_footprints_and_sheets_of_real_files():
    """Berlin has none of either that hangs. Four boards stand free in a tile of North
    Rhine-Westphalia, 22 m².
    """
    scene = build_scene(read_city([ROOT / "tests/data/citygml/nrw_LoD2_32_280_5659_1_NW.gml.gz"]))
    found = sheets_of(scene)
    assert len(found) == 4 and scene.surfaces.area[found].sum() == pytest.approx(22, abs=0.5)
    # From behind they see hardly any back: rays of the test's own from reversed triangles.
    rows = np.flatnonzero(scene.sheet)
    turned = replace(scene, triangles=scene.triangles.copy(), sheet=None)
    turned.triangles[rows] = turned.triangles[rows][:, ::-1]
    own = OwnRays(turned, Patches.of_scene(turned, np.zeros(len(turned.triangles)), 0).offset)
    assert own.shares(rows, 64, 16, np.random.default_rng(1))[..., BACK].mean(axis=1).max() < 0.4
    assert any("without thickness" in note for note in scene.report.notes)


@pytest.mark.slow
def test_berlin_has_no_sheet():
    scene = build_scene(read_city([ROOT / "examples/berlin/berlin_3910_5817.gml"]), patch_size=None)
    assert not scene.sheet.any()
    assert scene.footprint[
        np.array(scene.surfaces.thematic)[scene.triangle_surface] == "GroundSurface"
    ].all()
