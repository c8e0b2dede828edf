"""Walls inside other buildings, in gaps and in courts: which are covered is known from how the
boxes are laid.
"""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from real_cities import SUNS
from scenes import RUNS, join, strip
from thorough import mark_cases
from towns import boxes

from citypv.core.commands.plain_scenes import box, room
from citypv.core.light.measure_cover import find_cover, measure_cover
from citypv.core.patches.facing_scene import FacingScene
from citypv.core.patches.patches import Patches
from citypv.core.settings.progress import silent

GROUND = strip([-60, -60, 0], [120, 0, 0], [0, 120, 0], 24)
SIDES = ("roof", "floor", "south", "north", "east", "west")
CELL = 0.04  # error of a share that is found in 64 cells of each patch


def covered_sides(boxes, without=(), ground=GROUND):
    """Covered share of each side of some boxes, list of dict of str to float, all on a plain.

    Parameters
    ----------
    boxes : list of two (3,) float [m]
    without : set of (int, str)
        Sides that are missing.
    ground : tuple
        Quads of the plain.
    """
    parts, names = [ground], []
    for number, (low, high) in enumerate(boxes):
        for side, part in zip(SIDES, box(low, high), strict=True):
            if (number, side) not in without:
                parts.append(part)
                names.append((number, side))
    share = measure_cover(join(parts), threads=1)[len(ground[1]) :].reshape(-1, 2).mean(axis=1)
    found = [{} for _ in boxes]
    for (number, side), value in zip(names, share, strict=True):
        found[number][side] = value
    return found


@pytest.mark.parametrize("height", [-0.02, 0, 0.001])
def test_houses_inside_another_that_see_each_other(height):
    """A core and a wing inside a house: rays from their walls meet fronts, and still lie inside.

    The ground lies below the house's floor, or above, or in its plane, where the processor decides
    which rays meet.
    """
    boxes = [((0, 0, 0), (10, 10, 10)), ((1, 1, 0), (4, 9, 9.5)), ((6, 2, 0), (16, 8, 8))]
    house, core, wing = covered_sides(
        boxes, ground=strip([-60, -60, height], [120, 0, 0], [0, 120, 0], 24)
    )
    assert [core[side] for side in ("south", "north", "east", "west")] == pytest.approx(
        [1, 1, 1, 1], abs=CELL
    )
    assert wing["west"] == pytest.approx(1, abs=CELL)
    assert [wing[side] for side in ("south", "north", "east")] == pytest.approx(
        [0.4, 0.4, 0], abs=CELL
    )
    assert [house[side] for side in ("south", "north", "west")] == [0, 0, 0]
    assert house["east"] == pytest.approx(0.6 * 0.8, abs=CELL)


@pytest.mark.parametrize(
    "without", [{(0, "floor"), (1, "floor")}, {(0, "floor"), (1, "roof")}, {(1, "north")}]
)
def test_nested_shells_with_a_face_missing(without):
    shells = [((0, 0, 0), (12, 12, 12)), ((2, 2, 0), (10, 10, 10)), ((4, 4, 0), (8, 8, 8))]
    outer, middle, core = covered_sides(shells, without)
    walls = {"south", "north", "east", "west"}
    for house in (middle, core):
        assert min(house[side] for side in walls & house.keys()) > 1 - CELL
    assert max(outer[side] for side in walls) == 0


@pytest.mark.parametrize(
    ("gap", "covered"), [(0, 1), (1e-4, 1), (1e-3, 1), (9e-3, 1), (0.05, 0), (0.5, 0)]
)
def test_walls_beside_a_neighbour(gap, covered):
    """Below a centimetre the gap is the rounding of a model; a wider one is outside,
    however dark.
    """
    house, neighbour = covered_sides([((0, 0, 0), (10, 10, 12)), ((10 + gap, 0, 0), (20, 10, 6))])
    assert house["east"] == pytest.approx(covered / 2, abs=CELL)
    assert neighbour["west"] == pytest.approx(covered, abs=CELL)
    assert max(house["south"], house["west"], neighbour["north"], neighbour["east"]) == 0


def test_a_thin_panel_covers_nothing():
    """What begins a centimetre before the wall is outside again: a panel of 3 mm, 5 mm
    before it.
    """
    house, _ = covered_sides([((0, 0, 0), (10, 10, 10)), ((10.005, 1, 1), (10.008, 9, 9))])
    assert house["east"] == pytest.approx(0, abs=CELL)


def around(width, length, depth):
    """Houses to the west, east, south and north of a court."""
    return [
        ((-10, -10, 0), (0, length + 10, depth)),
        ((width, -10, 0), (width + 10, length + 10, depth)),
        ((0, -10, 0), (width, 0, depth)),
        ((0, length, 0), (width, length + 10, depth)),
    ]


@pytest.mark.parametrize("without", [set(), {(4, "south")}])
def test_a_court_is_outside(without):
    """3 m wide and 30 m deep between four houses, with a shed in it that is closed, or open to one
    side.
    """
    found = covered_sides([*around(3, 3, 30), ((0.5, 1, 0), (1.5, 2, 2))], without)
    court = found[2]["north"], found[3]["south"], found[4]["north"], found[4]["east"]
    assert max(court) < CELL
    assert np.mean([found[0]["east"], found[1]["west"]]) == pytest.approx(20 / 23, abs=CELL)


