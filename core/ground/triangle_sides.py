"""Sides of triangles sorted so that the two triangles of each follow one another: neighbours and edges read off."""

from typing import NamedTuple

import numpy as np

from .merge_places import pair_keys


class Sides(NamedTuple):
    """The sides (corner k to k + 1) of triangles, sorted by their smaller, then their larger end."""

    key: np.ndarray  # (3 t,) int64, of `pair_keys`
    side: np.ndarray  # (3 t,) int64: three times the triangle, plus k


def sort_sides(triangles):
    """Sides of triangles, (t, 3) int64."""
    following = triangles[:, [1, 2, 0]]
    key = ((np.minimum(triangles, following).astype(np.int64) << 32) + np.maximum(triangles, following)).ravel()
    side = np.argsort(key)
    return Sides(key[side], side)


def find_neighbours(sides):
    """The triangle beyond each side, -1 beyond the hull: (t, 3) int64."""
    same = np.flatnonzero(sides.key[1:] == sides.key[:-1])
    one, other = sides.side[same], sides.side[same + 1]
    neighbours = np.full(len(sides.key), -1)
    neighbours[one], neighbours[other] = other // 3, one // 3
    return neighbours.reshape(-1, 3)


def has_edges(sides, edges):
    """Whether edges, (e, 2) int64 with the smaller number first, are among the sides: (e,) bool."""
    wanted = pair_keys(edges)
    at = np.minimum(np.searchsorted(sides.key, wanted), len(sides.key) - 1)
    return sides.key[at] == wanted


def renew_neighbours(neighbours, gone, triangles):
    """Neighbours after some triangles have given way to others.

    Parameters
    ----------
    neighbours : array, (t, 3) int64
        Of before.
    gone : array, (t,) bool
        Triangles of before that are no more.
    triangles : array, (s, 3) int64
        Those that are left come first, in their order.
    """
    left = len(gone) - np.count_nonzero(gone)
    number = np.append(np.where(gone, -2, np.cumsum(~gone) - 1), -1)  # of each, and of none
    renewed = np.full((len(triangles), 3), -2)
    renewed[:left] = number[neighbours[~gone]]
    rows = np.flatnonzero((renewed == -2).any(axis=1))  # new ones, and those beside gone ones
    around = find_neighbours(sort_sides(triangles[rows]))
    renewed[rows] = np.where(renewed[rows] == -2, np.where(around >= 0, rows[around], -1), renewed[rows])
    return renewed
