"""Delaunay triangulation of places in plan view, and its change where a few places are added.

GEOS takes half the time of Qhull for 30,000 places, and grows in proportion to their number. A place that is added
changes only the triangles in whose circumcircles it lies: their corners alone are triangulated again.
"""

import numpy as np
import shapely
from scipy.spatial import Delaunay, QhullError, cKDTree

from ..settings.errors import InputError
from .in_polygons import draw_triangles
from .merge_places import pair_keys, unique_pairs
from .triangle_sides import has_edges, sort_sides

FEW = 16  # places that are compared with all triangles, one after the other
TIE = 1e-9  # relative distance from a circumcircle within which a place counts as inside


def triangulate_plan(places):
    """Delaunay triangles of places.

    Parameters
    ----------
    places : array, (p, 2) float64 [m]
        Without duplicates.

    Returns
    -------
    (t, 3) int64
        All turning the same way.

    Raises
    ------
    InputError
        Neither GEOS nor Qhull can triangulate them.
    """
    numbered = np.column_stack([places, np.arange(len(places))])  # GEOS carries heights along: here the row
    try:
        polygons = shapely.delaunay_triangles(shapely.linestrings(numbered))  # a line is any collection of places
    except shapely.GEOSException:  # "Could not locate vertex": its search goes round among places almost in line
        return triangulate_slowly(places)
    corners = shapely.get_coordinates(polygons, include_z=True).reshape(-1, 4, 3)[:, :3, 2]
    return corners.astype(np.int64)


def triangulate_slowly(places):
    """The same with Qhull, which leaves out places that rounding makes one with others."""
    middle = places.mean(axis=0)
    try:
        return Delaunay(places - middle).simplices.astype(np.int64)
    except QhullError as error:
        where = f"around x {middle[0]:,.0f} m, y {middle[1]:,.0f} m from the scene's origin"
        problem = f"{len(places):,} points of the ground {where} cannot be triangulated"
        raise InputError(
            "--ground", problem, "give the ground with --terrain FILE, or none with --ground none"
        ) from error


def add_places(places, mesh, new, start):
    """Delaunay triangles after some places were added.

    Parameters
    ----------
    places : array, (p, 2) float64 [m]
        Old and new.
    mesh : tuple of (t, 3) int64
        Delaunay triangles of the old places, and their neighbours.
    new : array, (k,) int
        Places that no triangle has yet.
    start : array, (k,) int
        The triangle in which each of them lies; -1 beyond all.

    Returns
    -------
    triangles : (s, 3) int64
        Those that are left come first, in their order.
    gone : (t,) bool
        Triangles of before that are not among them.
    """
    triangles, _ = mesh
    gone = find_cavity(places, mesh, new, start) if (start >= 0).all() else np.ones(len(triangles), bool)
    left, pieces = gone.copy(), [triangles[:0]]
    while not gone.all():
        used = np.union1d(triangles[left], new[left[start]])
        fresh = used[triangulate_plan(places[used])]
        sides, inside, beyond = find_border(mesh, left)
        lost = ~has_edges(sort_sides(fresh), sides)
        again = hang_together(mesh, left, inside[lost])
        done = left & ~again
        pieces.append(fresh[inside_any(places[fresh].mean(axis=1), places[triangles[done]])])
        if not lost.any():
            return np.concatenate([triangles[~gone], *pieces]), gone
        if (beyond[lost] < 0).any() or (gone & ~again)[beyond[lost]].any():
            break
        left = again
        gone[beyond[lost]] = left[beyond[lost]] = True  # of four corners on one circle, either diagonal may be drawn
    return triangulate_plan(places), np.ones(len(triangles), bool)


