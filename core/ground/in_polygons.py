"""Which places lie in which polygons, in plan view."""

import numpy as np
import shapely

from .place_grid import find_in_boxes, lay_grid


def join_polygons(shapes):
    """Union of polygons; where GEOS can, each group of touching ones by itself, which takes a quarter of the time."""
    if shapely.geos_version >= (3, 12) and hasattr(shapely, "disjoint_subset_union_all"):  # shapely 2.1
        return shapely.disjoint_subset_union_all(shapes)
    return shapely.union_all(shapes)


def find_inside(shapes, places):
    """Pairs of a place and a polygon in which, or on whose edge, it lies: two (k,) int64.

    Polygons are prepared, which queries of a tree of polygons with points do not do.

    Parameters
    ----------
    shapes : array, (s,) of shapely polygons
    places : array, (p, 2) float64 [m]
    """
    boxes = shapely.bounds(shapes)
    place, shape = find_in_boxes(lay_grid(places, boxes), boxes)
    inside = lie_in(shapes[shape], places[place])
    return place[inside], shape[inside]


def lie_in(shapes, places):
    """Whether each place lies in, or on the edge of, its polygon: (k,) bool."""
    shapely.prepare(shapes)
    return shapely.intersects_xy(shapes, *places.T)


def draw_triangles(corners):
    """Triangles (t, 3, 2) as (t,) shapely polygons."""
    closed = np.ascontiguousarray(corners[:, [0, 1, 2, 0], :2]).reshape(-1, 2)
    each = np.arange(len(corners) + 1)
    return shapely.from_ragged_array(shapely.GeometryType.POLYGON, closed, (4 * each, each))
