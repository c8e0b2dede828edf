"""Points that lie at one place in plan view."""

import numpy as np

COINCIDENT = 0.01  # [m] points in one cell of that size are at one place


def pair_keys(pairs):
    """One number for each pair of whole numbers below 2³¹, (k, 2) int, that sorts by the first, then the second."""
    return (pairs[:, 0].astype(np.int64) << 32) + pairs[:, 1]


def place_keys(points):
    """The cell of each point in plan as one number, (k,) int64."""
    return pair_keys(np.round(points[:, :2] / COINCIDENT).astype(np.int64))


def merge_places(points):
    """The lowest point at each distinct place, as (p,) int into the points, and the place of each point, (k,) int.

    Places are sorted by x, then y; of equally low points the first is taken.
    """
    _, place = np.unique(place_keys(points), return_inverse=True)
    order = np.lexsort([points[:, 2], place])
    return order[np.unique(place[order], return_index=True)[1]], place


def unique_pairs(pairs):
    """Distinct pairs, (k, 2) int64, sorted by the first number, then the second."""
    return pairs[np.unique(pair_keys(pairs), return_index=True)[1]]
