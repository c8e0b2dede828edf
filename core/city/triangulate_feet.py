"""A TIN through feet and free places that holds the foot edges: missing ones that hang above it are halved."""

import numpy as np

from .places_in_plan import merge_places, pair_keys, unique_pairs
from .slope_filter import highest_foot
from .triangulate_plan import drop_on_triangles, find_missing, triangulate_plan

ROUNDS = 5  # of halving foot edges that are missing, all in the first, then those that hang above the ground
SHORTEST_EDGE = 0.5  # [m]
HANG = 0.005  # [m] foot edges further above the ground are refined
SHARES = np.array([0.25, 0.5, 0.75])  # of an edge, where its height is compared with the ground's


def triangulate_feet(lines, foot_points, edges, free, report_share):
    """Delaunay TIN of all points; missing foot edges are halved once, and again where they hang above the ground.

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
    for turn in range(ROUNDS + 1):
        report_share(turn / (ROUNDS + 1))
        vertices = np.concatenate([free, feet])
        triangles = triangulate_plan(vertices[:, :2])
        along = feet[edges[:, 1]] - feet[edges[:, 0]]
        missing = edges[find_missing(triangles, edges + first) & (np.linalg.norm(along, axis=1) > SHORTEST_EDGE)]
        if turn:
            missing = missing[find_hanging(vertices[triangles], feet[missing])]
        if turn == ROUNDS or not len(missing):
            return vertices, triangles
        feet, edges = halve(lines, feet, edges, missing)


def find_hanging(ground, ends):
    """Edges (k, 2, 3) above the ground (t, 3, 3) at any of their SHARES: (k,) bool."""
    places = (1 - SHARES[:, None]) * ends[:, :1] + SHARES[:, None] * ends[:, 1:]
    height = drop_on_triangles(ground, places.reshape(-1, 3)).reshape(len(ends), -1)
    return (places[..., 2] - height > HANG).any(axis=1)


def halve(lines, feet, edges, missing):
    """Points on feet with the middles of some edges, and the edges between them.

    Parameters
    ----------
    lines : FootLines
    feet : array, (f, 3) float64 [m]
    edges : array, (e, 2) int64
    missing : array, (k, 2) int64
        Those that are halved.

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