@pytest.mark.parametrize("width", [0.1, 0.3])
def test_a_slot_between_four_houses_is_outside(width):
    """However deep: hardly a ray reaches the sky, but rays that go on do."""
    west, east, south, north = covered_sides(around(width, 10, 20))
    assert max(south["north"], north["south"]) < CELL
    assert np.mean([west["east"], east["west"]]) == pytest.approx(20 / 30, abs=CELL)


@pytest.mark.slow
@pytest.mark.parametrize(("width", "height"), mark_cases([(3.0, 20.0), (4.0, 15.0)], law=(1,)))
def test_cover_of_a_block_does_not_depend_on_the_seed(width, height):
    """25 houses without gaps, in no order: each inner wall coincides with one that faces the other
    way, and all of what a ray meets in a house may be such fronts of its neighbours."""
    count = 5
    places = np.random.default_rng(3).permutation(count**2)
    corners = [np.array([*divmod(place, count), 0]) * width for place in places]
    scene = boxes([(low, low + np.array([width, width, height])) for low in corners])
    vertices, owner = scene.vertices[scene.triangles], scene.triangle_surface
    # the origin is the middle
    edge = np.isclose(np.abs(vertices[..., :2]), count * width / 2).all(axis=1)
    found = []
    for seed in range(5):
        patches = Patches.of_scene(scene, np.zeros(len(scene.triangles)), seed)
        own = scene.triangle_surface >= 0
        found.append(
            find_cover(FacingScene(scene, patches), patches, patches.receives & own, 1, silent)
        )
        assert (found[seed] == found[0]).all()
    facade = (owner >= 0) & (scene.surfaces.kind[owner] == "facade")
    inner, outer = facade & ~edge.any(axis=1), facade & edge.any(axis=1)
    assert inner.sum() >= 4 * outer.sum()
    assert found[0][inner].mean() == 1 and found[0][outer].mean() == 0


def test_the_inner_skin_of_a_house_carries_no_modules():
    """Its rooms are closed: all that rays meet there are fronts, and none of them leaves. So is an
    atrium under a roof that is drawn from both sides, but not one that is open."""
    outer, inner = box((0, 0, 0), (12, 10, 9)), room((0.3, 0.3, 0.3), (11.7, 9.7, 8.7))
    share = (
        measure_cover(join([GROUND, *outer, *inner]), threads=1)[len(GROUND[1]) :]
        .reshape(2, 6, 2)
        .mean(axis=2)
    )
    assert share[0, 2:].max() == 0 and share[1].min() == 1
    open_above = measure_cover(join([GROUND, *outer[1:], *inner[1:]]), threads=1)[
        len(GROUND[1]) :
    ].reshape(2, 5, 2)
    assert open_above.mean(axis=2)[:, 1:].max() < CELL


# -- what is covered is geometry: it does not depend on how a run looks at it --

# houses that touch, each set back and of another height, so that neighbours cover corners of walls
# [m]
ROW = [
    ((11 * k, 1.3 * (k * 5 % 7), 0), (11 * k + 11, 9 + 1.7 * (k * 3 % 5), 7 + 2.9 * (k * 4 % 9)))
    for k in range(14)
]
ON_ROOFS = [  # chimneys and a penthouse
    (
        (11 * k + 4, 5.1, 7 + 2.9 * (k * 4 % 9)),
        (11 * k + 4 + size, 5.1 + size, 9 + 2.9 * (k * 4 % 9)),
    )
    for k, size in ((1, 0.8), (3, 1.1), (4, 0.6), (6, 2.9), (9, 0.9), (12, 1.6))
]


@cache
def scene_of_row():
    return boxes(ROW + ON_ROOFS)


@cache
def covered_by_default():
    return covered_share()


def covered_share(estimator="gather", **settings):
    settings = {"samples": 64, "max_bounces": 1, "shadow_samples": 4, **settings}
    return RUNS[estimator](scene_of_row(), SUNS, **settings).covered_share


@pytest.mark.slow
def test_the_covered_share_does_not_depend_on_rays():
    """The same to the last bit: cells are examined by rays that are the same in every run, by
    photons, and by `citypv inspect`, which traces nothing else."""
    known = covered_by_default()
    assert ((known > 0) & (known < 1)).sum() > 20
    for settings in (
        *(
            {"seed": 1},
            {"samples": 4},
            {"samples": 1024, "seed": 2},
            {"threads": 2},
            {"effects": {"sky-rays": True}},
        ),
        {"report": "all", "max_bounces": 0},
        {"estimator": "forward", "samples": 8, "seed": 3},
    ):
        np.testing.assert_array_equal(covered_share(**settings), known)
    np.testing.assert_array_equal(measure_cover(scene_of_row()), known)


def test_the_covered_share_is_that_of_the_boxes():
    """East walls that the next house hides in part: area of the overlap over that of the wall, to a
    cell of a patch.
    """
    found, error = covered_by_default(), []
    for k, (one, other) in enumerate(pairwise(ROW)):
        (_, y0, _), (_, y1, z1) = one
        (_, v0, _), (_, v1, w1) = other
        hidden = (min(y1, v1) - max(y0, v0)) * min(z1, w1) / ((y1 - y0) * z1)
        east = 6 * k + 3
        assert scene_of_row().surfaces.orientation[east] == "east"
        error.append(found[east] - hidden)
    assert np.abs(error).max() < 0.05
    assert abs(np.mean(error)) < 0.01
