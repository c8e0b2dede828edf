"""A floor that hangs between the walls of its neighbours is no embankment: the generated ground
stays level.
"""

import numpy as np
import pytest
from cities import box, make_city

from citypv.core.city.build_scene import build_scene

TOWERS = box("t1", -20, 0, 14, 12, 0, 20) + box("t2", 6, 0, 14, 12, 0, 20)


def highest_ground(polygons, turn=0.0):
    """Of the ground of a city, turned in plan [°], above its lowest point [m]."""
    city = make_city(polygons)
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    city.points[:, :2] = city.points[:, :2] @ np.array([[c, s], [-s, c]])
    scene = build_scene(city, latitude=50, longitude=10)
    heights = scene.vertices[scene.triangles[scene.triangle_surface < 0]][..., 2]
    return np.ptp(heights)


@pytest.mark.parametrize("semantics", [True, False])
@pytest.mark.parametrize(
    ("floor", "turn", "gap"),
    [(5, 0, 0), (3, 0, 0), (5.9, 37, 0), (4, 0, 0.1)],
    ids=["5 m", "3 m", "turned", "a gap"],
)
def test_a_bridge_between_towers_leaves_the_ground_level(floor, turn, gap, semantics):
    bridge = box("br", -6 + gap, 0, 12 - 2 * gap, 12, floor, floor + 7, semantics=semantics)
    assert highest_ground(TOWERS + bridge, turn) == pytest.approx(0, abs=1e-6)
    # One that is narrower than the towers, of two spans on a third tower.
    third = box("t3", 18, 0, 12, 12, 0, 20)
    narrow = box("br", -6, 4, 12, 3, floor, floor + 4, semantics=semantics)
    assert highest_ground(TOWERS[:12] + narrow + third, turn) == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize(
    ("houses", "height"),
    [
        (
            TOWERS[:6] + box("house", -6, 0, 12, 12, 4, 12),
            4,
        ),  # beside one wall: at the edge of a terrace
        (TOWERS + box("house", -6, 0, 12, 12, 2, 12), 2),  # between two that stand hardly lower
        (
            box("a", -16, 0, 10, 12, 0, 3)
            + box("b", 6, 0, 10, 12, 0, 3)
            + box("c", -6, 0, 12, 12, 4, 12),
            4,
        ),
    ],
    ids=["one wall", "a step", "above low roofs"],
)
def test_a_house_on_an_embankment_stands_on_it(houses, height):
    assert highest_ground(houses) == pytest.approx(height, abs=1e-6)
