"""Find polygons whose file has exchanged outline and hole, and put the larger ring first."""

import numpy as np
import shapely

from .clean_rings import starts_of
from .measure_polygons import measure_rings
from .triangulate import plane_axes

WITHIN = 0.999  # share of the given outline that must lie in its hole


def exchange_rings(points, ring_start, polygon_start):
    """Put the largest ring of a polygon first if the given outline lies within it.

    Some producers write a court as the outline of its house, and the house as the hole. The largest ring then is the
    outline, in its own direction, and the ring that stood first is a hole.

    Parameters
    ----------
    points : array, (m, 3) float64 [m]
    ring_start : array, (r + 1,) int64
    polygon_start : array, (n + 1,) int64

    Returns
    -------
    points : array, (m, 3) float64
    ring_start : array, (r + 1,) int64
    exchanged : array, (k,) int64
        Indices of the polygons.
    """
    vectors = measure_rings(points, ring_start)
    area = np.linalg.norm(vectors, axis=1)
    exchanged, order = [], np.arange(len(area))
    for polygon in np.flatnonzero(np.diff(polygon_start) > 1):
        first, last = polygon_start[polygon : polygon + 2]
        largest = first + int(np.argmax(area[first:last]))
        if largest > first and area[first] > 0 and _lies_within(points, ring_start, first, largest, vectors[largest]):
            order[[first, largest]] = largest, first
            exchanged.append(polygon)
    if not exchanged:
        return points, ring_start, np.zeros(0, np.int64)
    pieces = [points[ring_start[ring] : ring_start[ring + 1]] for ring in order]
    return np.concatenate(pieces), starts_of([len(piece) for piece in pieces]), np.array(exchanged, np.int64)


def _lies_within(points, ring_start, inner, outer, vector):
    """Whether one ring lies within another, seen along the area vector of the outer one."""
    right, upward = plane_axes(vector[None] / np.linalg.norm(vector))
    origin = points[ring_start[outer]]
    rings = [points[ring_start[ring] : ring_start[ring + 1]] - origin for ring in (inner, outer)]
    small, large = (shapely.make_valid(shapely.Polygon(ring @ np.concatenate([right, upward]).T)) for ring in rings)
    return small.area > 0 and small.intersection(large).area >= WITHIN * small.area
