"""Which places lie in which polygons, in plan view."""

import numpy as np
import shapely

MOST_CELLS = 1 << 20  # of the grid, along either side


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
    place, shape = find_in_boxes(shapely.bounds(shapes), places)
    inside = lie_in(shapes[shape], places[place])
    return place[inside], shape[inside]


def lie_in(shapes, places):
    """Whether each place lies in, or on the edge of, its polygon: (k,) bool."""
    shapely.prepare(shapes)
    return shapely.intersects_xy(shapes, *places.T)


def find_in_boxes(boxes, places):
    """Pairs of a place and a box in which, or on whose edge, it lies: two (k,) int64, sorted by box.

    Places are sorted by the cells of a grid, row after row: in each row that a box meets they follow one another.

    Parameters
    ----------
    boxes : array, (s, 4) float64 [m]
        Least x and y, largest x and y; NaN for none.
    places : array, (p, 2) float64 [m]
    """
    chosen = np.flatnonzero(np.isfinite(boxes).all(axis=1))
    if not len(chosen) or not len(places):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    origin, boxes = places.min(axis=0), boxes[chosen]
    extent = places.max(axis=0) - origin
    size = max(0.25 * (boxes[:, 2:] - boxes[:, :2]).mean(), extent.max() / MOST_CELLS, np.finfo(float).tiny)
    columns, rows = np.floor(extent / size).astype(np.int64) + 1
    cells = np.floor((places - origin) / size).astype(np.int64)
    key = cells[:, 1] * columns + cells[:, 0]
    order = np.argsort(key)
    key = key[order]
    met = np.clip(np.floor((boxes - np.tile(origin, 2)) / size), -1, np.tile([columns, rows], 2)).astype(np.int64)
    met = np.clip(met, [0, 0, -1, -1], [columns, rows, columns - 1, rows - 1])
    count = np.maximum(met[:, 3] - met[:, 1] + 1, 0)
    box = np.repeat(np.arange(len(boxes)), count)
    row = np.arange(len(box)) - np.repeat(np.cumsum(count) - count - met[:, 1], count)
    first = np.searchsorted(key, row * columns + met[box, 0])
    last = np.searchsorted(key, row * columns + met[box, 2], "right")
    count = np.maximum(last - first, 0)
    box = np.repeat(box, count)
    place = order[np.arange(len(box)) - np.repeat(np.cumsum(count) - count - first, count)]
    x, y = places[place].T
    low_x, low_y, high_x, high_y = boxes[box].T
    inside = (x >= low_x) & (x <= high_x) & (y >= low_y) & (y <= high_y)
    return place[inside], chosen[box[inside]]


def draw_triangles(corners):
    """Triangles (t, 3, 2) as (t,) shapely polygons."""
    closed = np.ascontiguousarray(corners[:, [0, 1, 2, 0], :2]).reshape(-1, 2)
    each = np.arange(len(corners) + 1)
    return shapely.from_ragged_array(shapely.GeometryType.POLYGON, closed, (4 * each, each))
