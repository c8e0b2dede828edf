"""Delaunay triangulation of places in plan view, which edges it lacks, and the heights of its triangles.

GEOS takes half the time of Qhull for 30,000 places, and grows in proportion to their number.
"""

import numpy as np
import shapely
from scipy.spatial import Delaunay, QhullError

from ..errors import InputError
from .places_in_plan import draw_triangles, pair_keys

SLICE = 100_000  # places at once, to limit memory


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


def find_missing(triangles, edges):
    """Edges, (e, 2) int64 with the smaller number first, that are no sides of triangles, (t, 3) int64: (e,) bool."""
    sides = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    return ~np.isin(pair_keys(edges), pair_keys(sides))


def drop_on_triangles(corners, places):
    """Height [m] of the lowest triangle at each plan position; infinite where there is none.

    Parameters
    ----------
    corners : array, (t, 3, 3) float64 [m]
    places : array, (k, 2) or (k, 3) float64 [m]
    """
    height = np.full(len(places), np.inf)
    if not len(places):
        return height
    tree = shapely.STRtree(draw_triangles(corners))
    for first in range(0, len(places), SLICE):
        some, lowest = places[first : first + SLICE], height[first : first + SLICE]
        place, triangle = tree.query(shapely.points(some[:, :2]), predicate="intersects")
        np.fmin.at(lowest, place, heights_on(corners[triangle], some[place]))
    return height


def heights_on(corners, places):
    """Height of the plane of each triangle, (k, 3, 3), at a place: (k,) float64 [m]; NaN where it is upright."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sloped = ((places[:, :2] - corners[:, 0, :2]) * normal[:, :2]).sum(axis=1)
    steep = np.abs(normal[:, 2]) < 1e-9
    return corners[:, 0, 2] - np.divide(sloped, normal[:, 2], out=np.full(len(places), np.nan), where=~steep)
