"""A Delaunay TIN in plan view through feet and free places that holds the foot edges.

Edges that are missing in the triangulation and hang above it are halved. GEOS takes half the time
of Qhull for 30,000 places, and grows in proportion to their number.
"""

import numpy as np
import shapely
from scipy.spatial import Delaunay, QhullError

from ..settings.errors import InputError
from .plan_geometry import draw_triangles, find_inside, merge_places, pair_keys, unique_pairs
from .polygons import edges_of
from .slope_filter import highest_foot


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
    # GEOS carries heights along: here the row
    numbered = np.column_stack([places, np.arange(len(places))])
    try:
        # a line is any collection of places
        polygons = shapely.delaunay_triangles(shapely.linestrings(numbered))
    except (
        shapely.GEOSException
    ):  # "Could not locate vertex": its search goes round among places almost in line
        middle = places.mean(axis=0)
        try:  # Qhull leaves out places that rounding makes one with others
            return Delaunay(places - middle).simplices.astype(np.int64)
        except QhullError as error:
            where = f"around x {middle[0]:,.0f} m, y {middle[1]:,.0f} m from the scene's origin"
            raise InputError(
                "--ground",
                f"{len(places):,} points of the ground {where} cannot be triangulated",
                "give the ground with --terrain FILE, or none with --ground none",
            ) from error
    corners = shapely.get_coordinates(polygons, include_z=True).reshape(-1, 4, 3)[:, :3, 2]
    return corners.astype(np.int64)


def drop_on_triangles(corners, places):
    """Height [m] of the lowest triangle at each plan position; infinite where there is none.

    Parameters
    ----------
    corners : array, (t, 3, 3) float64 [m]
    places : array, (k, 2) or (k, 3) float64 [m]
    """
    height = np.full(len(places), np.inf)
    place, triangle = find_inside(draw_triangles(corners), places)
    np.fmin.at(height, place, heights_on(corners[triangle], places[place]))
    return height


def heights_on(corners, places):
    """Height of the plane of each triangle, (k, 3, 3), at a place: (k,) float64 [m]; NaN where it
    is upright.
    """
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sloped = ((places[:, :2] - corners[:, 0, :2]) * normal[:, :2]).sum(axis=1)
    steep = np.abs(normal[:, 2]) < 1e-9
    return corners[:, 0, 2] - np.divide(
        sloped, normal[:, 2], out=np.full(len(places), np.nan), where=~steep
    )


def triangulate_feet(lines, foot_points, edges, free, report_share, *, rounds=5):
    """Delaunay TIN of all points; missing foot edges are halved once, and again where they hang
    above the ground.

    Parameters
    ----------
    lines : FootLines
    foot_points : array, (f, 3) float64 [m]
        At distinct places.
    edges : array, (e, 2) int64
        Between them, the smaller number first.
    free : array, (k, 3) float64 [m]
    report_share : callable
        As of `build_scene`, of this step.

    Returns
    -------
    vertices : array, (v, 3) float64 [m]
        The free places, then points on feet.
    triangles : array, (t, 3) int64
        In either orientation.
    """
    first, feet = len(free), foot_points
    # `rounds`: of halving foot edges that are missing, all in the first, then those that hang above
    # the ground.
    for turn in range(rounds + 1):
        report_share(turn / (rounds + 1))
        vertices = np.concatenate([free, feet])
        triangles = triangulate_plan(vertices[:, :2])
        along = feet[edges[:, 1]] - feet[edges[:, 0]]
        sides = pair_keys(np.sort(edges_of(triangles), axis=1))
        missing = edges[
            ~_are_among(pair_keys(edges + first), sides) & (np.linalg.norm(along, axis=1) > 0.5)
        ]
        if turn:  # those above the ground at a quarter, a half or three quarters of them
            ends, along = feet[missing], np.array([0.25, 0.5, 0.75])[:, None]
            places = (1 - along) * ends[:, :1] + along * ends[:, 1:]  # (k, 3, 3)
            height = drop_on_triangles(vertices[triangles], places.reshape(-1, 3)).reshape(
                places.shape[:2]
            )
            # Edges of feet that hang more than 5 mm above the ground are refined.
            missing = missing[(places[..., 2] - height > 0.005).any(axis=1)]
        if turn == rounds or not len(missing):
            return vertices, triangles
        feet, edges = _halve(lines, feet, edges, missing)


def _halve(lines, feet, edges, missing):
    """Points on feet with the middles of some edges, and the edges between them.

    Parameters
    ----------
    lines : FootLines
    feet : array, (f, 3) float64 [m]
    edges : array, (e, 2) int64
    missing : array, (k, 2) int64
        Edges that are halved.

    Returns
    -------
    feet : array, (g, 3) float64 [m]
    edges : array, (h, 2) int64
    """
    count, points = len(feet), np.concatenate([feet, feet[missing].mean(axis=1)])
    lowest, place = merge_places(points)
    feet, fresh = points[lowest], lowest >= count
    feet[fresh, 2] = highest_foot(lines, feet[fresh])
    middle = count + np.arange(len(missing))
    left = edges[~np.isin(pair_keys(edges), pair_keys(missing))]
    halves = [np.column_stack([missing[:, 0], middle]), np.column_stack([missing[:, 1], middle])]
    pairs = np.sort(place[np.concatenate([left, *halves])], axis=1)
    return feet, unique_pairs(pairs[pairs[:, 0] != pairs[:, 1]])


def _are_among(values, others):
    """Which of some whole numbers, (n,) int, are among others, (m,) int: (n,) bool.

    Both are sorted, so that each search ends close to the one before: of a million numbers with 64
    bits five times faster than a hash table.
    """
    order, others, among = np.argsort(values), np.sort(others), np.zeros(len(values), bool)
    if len(others):
        ordered = values[order]
        place = np.minimum(np.searchsorted(others, ordered), len(others) - 1)
        among[order] = others[place] == ordered
    return among
