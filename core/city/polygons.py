"""Polygons with holes as flat arrays: clean their rings, measure them (Newell's method),
triangulate them.

The area vector of a ring is half the sum of the cross products p_i x p_(i+1) along it. Each polygon
is triangulated on its own plane.
"""

import itertools

import mapbox_earcut
import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..settings.tolerances import GEOMETRY
from .check_geometry import check_rings
from .city import starts_of


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
    repeats = (
        (points == points[next_in_ring(start)]).all(axis=1) if len(points) else np.zeros(0, bool)
    )
    # A ring ends where it began: its last point repeats the first. Other repetitions are mistakes.
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

    The area of a ring is exact where it is planar, else that on its best-fit plane. Holes are
    subtracted whatever their orientation.

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
    """Area vector of every ring, (r, 3) float64 [m²]: along the normal, as long as the area is
    large.
    """
    ring_of_point = np.repeat(np.arange(len(ring_start) - 1), np.diff(ring_start))
    # Relative to the first point of each ring, so that no precision is lost far from the origin.
    first = ring_start[:-1][ring_of_point]  # empty rings have no points
    local = points - points[first] if len(points) else points
    cross = np.cross(local, local[next_in_ring(ring_start)]) if len(points) else local
    sums = [np.bincount(ring_of_point, cross[:, axis], len(ring_start) - 1) for axis in range(3)]
    return 0.5 * np.column_stack(sums)


def next_in_ring(ring_start):
    """Index of the point that follows each point on its ring, (m,) int64."""
    following = np.arange(1, ring_start[-1] + 1)
    full = np.diff(ring_start) > 0
    following[ring_start[1:][full] - 1] = ring_start[:-1][full]
    return following


def polygon_bounds(values, ring_start, polygon_start):
    """Smallest and largest value of each polygon's points, (m,) or (m, k): two arrays (n,) or (n,
    k).
    """
    first = ring_start[polygon_start[:-1]]
    return np.minimum.reduceat(values, first), np.maximum.reduceat(values, first)


def triangulate(points, ring_start, polygon_start):
    """Triangulate polygons, keeping their orientation.

    Triangles stay as they are, quadrilaterals are split along the diagonal whose smaller triangle
    is larger, all others are triangulated in coordinates of the polygon's best-fit plane: by ear
    clipping (mapbox_earcut), or by Delaunay's rule from 500 corners on. Quadrilaterals without an
    inner diagonal are among these.

    Parameters
    ----------
    points : array, (m, 3) float64 [m]
    ring_start : array, (r + 1,) int64
    polygon_start : array, (n + 1,) int64

    Returns
    -------
    triangles : array, (t, 3) int64
        Into points, ordered by polygon.
    triangle_polygon : array, (t,) int64

    Raises
    ------
    InputError
        Rings are not consecutive, or a point is not finite.
    """
    # Size of each polygon: rings, corners, first corner.
    check_rings(points, ring_start, polygon_start)
    area, normal = measure_polygons(points, ring_start, polygon_start)
    ring_count = np.diff(polygon_start)
    first = ring_start[polygon_start[:-1]]
    point_count = ring_start[polygon_start[1:]] - first
    # Relative to the polygon's first point, to keep the precision far from the origin.
    owner = np.repeat(np.arange(len(area)), point_count)
    local = points - points[np.minimum(first, len(points) - 1)][owner]
    plane = np.column_stack(
        [np.einsum("ij,ij->i", local, axes[owner]) for axes in plane_axes(normal)]
    )
    # Triangles and quadrilaterals first, all at once;
    done_triangles = (ring_count == 1) & (point_count == 3)
    triangles = [first[done_triangles, None] + np.arange(3)]
    owners = [np.flatnonzero(done_triangles)]
    quads = np.flatnonzero((ring_count == 1) & (point_count == 4))
    halves, cut = _cut_quads(plane, first[quads])
    triangles.append(halves[cut].reshape(-1, 3))
    owners.append(np.repeat(quads[cut], 2))
    # the others one by one, by ears, or by Delaunay's rule where they have many corners.
    rest = (ring_count > 1) | (point_count > 4)
    rest[quads[~cut]] = True
    for polygon in np.flatnonzero(rest):
        rings = ring_start[polygon_start[polygon] : polygon_start[polygon + 1] + 1]
        corners = np.ascontiguousarray(plane[rings[0] : rings[-1]])
        # Polygons of more than 500 corners get a Delaunay triangulation: ears of a circle are
        # slivers.
        if len(corners) > 500:
            clipped = _triangulate_delaunay(corners, rings - rings[0]) + rings[0]
        else:
            clipped = mapbox_earcut.triangulate_float64(
                corners, (rings[1:] - rings[0]).astype(np.uint32)
            )
            clipped = clipped.reshape(-1, 3).astype(np.int64) + rings[0]
        lost = (
            abs(np.abs(_signed_area(plane, clipped)).sum() - area[polygon])
            if len(rings) > 2
            else 0.0
        )
        # A triangulated area that is off by more than a millionth of the polygon's lost a hole:
        # then holes are subtracted first.
        if lost > GEOMETRY.tie * area[polygon]:
            clipped = _clip_touching_holes(plane, rings, area[polygon], clipped)
        triangles.append(clipped)
        owners.append(np.full(len(clipped), polygon))
    # All face the way of their polygon; those without area are left out.
    triangles, owners = np.concatenate(triangles), np.concatenate(owners)
    signed = _signed_area(plane, triangles)
    # counter-clockwise seen from the front
    triangles = np.where(signed[:, None] < 0, triangles[:, ::-1], triangles)
    sound = np.flatnonzero(np.abs(signed) > GEOMETRY.sliver * _longest_square(plane, triangles))
    order = sound[np.argsort(owners[sound], kind="stable")]
    return triangles[order], owners[order]