def find_cavity(places, mesh, new, start):
    """Triangles with a new place in or on their circumcircles: (t,) bool.

    For each new place they hang together, around the triangle in which it lies.
    """
    triangles, neighbours = mesh
    gone = np.zeros(len(triangles), bool)
    pairs = unique_pairs(np.column_stack([start, new]))
    seen = pair_keys(pairs)
    while len(pairs):
        gone[pairs[:, 0]] = True
        beyond = np.column_stack([neighbours[pairs[:, 0]].ravel(), np.repeat(pairs[:, 1], 3)])
        beyond = unique_pairs(beyond[beyond[:, 0] >= 0])
        beyond = beyond[~np.isin(pair_keys(beyond), seen)]
        seen = np.concatenate([seen, pair_keys(beyond)])
        pairs = beyond[in_circles(places, triangles[beyond[:, 0]], beyond[:, 1])]
    return gone


def hang_together(mesh, chosen, rows):
    """Of the chosen triangles, (t,) bool, those that hang together with some of them, (k,) int: (t,) bool."""
    found = np.zeros(len(chosen), bool)
    while len(rows):
        found[rows] = True
        rows = np.unique(mesh[1][rows])
        rows = rows[(rows >= 0) & chosen[rows] & ~found[rows]]
    return found


def find_border(mesh, chosen):
    """Sides of some triangles towards others, (b, 2), and the triangles within and beyond, two (b,) int, the latter -1
    beyond the hull."""
    triangles, neighbours = mesh
    rows = np.flatnonzero(chosen)
    beyond = neighbours[rows]
    open_side = (beyond < 0) | ~chosen[beyond]
    sides = np.stack([triangles[rows], triangles[rows][:, [1, 2, 0]]], axis=2)[open_side]
    return np.sort(sides, axis=1), np.repeat(rows, 3)[open_side.ravel()], beyond[open_side]


def in_circles(places, triangles, others):
    """Whether a place lies in or on the circle through a triangle, or that has no area: (k,) bool."""
    centre, radius = circumscribe(places[triangles])
    away = np.hypot(*(places[others] - centre).T)
    return ~(away > radius * (1 + TIE))


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
        scale = 0.5 / twice_areas(corners)
        x = scale * (c[:, 1] * squares[0] - b[:, 1] * squares[1])
        y = scale * (b[:, 0] * squares[1] - c[:, 0] * squares[0])
        return corners[:, 0] + np.column_stack([x, y]), np.hypot(x, y)


def twice_areas(corners):
    """Twice the areas of triangles in plan, positive where they turn to the left: (t,) float64 [m²]."""
    b, c = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0]


def inside_any(places, corners):
    """Whether places lie in any of some triangles: (p,) bool."""
    found = np.zeros(len(places), bool)
    found[shapely.STRtree(draw_triangles(corners)).query(shapely.points(places), "intersects")[0]] = True
    return found


def near_any(corners, places):
    """Whether any of some places may lie in a triangle: none that does is missed. (t,) bool.

    Parameters
    ----------
    corners : array, (t, 3, 2) float64 [m]
    places : array, (p, 2) float64 [m]
    """
    near = np.zeros(len(corners), bool)
    if len(places) <= FEW:
        low, high = (pick(pick(corners[:, 0], corners[:, 1]), corners[:, 2]) for pick in (np.minimum, np.maximum))
        for place in places:
            rows = np.flatnonzero((low[:, 0] <= place[0]) & (high[:, 0] >= place[0]))
            near[rows] |= (low[rows, 1] <= place[1]) & (high[rows, 1] >= place[1])
        return near
    middle = corners.mean(axis=1)
    radius = np.sqrt(((corners - middle[:, None]) ** 2).sum(axis=2).max(axis=1))
    return cKDTree(places).query(middle)[0] <= radius * (1 + TIE)


def find_triangle(corners, places):
    """A triangle below or above each place: (p,) int; -1 beyond all.

    Parameters
    ----------
    corners : array, (t, 3, 2) float64 [m]
    places : array, (p, 2) float64 [m]
    """
    near = np.flatnonzero(near_any(corners, places))  # few, where there are few places
    place, triangle = shapely.STRtree(draw_triangles(corners[near])).query(shapely.points(places), "intersects")
    found = np.full(len(places), -1)
    found[place] = near[triangle]
    return found
