"""Sides of triangles, sorted so that the two triangles of each follow one another; neighbours and edges are read off."""

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
