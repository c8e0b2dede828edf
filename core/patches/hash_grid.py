"""A hash grid: boxes sorted by the cubic cells that they touch, so that boxes in one place are found together."""

import numpy as np
from numba import njit

from ..sampling.random_numbers import GOLDEN


@njit(nogil=True, cache=True)
def cell_of(place, size):
    """Index along an axis of the cell that contains a coordinate."""
    return np.int64(np.floor(place / size))


@njit(nogil=True, cache=True)
def bucket_of_cell(x, y, z, mask):
    """Hash bucket of a cell; collisions only cost time."""
    word = np.uint64(x) * GOLDEN
    word = (word ^ (word >> np.uint64(29)) ^ np.uint64(y)) * np.uint64(0xBF58476D1CE4E5B9)
    word = (word ^ (word >> np.uint64(32)) ^ np.uint64(z)) * np.uint64(0x94D049BB133111EB)
    return np.int64((word ^ (word >> np.uint64(31))) & mask)


@njit(nogil=True, cache=True)
def touch_cells(box, size, mask, touched):
    """Write the buckets of the cells that a box touches, each once, into `touched`, and return their number.

    Parameters
    ----------
    box : (6,) float64
        Low and high corner [m].
    size : float
        Of the cells, no smaller than the box.
    mask : uint64
        One less than the number of buckets.
    touched : (27,) int64
    """
    found = 0
    for x in range(cell_of(box[0], size), cell_of(box[3], size) + 1):
        for y in range(cell_of(box[1], size), cell_of(box[4], size) + 1):
            for z in range(cell_of(box[2], size), cell_of(box[5], size) + 1):
                bucket = bucket_of_cell(x, y, z, mask)
                known = False
                for place in range(found):
                    known |= touched[place] == bucket
                if not known:
                    touched[found] = bucket
                    found += 1
    return found


@njit(nogil=True, cache=True)
def fill_buckets(members, boxes, size, buckets):
    """Sort triangles by the cells that their boxes touch.

    Parameters
    ----------
    members : (n,) int
        Ascending.
    boxes : (t, 6) float64
        Low and high corner of each triangle's box.
    size : float
        Of the cells.
    buckets : int
        A power of two.

    Returns
    -------
    start : (buckets + 1,) int64
        Where the entries of each bucket begin.
    listed : (e,) int64
        The triangles, descending in each bucket.
    """
    mask, touched = np.uint64(buckets - 1), np.empty(27, np.int64)
    start = np.zeros(buckets + 1, np.int64)
    for member in members:
        for place in range(touch_cells(boxes[member], size, mask, touched)):
            start[touched[place]] += 1
    for bucket in range(buckets):
        start[bucket + 1] += start[bucket]
    listed = np.empty(start[buckets], np.int64)
    for member in members:
        for place in range(touch_cells(boxes[member], size, mask, touched)):
            start[touched[place]] -= 1
            listed[start[touched[place]]] = member
    return start, listed