def _triangulate_delaunay(corners, rings):
    """Constrained Delaunay triangles of one polygon, (t, 3) int64 into its corners (m, 2) [m].

    Where the polygon is not valid, as where its outline crosses itself, by ear clipping.
    """
    pieces = [corners[first:last] for first, last in itertools.pairwise(rings)]
    shape = shapely.Polygon(pieces[0], pieces[1:])
    if not shape.is_valid:
        clipped = mapbox_earcut.triangulate_float64(corners, rings[1:].astype(np.uint32))
        return clipped.reshape(-1, 3).astype(np.int64)
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(shape))
    places = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3]
    return cKDTree(corners).query(places.reshape(-1, 2))[1].reshape(-1, 3)


def edges_of(triangles):
    """Directed edges of triangles: (3t, 2) int."""
    return np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])


def normals_of(vertices, triangles):
    """Normals of triangles, twice as long as their areas: (t, 3) float64 [m²]."""
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    return np.cross(b - a, c - a)


def drop_unused(vertices, triangles):
    """Leave out vertices that no triangle uses: vertices in the same order, and the triangles
    between them.
    """
    used, corners = np.unique(triangles, return_inverse=True)
    return vertices[used], corners.reshape(-1, 3)


def merge_vertices(points, triangles):
    """Merge identical points (to 0.01 mm) into one vertex, and drop unused ones.

    Returns
    -------
    vertices : array, (v, 3) float64 [m]
        Sorted by place.
    triangles : array, (t, 3) int64
    """
    points, triangles = drop_unused(points, triangles)
    _, first, place = np.unique(
        np.round(points / GEOMETRY.vertex), axis=0, return_index=True, return_inverse=True
    )
    return points[first], place.reshape(-1)[triangles]


def number_connected(one, other, count):
    """A number for each of some things, one for all that pairs of them, two (k,) int, connect:
    (count,) int32.
    """
    pairs = coo_array((np.ones(len(one), bool), (one, other)), shape=(count, count))
    return connected_components(pairs, directed=False)[1]


def plane_axes(normal):
    """Two unit vectors in each plane that form a right-handed system with its normal, each
    (n, 3).
    """
    level = np.hypot(normal[:, 0], normal[:, 1]) < 1e-12
    right = np.column_stack([-normal[:, 1], normal[:, 0], np.zeros(len(normal))])
    right[level] = [1.0, 0.0, 0.0]
    right /= np.linalg.norm(right, axis=1)[:, None]
    return right, np.cross(normal, right)


def _cut_quads(plane, first):
    """Two triangles of each quadrilateral (q, 2, 3), and whether it has an inner diagonal (q,)."""
    # (q, 2, 2, 3)
    halves = first[:, None, None, None] + np.array([[[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [1, 3, 0]]])
    smallest = _signed_area(plane, halves).min(axis=2)  # (q, 2) of each diagonal
    gain = smallest[:, 1] - smallest[:, 0]
    # Areas that differ by less than a millionth count as equal, so that rounding does not choose.
    better = (gain > GEOMETRY.tie * np.abs(smallest).max(axis=1)).astype(np.int64)
    rows = np.arange(len(first))
    chosen = halves[rows, better]
    return chosen, smallest[rows, better] > GEOMETRY.sliver * _longest_square(plane, chosen).max(
        axis=1
    )


def _clip_touching_holes(plane, rings, area, otherwise):
    """Triangles of a polygon whose holes touch its exterior ring, where ear clipping alone may lose
    a hole.

    The holes are subtracted first; the remaining pieces have no touching holes. All their vertices
    are vertices of the polygon, so no point is added.

    Parameters
    ----------
    plane : array, (m, 2) float64 [m]
    rings : array, (r + 1,) int64
        Starts of the polygon's rings into plane.
    area : float [m²]
    otherwise : array, (t, 3) int64
        Returned if the result is not better.
    """
    shapes = [shapely.Polygon(plane[rings[k] : rings[k + 1]]) for k in range(len(rings) - 1)]
    shapes = shapely.make_valid(np.array(shapes, dtype=object))
    # Outline less holes, in pieces.
    left = shapely.difference(shapes[0], shapely.union_all(shapes[1:]))
    pieces = [
        piece
        for piece in shapely.get_parts(left)
        if piece.geom_type == "Polygon" and piece.area > GEOMETRY.sliver * area
    ]
    corners = cKDTree(plane[rings[0] : rings[-1]])
    triangles = [np.empty((0, 3), np.int64)]
    for piece in pieces:
        outline = [np.asarray(ring.coords)[:-1] for ring in (piece.exterior, *piece.interiors)]
        coordinates = np.concatenate(outline)
        # Corners of the pieces are corners of the polygon, by place.
        distance, index = corners.query(coordinates)
        if distance.max() > GEOMETRY.computed:
            return otherwise
        ends = np.cumsum([len(ring) for ring in outline]).astype(np.uint32)
        clipped = mapbox_earcut.triangulate_float64(coordinates, ends).reshape(-1, 3)
        triangles.append(index[clipped] + rings[0])
    triangles = np.concatenate(triangles)
    errors = [abs(np.abs(_signed_area(plane, one)).sum() - area) for one in (triangles, otherwise)]
    return triangles if errors[0] < errors[1] else otherwise


def _signed_area(plane, triangles):
    a, b, c = (plane[triangles[..., k]] for k in range(3))
    u, v = b - a, c - a
    return 0.5 * (u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def _longest_square(plane, triangles):
    corners = plane[triangles]
    edges = corners - np.roll(corners, 1, axis=-2)
    return (edges**2).sum(axis=-1).max(axis=-1)
