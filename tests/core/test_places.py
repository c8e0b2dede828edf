"""Far from an edit of the city all stays as it was: triangles, keys of random numbers, ray origins, ground."""

from pathlib import Path

import numpy as np
import pytest
from cities import box, make_city
from edits import add_box, building_near, raise_building, remove_building

from citypv.core.files.read_city import read_city
from citypv.core.patches.patches import patches_of_scene
from citypv.core.scene.build_scene import SceneOptions, build_scene

BERLIN = Path(__file__).parents[2] / "examples" / "berlin" / "berlin_3910_5817.gml"
FAR = 150.0  # [m] from the edit in plan


def describe(scene):
    """Middles in plan, (t, 2), and for each triangle all that its rays follow from: corners, key, offset and kind."""
    patches = patches_of_scene(scene, np.full(len(scene.triangles), 0.2), seed=3)
    corners = scene.vertices[scene.triangles]
    bits = [corners.reshape(len(corners), -1).view(np.uint64), patches.key[:, None], patches.place_key[:, None]]
    bits += [patches.offset.view(np.uint32)[:, None], patches.receives[:, None], (scene.triangle_surface < 0)[:, None]]
    return corners[:, :, :2].mean(axis=1), np.concatenate([np.asarray(one, np.uint64) for one in bits], axis=1)


def differ(one, other, middle, far):
    """How many triangles further than so far from a place only one of two scenes has, or in another order, and how many
    both have."""
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


@pytest.mark.parametrize("edit", ["add", "remove", "raise"])
def test_far_from_an_edit_of_berlin_nothing_changes(berlin, edit):
    city, scene, before = berlin
    building, middle = building_near(city, city.points[:, :2].min(axis=0) + [150.0, 150.0])
    if edit == "add":
        changed = add_box(city, middle + [25.0, 25.0])
    else:
        changed = (remove_building if edit == "remove" else raise_building)(city, building)
    again = build_scene(changed, options=SceneOptions(site=scene.site))
    lost, same = differ(before, describe(again), middle - np.array(scene.site.origin[:2]), FAR)
    assert lost == 0
    assert same > 30_000
