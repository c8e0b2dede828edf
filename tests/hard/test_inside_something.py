"""Walls inside other buildings, in gaps and in courts: which are covered is known from how the boxes are laid."""

import numpy as np
import pytest
from closed import box
from scenes import join, strip

from citypv.core.light.measure_cover import measure_cover

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

    The ground lies below the house's floor, or above, or in its plane, where the processor decides which rays meet.
    """
    boxes = [((0, 0, 0), (10, 10, 10)), ((1, 1, 0), (4, 9, 9.5)), ((6, 2, 0), (16, 8, 8))]
    house, core, wing = covered_sides(boxes, ground=strip([-60, -60, height], [120, 0, 0], [0, 120, 0], 24))
    assert [core[side] for side in ("south", "north", "east", "west")] == pytest.approx([1, 1, 1, 1], abs=CELL)
    assert wing["west"] == pytest.approx(1, abs=CELL)
    assert [wing[side] for side in ("south", "north", "east")] == pytest.approx([0.4, 0.4, 0], abs=CELL)
    assert [house[side] for side in ("south", "north", "west")] == [0, 0, 0]
    assert house["east"] == pytest.approx(0.6 * 0.8, abs=CELL)


@pytest.mark.parametrize("without", [{(0, "floor"), (1, "floor")}, {(0, "floor"), (1, "roof")}, {(1, "north")}])
def test_nested_shells_with_a_face_missing(without):
    outer, middle, core = covered_sides(
        [((0, 0, 0), (12, 12, 12)), ((2, 2, 0), (10, 10, 10)), ((4, 4, 0), (8, 8, 8))], without
    )
    walls = {"south", "north", "east", "west"}
    for house in (middle, core):
        assert min(house[side] for side in walls & house.keys()) > 1 - CELL
    assert max(outer[side] for side in walls) == 0


@pytest.mark.parametrize(("gap", "covered"), [(0, 1), (1e-4, 1), (1e-3, 1), (9e-3, 1), (0.05, 0), (0.5, 0)])
def test_walls_beside_a_neighbour(gap, covered):
    """Below a centimetre the gap is the rounding of a model; a wider one is outside, however dark."""
    house, neighbour = covered_sides([((0, 0, 0), (10, 10, 12)), ((10 + gap, 0, 0), (20, 10, 6))])
    assert house["east"] == pytest.approx(covered / 2, abs=CELL)
    assert neighbour["west"] == pytest.approx(covered, abs=CELL)
    assert max(house["south"], house["west"], neighbour["north"], neighbour["east"]) == 0


def test_a_thin_panel_covers_nothing():
    """What begins a centimetre before the wall is outside again: a panel of 3 mm, 5 mm before it."""
    house, _ = covered_sides([((0, 0, 0), (10, 10, 10)), ((10.005, 1, 1), (10.008, 9, 9))])
    assert house["east"] == pytest.approx(0, abs=CELL)


@pytest.mark.parametrize("without", [set(), {(4, "south")}])
def test_a_court_is_outside(without):
    """3 m wide and 30 m deep between four houses, with a shed in it that is closed, or open to one side."""
    houses = [
        ((-10, -10, 0), (0, 13, 30)),
        ((3, -10, 0), (13, 13, 30)),
        ((0, -10, 0), (3, 0, 30)),
        ((0, 3, 0), (3, 13, 30)),
    ]
    found = covered_sides([*houses, ((0.5, 1, 0), (1.5, 2, 2))], without)
    court = found[2]["north"], found[3]["south"], found[4]["north"], found[4]["east"]
    assert max(court) < CELL
    assert np.mean([found[0]["east"], found[1]["west"]]) == pytest.approx(20 / 23, abs=CELL)
