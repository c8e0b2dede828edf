"""Points that lie at one place in plan view."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

COINCIDENT = 0.01  # [m] points in one cell of that size are at one place
ROUNDING = 1e-6  # [m]


def pair_keys(pairs):
    """One number for each pair of whole numbers below 2³¹, (k, 2) int, that sorts by the first, then the second."""
    return (pairs[:, 0].astype(np.int64) << 32) + pairs[:, 1]


def place_keys(points):
    """The cell of each point in plan as one number, (k,) int64."""
    return pair_keys(np.round(points[:, :2] / COINCIDENT).astype(np.int64))


def merge_places(points):
    """The lowest point at each distinct place, as (p,) int into the points, and the place of each point, (k,) int.

    Places are sorted by x, then y; of equally low points the first is taken. No two are closer than ROUNDING, even if
    the border of two cells runs between them.
    """
    lowest, place = find_lowest(points, place_keys(points))
    joined = join_across_borders(points[lowest, :2])
    if joined.max(initial=-1) == len(lowest) - 1:  # none was joined with another
        return lowest, place
    return find_lowest(points, joined[place])


def find_lowest(points, key):
    """The lowest point of each distinct key, the first of equally low ones, (p,) int; which key each has, (k,) int."""
    order, first = group(key)
    height = points[order, 2]
    number = np.repeat(np.arange(len(first)), np.diff(first, append=len(key)))
    low = np.minimum.reduceat(height, first) if len(first) else height
    lowest = np.where(height == low[number], order, len(key))
    place = np.empty(len(key), np.int64)
    place[order] = number
    return (np.minimum.reduceat(lowest, first) if len(first) else lowest), place


def group(key):
    """Order in which equal whole numbers, (k,) int, follow one another, and where each group of them begins."""
    order = np.argsort(key)
    ordered = key[order]
    return order, np.flatnonzero(np.append(len(key) > 0, ordered[1:] != ordered[:-1])[: len(key)])


def join_across_borders(places):
    """A number for each place, (p,) int, from 0 in their order; the same for those within ROUNDING of each other."""
    cells = places / COINCIDENT
    near = np.flatnonzero((np.abs(cells - np.round(cells)) > 0.5 - ROUNDING / COINCIDENT).any(axis=1))
    first, second = near[cKDTree(places[near]).query_pairs(ROUNDING, output_type="ndarray")].T
    if not len(first):
        return np.arange(len(places))
    pairs = coo_array((np.ones(len(first), bool), (first, second)), (len(places), len(places)))
    return connected_components(pairs, directed=False)[1]


def unique_pairs(pairs):
    """Distinct pairs, (k, 2) int64, sorted by the first number, then the second."""
    return pairs[np.unique(pair_keys(pairs), return_index=True)[1]]
