"""Delaunay triangulation of places in plan view, and its change where a few places are added.

GEOS takes half the time of Qhull for 30,000 places, and grows in proportion to their number. A place that is added
changes only the triangles in whose circumcircles it lies: those places alone are triangulated again.
"""

import numpy as np
import shapely
from scipy.spatial import cKDTree

TIE = 1e-9  # relative distance from a circumcircle within which a place counts as inside
SAME_AREA = 1e-9  # relative difference of areas by rounding


def triangulate_plan(places):
    """Delaunay triangles of places.

    Parameters
    ----------
    places : array, (p, 2) float64 [m]
        Without duplicates.

    Returns
    -------
    (t, 3) int64
        In either orientation.
    """
    polygons = shapely.delaunay_triangles(shapely.linestrings(places))  # a line is any collection of places
    corners = shapely.get_coordinates(polygons).reshape(-1, 4, 2)[:, :3]
    key = as_keys(places)
    order = np.argsort(key)
    return order[np.searchsorted(key[order], as_keys(corners.reshape(-1, 2)))].reshape(-1, 3)


def as_keys(places):
    """Complex numbers, which numpy sorts by x, then y: (p,)."""
    return places[:, 0] + 1j * places[:, 1]


def add_places(places, triangles, new):
    """Delaunay triangles after some places were added.

    Parameters
    ----------
    places : array, (p, 2) float64 [m]
        Old and new.
    triangles : array, (t, 3) int64
        Delaunay, of the old places.
    new : array, (k,) int
        Places that no triangle has yet, within the convex hull of the others.

    Returns
    -------
    triangles : (t, 3) int64
    kept : int
        So many of the first were there before.
    """
    centre, radius = circumscribe(places[triangles])
    known = np.isfinite(radius)
    near = np.zeros(len(triangles))
    near[known] = cKDTree(places[new]).query(centre[known])[0]
    gone = ~known | (near <= radius * (1 + TIE))
    cavity = places[triangles[gone]]
    used = np.union1d(triangles[gone], new)
    fresh = used[triangulate_plan(places[used])]
    fresh = fresh[inside_any(places[fresh].mean(axis=1), cavity)]
    if abs(areas(places[fresh]).sum() - areas(cavity).sum()) > SAME_AREA * areas(cavity).sum():
        return triangulate_plan(places), 0  # ties were broken in another way
    return np.concatenate([triangles[~gone], fresh]), int((~gone).sum())


def circumscribe(corners):
    """Centres and radii of the circles through the corners of triangles; not finite where these are in line.

    Returns
    -------
    centre : (t, 2) float64 [m]
    radius : (t,) float64 [m]
    """
    b, c = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    squares = (b**2).sum(axis=1), (c**2).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        scale = 0.5 / (b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0])
        x = scale * (c[:, 1] * squares[0] - b[:, 1] * squares[1])
        y = scale * (b[:, 0] * squares[1] - c[:, 0] * squares[0])
        return corners[:, 0] + np.column_stack([x, y]), np.hypot(x, y)


def areas(corners):
    """Areas of triangles in plan: (t,) float64 [m²]."""
    b, c = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return 0.5 * np.abs(b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0])


def inside_any(places, corners):
    """Whether places lie in any of some triangles: (p,) bool."""
    found = np.zeros(len(places), bool)
    found[shapely.STRtree(shapely.polygons(corners)).query(shapely.points(places), "intersects")[0]] = True
    return found


def near_any(corners, places):
    """Whether any of some places may lie in a triangle: none that does is missed. (t,) bool.

    Parameters
    ----------
    corners : array, (t, 3, 2) float64 [m]
    places : array, (p, 2) float64 [m]
    """
    middle = corners.mean(axis=1)
    radius = np.sqrt(((corners - middle[:, None]) ** 2).sum(axis=2).max(axis=1))
    return cKDTree(places).query(middle)[0] <= radius * (1 + TIE) if len(places) else np.zeros(len(corners), bool)


def find_triangle(corners, places):
    """A triangle below or above each place: (p,) int; -1 beyond all.

    Parameters
    ----------
    corners : array, (t, 3, 2) float64 [m]
    places : array, (p, 2) float64 [m]
    """
    place, triangle = shapely.STRtree(shapely.polygons(corners)).query(shapely.points(places), "intersects")
    found = np.full(len(places), -1)
    found[place] = triangle
    return found


def has_edges(triangles, edges):
    """Whether edges are sides of triangles: (e,) bool.

    Parameters
    ----------
    triangles : array, (t, 3) int64
    edges : array, (e, 2) int64
        The smaller number first.
    """
    size = np.int64(max(triangles.max(initial=0), edges.max(initial=0)) + 1)
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return np.isin(edges[:, 0] * size + edges[:, 1], sides[:, 0] * size + sides[:, 1])
