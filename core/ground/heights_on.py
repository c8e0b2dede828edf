"""Heights of triangles at places in plan view."""

import numpy as np
import shapely

from .in_polygons import draw_triangles
from .triangulate_plan import near_any

SLICE = 100_000  # places at once, to limit memory


def drop_on_triangles(corners, places):
    """Height [m] of the lowest triangle at each plan position; infinite where there is none.

    Parameters
    ----------
    corners : array, (t, 3, 3) float64 [m]
    places : array, (k, 2) or (k, 3) float64 [m]
    """
    near = np.flatnonzero(near_any(corners[:, :, :2], places[:, :2]))  # few, where there are few places
    tree = shapely.STRtree(draw_triangles(corners[near, :, :2]))
    height = np.full(len(places), np.inf)
    for first in range(0, len(places), SLICE):
        some, lowest = places[first : first + SLICE], height[first : first + SLICE]
        place, triangle = tree.query(shapely.points(some[:, :2]), predicate="intersects")
        np.fmin.at(lowest, place, heights_on(corners[near[triangle]], some[place]))
    return height


def heights_on(corners, places):
    """Height of each place's triangle there: (k,) float64 [m]; NaN where it has no area in plan view."""
    a, b, c = (corners[:, k] for k in range(3))
    normal = np.cross(b - a, c - a)
    sloped = ((places[:, :2] - a[:, :2]) * normal[:, :2]).sum(axis=1)
    steep = np.abs(normal[:, 2]) < 1e-9
    rise = np.divide(sloped, normal[:, 2], out=np.full(len(places), np.nan), where=~steep)
    return a[:, 2] - rise
