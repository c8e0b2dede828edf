"""Rings of polygons with holes as flat arrays: clean them, and measure them by Newell's method.

The area vector of a ring is half the sum of the cross products p_i x p_(i+1) along it.
"""

import numpy as np


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
    closed = np.bincount(ring_of_point[repeats & last], minlength=len(rings)) > 0
    changed = {
        "ring was not closed": np.unique(ring_polygon[~closed & (count > 0)]),
        "repeated point removed": np.unique(ring_polygon[ring_of_point[repeats & ~last]]),
    }
    return points[keep], starts_of(np.bincount(ring_of_point[keep], minlength=len(rings))), changed


def measure_polygons(points, ring_start, polygon_start):
    """Area without holes and unit normal of every polygon.

    The area of a ring is exact where it is planar, else that on its best-fit plane. Holes are subtracted whatever their
    orientation.

    Parameters
    ----------
    points : array, (m, 3) float64 [m]
    ring_start : array, (r + 1,) int
    polygon_start : array, (n + 1,) int

    Returns
    -------
    area : array, (n,) float64 [m²]
    normal : array, (n, 3) float64
        Unit length; zero if the area is zero.
    """
    vectors = measure_rings(points, ring_start)  # (r, 3)
    polygon_count = len(polygon_start) - 1
    outline = vectors[polygon_start[:-1]] if polygon_count else np.empty((0, 3))
    size = np.linalg.norm(outline, axis=1)
    normal = np.divide(outline, size[:, None], out=np.zeros_like(outline), where=size[:, None] > 0)
    ring_polygon = np.repeat(np.arange(polygon_count), np.diff(polygon_start))  # (r,)
    signed = -np.abs(np.einsum("ij,ij->i", vectors, normal[ring_polygon]))
    signed[polygon_start[:-1]] *= -1
    return np.bincount(ring_polygon, weights=signed, minlength=polygon_count), normal


def measure_rings(points, ring_start):
    """Area vector of every ring, (r, 3) float64 [m²]: along the normal, as long as the area is large."""
    ring_of_point = np.repeat(np.arange(len(ring_start) - 1), np.diff(ring_start))
    # Relative to the first point of each ring, so that no precision is lost far from the origin.
    first = ring_start[:-1][ring_of_point]  # empty rings have no points
    local = points - points[first] if len(points) else points
    cross = np.cross(local, local[next_in_ring(ring_start)]) if len(points) else local
    sums = [np.bincount(ring_of_point, cross[:, axis], len(ring_start) - 1) for axis in range(3)]
    return 0.5 * np.column_stack(sums)


def starts_of(counts):
    """Start index of each of consecutive pieces, and the end of the last one, (n + 1,) int64."""
    return np.concatenate([[0], np.cumsum(counts, dtype=np.int64)]).astype(np.int64)


def next_in_ring(ring_start):
    """Index of the point that follows each point on its ring, (m,) int64."""
    following = np.arange(1, ring_start[-1] + 1)
    full = np.diff(ring_start) > 0
    following[ring_start[1:][full] - 1] = ring_start[:-1][full]
    return following


def polygon_bounds(values, ring_start, polygon_start):
    """Smallest and largest value of each polygon's points, two arrays (n,)."""
    first = ring_start[polygon_start[:-1]]
    return np.minimum.reduceat(values, first), np.maximum.reduceat(values, first)
