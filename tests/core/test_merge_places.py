"""Feet at one place in plan view, among them such that rounding puts on two sides of the border of two cells."""

import numpy as np
import pytest

from citypv.core.city.places_in_plan import COINCIDENT, merge_places

BORDER = 100.5 * COINCIDENT  # between two cells
ULP = np.spacing(BORDER)


@pytest.mark.parametrize("axis", [0, 1])
def test_rounding_across_a_border_makes_no_second_place(axis):
    corner = np.full((9, 3), [3.0, 7.0, 0.0])
    corner[:, axis] = BORDER + ULP * np.arange(-4, 5)
    corner[6, 2] = -1.0
    lowest, place = merge_places(np.concatenate([corner, [[3.5, 7.5, 0.0]]]))
    assert sorted(lowest) == [6, 9]
    assert len(set(place[:9])) == 1 and place[9] not in place[:9]


def test_corners_in_half_centimetres_are_each_one_place():
    """Copies of a grid whose lines all lie on borders, moved by rounding: as many places as the grid has."""
    lines = (np.arange(30) + 0.5) * COINCIDENT * 7
    grid = np.stack(np.meshgrid(lines, lines), axis=-1).reshape(-1, 2)
    moved = np.concatenate([(grid + shift) - shift for shift in (0.0, 100.1, 12345.6, -9876.5, 0.3)])
    lowest, place = merge_places(np.column_stack([moved, np.zeros(len(moved))]))
    assert len(np.unique(moved, axis=0)) > len(grid)  # rounding did move them
    assert len(lowest) == len(grid)
    assert (place.reshape(5, -1) == place[: len(grid)]).all()


def test_places_that_differ_stay_apart_in_their_order():
    points = np.array([[0.02, 0.0, 5.0], [0.0, 0.0, 4.0], [0.0, 0.0, 3.0], [0.011, 0.0, 2.0], [-1.0, 9.0, 0.0]])
    lowest, place = merge_places(points)
    assert lowest.tolist() == [4, 2, 3, 0]
    assert place.tolist() == [3, 1, 1, 2, 0]


def test_no_points():
    lowest, place = merge_places(np.zeros((0, 3)))
    assert len(lowest) == len(place) == 0
