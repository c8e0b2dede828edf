"""Open the rings of polygons and remove duplicate points."""

import numpy as np

from .measure_polygons import next_in_ring


def clean_rings(rings, polygon_start):
    """Open the rings and remove points that repeat the one before.

    Parameters
    ----------
    rings : list of (k, 3) float64 [m]
    polygon_start : array, (n + 1,) int64

    Returns
    -------
    points : array, (m, 3) float64
    ring_start : array, (r + 1,) int64
    changed : dict
        Reason -> indices of polygons.
    """
    points = np.concatenate([np.empty((0, 3)), *rings])
    start = starts_of([len(ring) for ring in rings])
    count = np.diff(start)
    ring_of_point = np.repeat(np.arange(len(rings)), count)
    repeats = (points == points[next_in_ring(start)]).all(axis=1) if len(points) else np.zeros(0, bool)
    last = np.zeros(len(points), bool)
    last[start[1:][count > 0] - 1] = True
    keep = ~repeats | (count[ring_of_point] == 1)
    ring_polygon = np.repeat(np.arange(len(polygon_start) - 1), np.diff(polygon_start))
    unclosed = np.ones(len(rings), bool)
    unclosed[ring_of_point[repeats & last]] = False
    doubled = np.zeros(len(rings), bool)
    doubled[ring_of_point[repeats & ~last]] = True
    changed = {
        "ring was not closed": np.unique(ring_polygon[unclosed & (count > 0)]),
        "repeated point removed": np.unique(ring_polygon[doubled]),
    }
    kept_count = np.bincount(ring_of_point[keep], minlength=len(rings))
    return points[keep], starts_of(kept_count), changed


def starts_of(counts):
    """Start index of each of consecutive pieces, and the end of the last one, (n + 1,) int64."""
    return np.concatenate([[0], np.cumsum(counts, dtype=np.int64)]).astype(np.int64)
