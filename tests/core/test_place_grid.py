"""Places in boxes, and feet that hang, as comparing each with each finds them."""

import numpy as np
import pytest

from citypv.core.city.places_in_plan import COINCIDENT, find_in_boxes, lay_grid, list_runs
from citypv.core.city.slope_filter import NEAR, find_standing, foot_on_edge


@pytest.mark.parametrize("extent", [1.0, 30.0, 3000.0])
def test_pairs_of_places_and_boxes(extent):
    """Also of boxes that lie partly or wholly beyond all places, have no area, or are none at all."""
    random = np.random.default_rng(1)
    places = random.uniform(-100, 100, (800, 2))
    low = random.uniform(-150, 150, (60, 2))
    boxes = np.concatenate([low, low + random.uniform(0, extent, (60, 2))], axis=1)
    boxes = np.concatenate([boxes, [[np.nan] * 4], np.tile(places[:1], 2), [[-1e6, -1e6, 1e6, 1e6]]])
    within = (places[:, None] >= boxes[:, :2]) & (places[:, None] <= boxes[:, 2:])
    expected = np.argwhere(within.all(axis=2).T)[:, ::-1]
    place, box = find_in_boxes(lay_grid(places, boxes), boxes)
    assert (np.diff(box) >= 0).all()
    order = np.lexsort([place, box])
    np.testing.assert_array_equal(np.column_stack([place, box])[order], expected)


def test_no_places_or_boxes():
    none, one = np.empty((0, 2)), np.array([[0.0, 0, 1, 1]])
    assert not len(find_in_boxes(lay_grid(none, one), one)[0])
    assert not len(find_in_boxes(lay_grid(np.zeros((3, 2)), one[:0]), one[:0])[0])
    place, box = find_in_boxes(lay_grid(np.zeros((3, 2)), one), one)
    assert sorted(place) == [0, 1, 2] and not box.any()


def test_runs():
    run, number = list_runs(np.array([5, 2, 9]), np.array([2, -1, 3]))
    assert run.tolist() == [0, 0, 2, 2, 2] and number.tolist() == [5, 6, 9, 10, 11]


@pytest.mark.parametrize("slope", [0.1, 0.5])
def test_feet_on_a_hill_hang_as_each_compared_with_each_says(slope):
    """Feet on a cone, some of them raised; so few that all are compared as neighbours."""
    random = np.random.default_rng(2)
    start = np.column_stack([random.uniform(0, 60, (30, 2)), np.zeros(30)])
    start[:, 2] = 0.15 * np.hypot(*start[:, :2].T) + random.choice([0.0, 1.0, 4.0, 12.0], 30)
    end = start + np.column_stack([random.uniform(-6, 6, (30, 2)), np.zeros(30)])
    step, slopes = random.choice([0.5, 2.5, 6.0], 30), np.full(30, slope)
    hangs = np.zeros(30, bool)
    for ends in (start, end):
        away = np.linalg.norm(ends[:, None, :2] - start[None, :, :2], axis=2)
        above_feet = (ends[:, None, 2] - start[None, :, 2] > step[:, None] + slope * away).any(axis=1)
        pairs = np.indices((30, 30)).reshape(2, -1)
        foot, away = foot_on_edge(ends[pairs[0]], start[pairs[1]], end[pairs[1]])
        rise = ends[pairs[0], 2] - foot[:, 2] > step[pairs[0]] + slope * away + COINCIDENT
        hangs |= above_feet | ((away <= NEAR) & rise).reshape(30, 30).any(axis=1)
    assert 5 < hangs.sum() < 28
    np.testing.assert_array_equal(find_standing(start, end, step, slopes), ~hangs)
