"""Triangulate polygons with holes, each on its own plane."""

import mapbox_earcut
import numpy as np
import shapely
from scipy.spatial import cKDTree

from .check_geometry import check_rings
from .measure_polygons import measure_polygons

THIN = 1e-9  # relative to the longest edge squared: triangles of less area are degenerate
TIE = 1e-6  # areas that differ by less than this share count as equal, so that rounding does not choose the diagonal
LOST_SHARE = 1e-6  # of a polygon's area: a larger error of the triangulated area means that a hole was lost
TOUCHING = 1e-4  # [m] vertices closer than this are the same


def triangulate(points, ring_start, polygon_start):
    """Triangulate polygons, keeping their orientation.

    Triangles stay as they are, quadrilaterals are split along the diagonal whose smaller triangle is larger, all others
    are triangulated by ear clipping (mapbox_earcut) in coordinates of the polygon's best-fit plane.

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
    check_rings(points, ring_start, polygon_start)
    area, normal = measure_polygons(points, ring_start, polygon_start)
    ring_count = np.diff(polygon_start)
    first = ring_start[polygon_start[:-1]]
    point_count = ring_start[polygon_start[1:]] - first
    plane = project_to_planes(points, normal, np.repeat(np.arange(len(area)), point_count))
    done_triangles = (ring_count == 1) & (point_count == 3)
    triangles = [first[done_triangles, None] + np.arange(3)]
    owners = [np.flatnonzero(done_triangles)]
    quads = np.flatnonzero((ring_count == 1) & (point_count == 4))
    halves, cut = _cut_quads(plane, first[quads])
    triangles.append(halves[cut].reshape(-1, 3))
    owners.append(np.repeat(quads[cut], 2))
    rest = (ring_count > 1) | (point_count > 4)
    rest[quads[~cut]] = True
    for polygon in np.flatnonzero(rest):
        rings = ring_start[polygon_start[polygon] : polygon_start[polygon + 1] + 1]
        clipped = _clip_ears(plane, rings)
        if len(rings) > 2 and abs(_covered(plane, clipped) - area[polygon]) > LOST_SHARE * area[polygon]:
            clipped = clip_touching_holes(plane, rings, area[polygon], clipped)
        triangles.append(clipped)
        owners.append(np.full(len(clipped), polygon))
    triangles, owners = np.concatenate(triangles), np.concatenate(owners)
    triangles, sound = _orient(plane, triangles)
    triangles, owners = triangles[sound], owners[sound]
    order = np.argsort(owners, kind="stable")
    return triangles[order], owners[order]


def project_to_planes(points, normal, polygon_of_point):
    """Coordinates of each point in its polygon's plane, seen from the front, (m, 2) float64 [m].

    They are relative to the polygon's first point, to keep their precision far from the origin.
    """
    first = np.unique(polygon_of_point, return_index=True)[1]
    start = np.zeros(len(normal), np.int64)
    start[polygon_of_point[first]] = first
    local = points - points[start][polygon_of_point]
    right, upward = plane_axes(normal)
    return np.column_stack([np.einsum("ij,ij->i", local, axes[polygon_of_point]) for axes in (right, upward)])


def plane_axes(normal):
    """Two unit vectors in each plane that form a right-handed system with its normal, each (n, 3)."""
    level = np.hypot(normal[:, 0], normal[:, 1]) < 1e-12
    right = np.column_stack([-normal[:, 1], normal[:, 0], np.zeros(len(normal))])
    right[level] = [1.0, 0.0, 0.0]
    right /= np.linalg.norm(right, axis=1)[:, None]
    return right, np.cross(normal, right)


def _cut_quads(plane, first):
    """Two triangles of each quadrilateral (q, 2, 3), and whether it has an inner diagonal (q,)."""
    halves = first[:, None, None, None] + np.array([[[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [1, 3, 0]]])  # (q, 2, 2, 3)
    smallest = _signed_area(plane, halves).min(axis=2)  # (q, 2) of each diagonal
    gain = smallest[:, 1] - smallest[:, 0]
    better = (gain > TIE * np.abs(smallest).max(axis=1)).astype(np.int64)
    rows = np.arange(len(first))
    chosen = halves[rows, better]
    return chosen, smallest[rows, better] > THIN * _longest_square(plane, chosen).max(axis=1)


def _clip_ears(plane, rings):
    start = rings[0]
    if rings[-1] - start < 3:
        return np.empty((0, 3), np.int64)
    corners = np.ascontiguousarray(plane[start : rings[-1]])
    ends = (rings[1:] - start).astype(np.uint32)
    return mapbox_earcut.triangulate_float64(corners, ends).reshape(-1, 3).astype(np.int64) + start


def clip_touching_holes(plane, rings, area, otherwise):
    """Triangles of a polygon whose holes touch its exterior ring, where ear clipping alone may lose a hole.

    The holes are subtracted first; the remaining pieces have no touching holes. All their vertices are vertices of the
    polygon, so no point is added.

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
    left = shapely.difference(shapes[0], shapely.union_all(shapes[1:]))
    pieces = [piece for piece in shapely.get_parts(left) if piece.geom_type == "Polygon" and piece.area > THIN * area]
    corners = cKDTree(plane[rings[0] : rings[-1]])
    triangles = [np.empty((0, 3), np.int64)]
    for piece in pieces:
        outline = [np.asarray(ring.coords)[:-1] for ring in (piece.exterior, *piece.interiors)]
        coordinates = np.concatenate(outline)
        distance, index = corners.query(coordinates)
        if distance.max() > TOUCHING:
            return otherwise
        ends = np.cumsum([len(ring) for ring in outline]).astype(np.uint32)
        clipped = mapbox_earcut.triangulate_float64(coordinates, ends).reshape(-1, 3)
        triangles.append(index[clipped] + rings[0])
    triangles = np.concatenate(triangles)
    better = abs(_covered(plane, triangles) - area) < abs(_covered(plane, otherwise) - area)
    return triangles if better else otherwise


def _covered(plane, triangles):
    return np.abs(_signed_area(plane, triangles)).sum()


def _signed_area(plane, triangles):
    a, b, c = (plane[triangles[..., k]] for k in range(3))
    u, v = b - a, c - a
    return 0.5 * (u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def _longest_square(plane, triangles):
    corners = plane[triangles]
    edges = corners - np.roll(corners, 1, axis=-2)
    return (edges**2).sum(axis=-1).max(axis=-1)


def _orient(plane, triangles):
    """Triangles counter-clockwise seen from the front, and which of them are not degenerate."""
    signed = _signed_area(plane, triangles)
    triangles = np.where(signed[:, None] < 0, triangles[:, ::-1], triangles)
    return triangles, np.abs(signed) > THIN * _longest_square(plane, triangles)
