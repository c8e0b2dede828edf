"""Walls drawn twice, about a millimetre apart: each counts once."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from towns import box, city_of_polygons

from citypv.core.city.build_scene import DRAWN_TWICE, build_scene
from citypv.core.read.read_city import read_city

BERLIN = Path(__file__).parents[2] / "examples" / "berlin" / "berlin_3910_5817.gml"
PLACE = {"latitude": 52.5, "longitude": 13.4, "ground": "none", "patch_size": None}
SOUTH, EAST, NORTH, WEST = (
    np.array([0.0, -1, 0]),
    np.array([1.0, 0, 0]),
    np.array([0.0, 1, 0]),
    np.array([-1.0, 0, 0]),
)


def house(low=(0, 0, 0), high=(10, 10, 8)):
    return box(low, high)


def twins(polygons, building=None):
    """Numbers of the surfaces that are named as drawn twice; none of them is eligible, all others
    are as alone.
    """
    city = city_of_polygons(polygons, building=building)
    scene = build_scene(city, **PLACE)
    named = [city.surface_id.index(name) for name in scene.report.repaired.get(DRAWN_TWICE, [])]
    bearing = (scene.surfaces.kind != "downward") & (scene.surfaces.area > 6.25)
    assert (scene.surfaces.eligible == (bearing & ~np.isin(np.arange(len(polygons)), named))).all()
    return named


@pytest.mark.parametrize("apart", [0.0, 1e-6, 1e-3, -1e-3, 0.005, -0.005])
def test_a_wall_drawn_twice_counts_once(apart):
    """The one behind is named; in one place the later one. The house is turned any way: nothing
    hangs on the axes.
    """
    for angle in (0.0, 0.3):
        turn = np.array(
            [[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
        )
        polygons = house()
        polygons.append(polygons[2] + apart * SOUTH)
        polygons = [polygon @ turn + [300.0, -400.0, 0.0] for polygon in polygons]
        assert twins(polygons, [0] * 6 + [1]) == [2 if apart > 1e-4 else 6]


def test_a_part_of_a_wall_drawn_twice_counts_once():
    """A window over its wall, drawn in three pieces; a wall over two storeys of which each is drawn
    again.
    """
    window = np.array([[2, 0, 2], [8, 0, 2], [8, 0, 5], [2, 0, 5]], float)
    pieces = [np.clip(window, [2 + 2 * k, 0, 2], [4 + 2 * k, 0, 5]) for k in range(3)]
    assert twins([*house(), *pieces]) == [6, 7, 8]
    storeys = [np.clip(house()[2], [0, 0, z], [10, 0, z + 4]) for z in (0, 4)]
    assert twins([*house(), *storeys]) == [6, 7]
    assert twins([*house(), *[storey + 1e-3 * SOUTH for storey in storeys]]) == [2]


def test_thrice_is_once():
    wall = house()[2]
    assert twins([*house(), wall, wall]) == [6, 7]
    assert twins([*house(), wall - 1e-3 * SOUTH, wall - 2e-3 * SOUTH]) == [6, 7]


def test_a_chain_of_walls_each_on_half_of_the_next_stays():
    """Each lies on the one before for less than half; none is left out for what is itself
    left out.
    """
    walls = [
        np.array([[x, 0, 0], [x + 10, 0, 0], [x + 10, 0, 5], [x, 0, 5]], float)
        for x in (0.0, 6.0, 12.0)
    ]
    assert twins(walls) == []
    nested = [
        np.array([[0, 0, 0], [w, 0, 0], [w, 0, 5], [0, 0, 5]], float) for w in (10.0, 9.0, 8.0)
    ]
    assert twins(nested) == [1, 2]


def test_walls_back_to_back_beside_each_other_or_further_apart_are_no_twins():
    for gap in (0.0, 1e-3, -1e-3):
        assert twins([*house(), *house((10 + gap, 0, 0), (20, 10, 8))]) == []
    assert twins([*house(), *house((10, 0, 0), (20, 10, 8)), *house((0, 0, 8), (10, 10, 12))]) == []
    assert twins([*house(), house()[2] + 0.1 * SOUTH]) == []


@pytest.mark.slow
def test_no_wall_of_berlin_is_a_twin_until_seven_are_drawn_again():
    """Seven walls of 671 m² or more, drawn again a millimetre behind by another building: the
    eligible area stays.
    """
    city = read_city([BERLIN])
    scene = build_scene(city, ground="none", patch_size=None)
    assert DRAWN_TWICE not in scene.report.repaired
    walls = np.flatnonzero(scene.surfaces.eligible & (scene.surfaces.kind == "facade"))
    walls = walls[np.argsort(-scene.surfaces.area[walls])][20:400:55]
    assert len(walls) == 7
    assert scene.surfaces.area[walls].sum() > 671
    normal = scene.surfaces.normal[walls]
    rings = [city.rings(wall)[0] - 1e-3 * n for wall, n in zip(walls, normal, strict=True)]
    added = np.cumsum([len(ring) for ring in rings])
    again = replace(
        city,
        surface_id=city.surface_id + [f"again{k}" for k in range(7)],
        building_id=city.building_id + ["another"] * 7,
        thematic=city.thematic + ["WallSurface"] * 7,
        points=np.concatenate([city.points, *rings]),
        ring_start=np.concatenate([city.ring_start, city.ring_start[-1] + added]),
        polygon_start=np.concatenate(
            [city.polygon_start, city.polygon_start[-1] + np.arange(1, 8)]
        ),
        lod=None,
        material=None,
    )
    found = build_scene(again, ground="none", patch_size=None)
    assert found.report.repaired[DRAWN_TWICE] == [f"again{k}" for k in range(7)]
    assert (
        found.surfaces.area[found.surfaces.eligible].sum()
        == scene.surfaces.area[scene.surfaces.eligible].sum()
    )
