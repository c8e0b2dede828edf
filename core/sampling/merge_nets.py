"""Two halves of a digital net of points, in the order of the whole."""

import numpy as np
from numba import njit

from .sample_points import DIGITS, grid_of, points_of_grid


def merge_nets(shifts, halves):
    """Values at the points of two halves of a net with digital shifts, in the order of `points_of_grid`.

    Parameters
    ----------
    shifts : tuple of (c, 2) uint32 and (c, 2) uint32
        Digital shifts of each half.
    halves : tuple of (c, m) float32 and (c, m) float32
        In the order of `points_of_grid(m)`.

    Returns
    -------
    (c, 2 m) float32
    """
    count, points = halves[0].shape
    whole = np.empty((count, 2 * points), np.float32)
    for shift, values in zip(shifts, halves, strict=True):
        place_values(shift, (points_of_grid(points), grid_of(points)), grid_of(2 * points), values, whole)
    return whole


@njit(nogil=True, cache=True)
def place_values(shift, net, finer, values, whole):
    """Write the values of points to the rectangles of a finer grid in which they lie.

    Parameters
    ----------
    shift : (c, 2) uint32
    net : tuple of (m, 2) uint32 and tuple of int
        Of `points_of_grid` and `grid_of`.
    finer : tuple of int
        Rows and columns.
    values : (c, m) float32
    whole : (c, 2 m) float32
        Written.
    """
    digits, (rows, columns) = net
    for patch in range(len(shift)):
        along, across = np.int64(shift[patch, 0]), np.int64(shift[patch, 1])
        column_turn, row_turn = (along * columns) >> DIGITS, (across * rows) >> DIGITS
        for point in range(len(digits)):
            row, column = (point // columns) ^ row_turn, (point % columns) ^ column_turn
            found = digits[row * columns + column]
            u, v = np.int64(found[0]) ^ along, np.int64(found[1]) ^ across
            place = ((v * finer[0]) >> DIGITS) * finer[1] + ((u * finer[1]) >> DIGITS)
            whole[patch, place] = values[patch, point]
