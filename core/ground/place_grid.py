"""Places sorted by the cells of a grid, to find those in boxes: in each row of cells they follow one another.

      ┌──┬──┬──┬──┬──┐
row 2 │  │░░│░░│░░│  │     A box meets the cells ░: one run of places in each row, found by bisection. No search
      ├──┼──┼──┼──┼──┤     tree is built, and no geometry for each place.
row 1 │  │░░│░░│░░│  │
      ├──┼──┼──┼──┼──┤
row 0 │  │  │  │  │  │
      └──┴──┴──┴──┴──┘
"""

from typing import NamedTuple

import numpy as np

MOST_CELLS = 1 << 20  # along either side
SHARE = 0.5  # of the mean box: size of a cell


class PlaceGrid(NamedTuple):
    """Places and their order by cells."""

    places: np.ndarray  # (p, 2) float64 [m]
    order: np.ndarray  # (p,) int64, by row, then column
    key: np.ndarray  # (p,) int64, row * columns + column, ascending
    origin: np.ndarray  # (2,) float64 [m]
    size: float  # [m] of a cell
    count: np.ndarray  # (2,) int64, columns and rows


def lay_grid(places, boxes):
    """Grid over some places, (p, 2) float64 [m], for boxes of about the size of these, (s, 4) float64 [m]."""
    if not len(places):
        none = np.zeros(0, np.int64)
        return PlaceGrid(places, none, none, np.zeros(2), 1.0, np.ones(2, np.int64))
    x, y = places.T
    origin = np.array([x.min(), y.min()])
    extent = np.array([x.max(), y.max()]) - origin
    wide = (boxes[:, 2:] - boxes[:, :2])[np.isfinite(boxes).all(axis=1)]
    size = max(SHARE * wide.mean() if len(wide) else 0.0, extent.max() / MOST_CELLS, np.finfo(np.float32).tiny)
    count = np.floor(extent / size).astype(np.int64) + 1
    column, row = (np.floor((one - least) / size).astype(np.int64) for one, least in zip((x, y), origin, strict=True))
    key = row * count[0] + column
    order = np.argsort(key)
    return PlaceGrid(places, order, key[order], origin, size, count)


def find_in_boxes(grid, boxes):
    """Pairs of a place and a box in which, or on whose edge, it lies: two (k,) int64, sorted by box.

    Parameters
    ----------
    grid : PlaceGrid
    boxes : array, (s, 4) float64 [m]
        Least x and y, largest x and y; NaN for none.
    """
    chosen = np.flatnonzero(np.isfinite(boxes).all(axis=1))
    boxes = boxes[chosen]
    columns, cells = grid.count[0], np.floor((boxes - np.tile(grid.origin, 2)) / grid.size)
    left, bottom = np.clip(cells[:, :2], 0, grid.count).astype(np.int64).T
    right, top = np.clip(cells[:, 2:], -1, grid.count - 1).astype(np.int64).T
    box, row = list_runs(bottom, np.where(left <= right, top + 1 - bottom, 0))
    first = np.searchsorted(grid.key, row * columns + left[box])
    last = np.searchsorted(grid.key, row * columns + right[box], "right")
    run, place = list_runs(first, last - first)
    place, box = grid.order[place], box[run]
    x, y = grid.places[place].T
    low_x, low_y, high_x, high_y = boxes[box].T
    inside = (x >= low_x) & (x <= high_x) & (y >= low_y) & (y <= high_y)
    return place[inside], chosen[box[inside]]


def list_runs(first, count):
    """Runs of whole numbers, each from a first one on: the run of each number, and the numbers, two (k,) int64."""
    count = np.maximum(count, 0)
    run = np.repeat(np.arange(len(first)), count)
    return run, np.arange(len(run)) - np.repeat(np.cumsum(count) - count - first, count)
