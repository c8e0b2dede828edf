"""Places in plan view: which lie at one place, which in boxes, and which in polygons."""

import numpy as np
import shapely

from ..settings.tolerances import GEOMETRY


def pair_keys(pairs):
    """One number for each pair of whole numbers below 2³¹, (k, 2) int, that sorts by the first,
    then the second.
    """
    return (pairs[:, 0].astype(np.int64) << 32) + pairs[:, 1]


def merge_places(points):
    """The lowest point at each distinct place, as (p,) int into the points, and the place of each
    point, (k,) int.

    Places are sorted by x, then y; of equally low points the first is taken. Points are rounded to
    the micrometre before, so that what computing adds to one place makes no two of it where the
    border of two cells runs through it.
    """
    places = np.round(points[:, :2], 6)  # to micrometres
    key = pair_keys(np.round(places / GEOMETRY.accuracy).astype(np.int64))
    order = np.lexsort((points[:, 2], key))
    _, first, number = np.unique(key[order], return_index=True, return_inverse=True)
    place = np.empty(len(key), np.int64)
    place[order] = number
    return order[first], place


def unique_pairs(pairs):
    """Distinct pairs, (k, 2) int64, sorted by the first number, then the second."""
    return pairs[np.unique(pair_keys(pairs), return_index=True)[1]]


def find_in_boxes(tree, boxes):
    """Pairs of a place and a box in which, or on whose edge, it lies: two (k,) int64, sorted by
    box.

    Parameters
    ----------
    tree : shapely.STRtree
        Of `plant_tree`.
    boxes : array, (s, 4) float64 [m]
        Least x and y, largest x and y; NaN for none.
    """
    chosen = np.flatnonzero(np.isfinite(boxes).all(axis=1))
    box, place = tree.query(shapely.box(*boxes[chosen].T))
    return place, chosen[box]


def plant_tree(places):
    """Some places, (p, 2 or 3) float64 [m], to be found in boxes in plan view: shapely.STRtree."""
    return shapely.STRtree(shapely.points(places[:, :2]))


def list_runs(first, count):
    """Runs of whole numbers, each from a first one on: the run of each number, and the numbers, two
    (k,) int64.
    """
    count = np.maximum(count, 0)
    run = np.repeat(np.arange(len(first)), count)
    return run, np.arange(len(run)) - np.repeat(np.cumsum(count) - count - first, count)


def join_polygons(shapes):
    """Union of polygons; where GEOS can, each group of touching ones by itself, which takes a
    quarter of the time.
    """
    if shapely.geos_version >= (3, 12) and hasattr(
        shapely, "disjoint_subset_union_all"
    ):  # shapely 2.1
        return shapely.disjoint_subset_union_all(shapes)
    return shapely.union_all(shapes)


def find_inside(shapes, places):
    """Pairs of a place and a polygon in which, or on whose edge, it lies: two (k,) int64.

    The tree holds the places, since queries then prepare the polygons; a tree of polygons that is
    asked for points does not.

    Parameters
    ----------
    shapes : array, (s,) of shapely polygons
    places : array, (p, 2) float64 [m]
    """
    shape, place = plant_tree(places).query(shapes, "intersects")
    return place, shape


def draw_triangles(corners):
    """Triangles (t, 3, 2) as (t,) shapely polygons."""
    closed = np.ascontiguousarray(corners[:, [0, 1, 2, 0], :2]).reshape(-1, 2)
    each = np.arange(len(corners) + 1)
    return shapely.from_ragged_array(shapely.GeometryType.POLYGON, closed, (4 * each, each))


def draw_outlines(shape, chosen, origin, axes):
    """Surfaces with their holes, each projected onto its own axes: (k,) valid shapely
    geometries.
    """
    points, ring_start, polygon_start = shape
    polygon, ring = list_runs(polygon_start[chosen], np.diff(polygon_start)[chosen])
    count = np.diff(ring_start)[ring] + 1  # the first point is repeated at the end
    of_ring, point = list_runs(ring_start[ring], count)
    starts = np.append(0, np.cumsum(count))
    point[starts[1:] - 1] = ring_start[ring]
    pair = polygon[of_ring]
    projected = np.einsum("kj,kij->ki", points[point] - origin[pair], axes[pair])
    offsets = starts, np.append(0, np.cumsum(np.diff(polygon_start)[chosen]))
    outlines = shapely.from_ragged_array(shapely.GeometryType.POLYGON, projected, offsets)
    broken = ~shapely.is_valid(outlines)
    outlines[broken] = shapely.make_valid(outlines[broken])
    return outlines


def join_triangles(triangles, group):
    """Unions of the triangles, (t,) shapely polygons, of each group, (t,) int: groups, (g,) int,
    and their shapes.
    """
    order = np.argsort(group, kind="stable")
    names, first = np.unique(group[order], return_index=True)
    pieces = np.split(triangles[order], first[1:]) if len(names) else []
    return names, np.array([_join_pieces(own) for own in pieces], object)


def _join_pieces(triangles):
    """Union of triangles, by the edges that they share; where some overlap, as on a bent surface,
    by all crossings.
    """
    try:
        joined, area = shapely.coverage_union_all(triangles), shapely.area(triangles).sum()
    except shapely.errors.GEOSException:  # where edges meet only to rounding
        return shapely.union_all(triangles, grid_size=GEOMETRY.corner)
    if shapely.is_valid(joined) and abs(shapely.area(joined) - area) <= GEOMETRY.tie * area:
        return joined
    return shapely.union_all(triangles, grid_size=GEOMETRY.corner)
