"""Far from an edit of the city all stays as it was: triangles, keys of random numbers, ray origins,
ground.
"""

from pathlib import Path

import numpy as np
import pytest
from cities import box, make_city
from thorough import mark_cases

from citypv.core.city.build_scene import SceneOptions, build_scene
from citypv.core.city.edit_city import CityChange, edit_city
from citypv.core.patches.facing_scene import FacingScene
from citypv.core.patches.patches import Patches
from citypv.core.read.read_city import read_city

BERLIN = Path(__file__).parents[2] / "examples" / "berlin" / "berlin_3910_5817.gml"
FAR = 150.0  # [m] from the edit in plan


def describe(scene):
    """Middles in plan, (t, 2), and for each triangle all that its rays follow from: corners, key,
    offset and kind.
    """
    patches = Patches.of_scene(scene, np.full(len(scene.triangles), 0.2), seed=3)
    corners = scene.vertices[scene.triangles]
    bits = [
        corners.reshape(len(corners), -1).view(np.uint64),
        patches.key[:, None],
        patches.place_key[:, None],
    ]
    bits += [
        patches.offset.view(np.uint32)[:, None],
        patches.receives[:, None],
        (scene.triangle_surface < 0)[:, None],
    ]
    return corners[:, :, :2].mean(axis=1), np.concatenate(
        [np.asarray(one, np.uint64) for one in bits], axis=1
    )


def differ(one, other, middle, far):
    """How many triangles further than so far from a place only one of two scenes has, or in another
    order, and how many both have."""
    kept = [bits[np.hypot(*(places - middle).T) > far] for places, bits in (one, other)]
    if kept[0].shape == kept[1].shape and (kept[0] == kept[1]).all():
        return 0, len(kept[0])
    rows = [set(map(bytes, part)) for part in kept]
    return max(len(rows[0] ^ rows[1]), 1), len(rows[0] & rows[1])


@pytest.fixture(scope="module")
def berlin():
    city = read_city(BERLIN)
    scene = build_scene(city)
    return city, scene, describe(scene)


def building_near(city, place):
    """Id of the building whose middle is nearest to a place of the grid, (2,) [m], and that middle,
    (3,) [m].
    """
    names = np.array(city.building_id)
    middles = {
        name: np.concatenate([city.rings(row)[0] for row in np.flatnonzero(names == name)]).mean(
            axis=0
        )
        for name in dict.fromkeys(city.building_id)
    }
    found = min(middles, key=lambda name: np.hypot(*(middles[name][:2] - place)))
    return found, middles[found]


@pytest.mark.slow
@pytest.mark.parametrize("edit", mark_cases(["add", "remove", "raise"], kept=1, law=(0,)))
def test_far_from_an_edit_of_berlin_nothing_changes(berlin, edit):
    city, scene, before = berlin
    building, middle = building_near(city, city.points[:, :2].min(axis=0) + 150.0)
    low = middle[2] - 10.0
    changes = {
        "add": CityChange(
            added=(make_city(box("new", *middle[:2] + 25.0, 20, 20, low, low + 20)),)
        ),
        "remove": CityChange(removed=[building]),
        "raise": CityChange(raised={building: 6.0}),
    }
    again = build_scene(edit_city(city, changes[edit]), options=SceneOptions(site=scene.site))
    lost, same = differ(before, describe(again), middle[:2] - np.array(scene.site.origin[:2]), FAR)
    assert lost == 0
    assert same > 30_000


def test_polygons_without_names_are_told_by_where_they_are():
    """The reader calls them after their building and a number; another order changes no random
    number.
    """
    polygons = [*box("a", 0, 0, 10, 10, 0, 6), *box("a", 30, 5, 10, 8, 0, 9)]
    keys = []
    for order in (np.arange(12), np.arange(12)[::-1]):
        city = make_city([polygons[row] for row in order])
        city.surface_id = [f"a_{number + 1}" for number in range(11)] + ["a_4~2"]
        scene = build_scene(city, 50.0, 8.0)
        patches = Patches.of_scene(scene, np.full(len(scene.triangles), 0.2), seed=3)
        keys.append(set(patches.key.tolist()))
        assert len(keys[-1]) == len(scene.triangles)
    assert keys[0] == keys[1]


@pytest.mark.parametrize("swapped", [False, True])
def test_of_faces_in_one_place_the_first_counts(swapped):
    """Two roofs drawn in one place, both facing up: rays from above meet the first, whatever the
    tracer finds.
    """
    square = [
        [(0, 0, 5), (9, 0, 5), (9, 9, 5), (0, 9, 5)],
        [(1, 1, 5), (8, 1, 5), (8, 8, 5), (1, 8, 5)],
    ]
    scene = build_scene(
        make_city([("a", "", [ring]) for ring in square[:: -1 if swapped else 1]]), ground="none"
    )
    patches = Patches.of_scene(scene, np.full(len(scene.triangles), 0.2), seed=3)
    places = np.random.default_rng(0).uniform(-3.4, 3.4, (500, 2))
    origins = np.column_stack([places, np.full(500, 4.0)]).astype(np.float32)
    down = np.tile(np.float32([0, 0, -1]), (500, 1))
    for trace in ("trace_places", "trace_as_drawn"):
        hit = getattr(FacingScene(scene, patches), trace)(origins, down).triangle
        assert (scene.triangle_surface[hit] == 0).all()
