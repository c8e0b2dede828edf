"""Rings that cross themselves so often that no repair ends: its time grows with the square of the
crossings.

shapely.make_valid takes 0.5 s of 1,200 crossings, 4.5 s of 4,500. A face drawn by people or
programs crosses itself some times at most; one with thousands of crossings is noise, and what it
encloses is nobody's wall.
"""

import numpy as np
import shapely

MOST_CROSSINGS = 1000
FEWEST_CORNERS = 48  # a ring of n corners crosses itself at most n (n - 3) / 2 times


def is_tangled(corners, *, pairs=1_000_000):
    """Whether a ring crosses itself more than `MOST_CROSSINGS` times, estimated from some of its
    edges.

    Parameters
    ----------
    corners : array, (n, 2) float64 [m]
        In the plane of the ring, the first not repeated.
    pairs : int, optional
        Pairs of edges that are intersected at most; with up to 1,000 edges the count is exact.
    """
    if len(corners) < FEWEST_CORNERS or not np.isfinite(corners).all():
        return False
    if shapely.Polygon(corners).is_valid:
        return False
    edges = shapely.linestrings(np.stack([corners, np.roll(corners, -1, axis=0)], axis=1))
    some = edges[:: -(-(len(edges) ** 2) // pairs)]
    meetings = len(shapely.STRtree(edges).query(some, predicate="intersects")[0])
    # Each edge meets itself and its two neighbours; a crossing is met from both of its edges.
    crossings = (meetings / len(some) - 3) * len(edges) / 2
    return crossings > MOST_CROSSINGS
