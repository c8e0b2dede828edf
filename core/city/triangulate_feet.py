"""A TIN through feet and free places that holds the foot edges: missing ones that hang above it are halved."""

import numpy as np

from .places_in_plan import merge_places, pair_keys, place_keys, unique_pairs
from .slope_filter import highest_foot
from .triangulate_plan import (
    add_places,
    drop_on_triangles,
    find_neighbours,
    has_edges,
    heights_on,
    renew_neighbours,
    sort_sides,
    triangle_at,
    triangulate_plan,
    walk,
)

ROUNDS = 4  # of halving foot edges that hang above the ground
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
    edges : tuple of (e, 2) int64 and (e,) bool
        Between them, the smaller number first, and whether each is missing in the triangulation of all.
    free : array, (k, 3) float64 [m]
    report_share : callable
        As of `build_scene`, of this step.

    Returns
    -------
    vertices : array, (v, 3) float64 [m]
        Points on feet, sorted by place; then the free places.
    triangles : array, (t, 3) int64
        In either orientation.
    """
    edges, cut = edges
    vertices, edges, first = np.concatenate([free, foot_points]), edges + len(free), len(free)
    missing = find_long(vertices, edges[cut])
    if len(missing):
        vertices, edges, _, _ = halve(lines, vertices, first, edges, missing)
    triangles = triangulate_plan(vertices[:, :2])
    sides = sort_sides(triangles)
    mesh, missing = (triangles, find_neighbours(sides)), find_long(vertices, edges[~has_edges(sides, edges)])
    lying, on = np.zeros((0, 2), np.int64), np.zeros((0, len(SHARES)), np.int64)
    for turn in range(ROUNDS):
        report_share((turn + 1) / (ROUNDS + 1))
        hang, found = find_hanging(vertices, mesh, missing)
        if not hang.any():
            break
        count = len(vertices)
        vertices, halved, source, in_place = halve(lines, vertices, first, edges, missing[hang])
        new = np.arange(count, len(vertices))
        start = walk(vertices[:, :2], mesh, vertices[new, :2], found[hang, 1][source])
        if in_place:
            triangles, gone = add_places(vertices[:, :2], mesh, new, start)
        else:
            triangles, gone = triangulate_plan(vertices[:, :2]), np.ones(len(triangles), bool)
        # Edges on triangles that are still there lie on the ground as before.
        lying, on = np.concatenate([lying, missing[~hang]]), np.concatenate([on, found[~hang]])
        kept = ~gone[on].any(axis=1) & (on >= 0).all(axis=1)
        missing = find_missing(vertices, (mesh[0], triangles, gone), (edges, halved), lying)
        edges = halved
        missing = missing[~np.isin(pair_keys(missing), pair_keys(lying[kept]))]
        lying, on = lying[kept], (np.cumsum(~gone) - 1)[on[kept]]
        mesh = triangles, renew_neighbours(mesh[1], gone, triangles)
    return sort_places(vertices, triangles, first)


def find_missing(vertices, change, edges, missing):
    """Edges that are missing after a change and long enough to be halved: (k, 2), sorted.

    Parameters
    ----------
    vertices : array, (v, 3) float64 [m]
    change : tuple of (t, 3) int64, (s, 3) int64 and (t,) bool
        Triangles of before and after, and which of the former are gone.
    edges : tuple of (d, 2) int64 and (e, 2) int64
        Of before and after.
    missing : array, (m, 2) int64
        Those that were missing before and are still wanted.
    """
    before, after, gone = change
    known, edges = edges
    touched = np.zeros(len(vertices), bool)  # between other corners nothing has changed
    touched[after[len(before) - np.count_nonzero(gone) :]] = True
    touched[edges[~np.isin(pair_keys(edges), pair_keys(known))]] = True
    inside = touched[edges].all(axis=1)
    near = after[np.count_nonzero(touched[after], axis=1) > 1]
    lost = edges[inside][~has_edges(sort_sides(near), edges[inside])]
    still = missing[~touched[missing].all(axis=1)]
    return find_long(vertices, unique_pairs(np.concatenate([lost, still])))


def find_long(vertices, edges):
    """Edges that are long enough to be halved, (k, 2)."""
    along = vertices[edges[:, 1]] - vertices[edges[:, 0]]
    return edges[np.linalg.norm(along, axis=1) > SHORTEST_EDGE]


def find_hanging(vertices, mesh, edges):
    """Edges (k, 2) above the ground at any of their SHARES, (k,) bool, and the triangles there, (k, 3) int64."""
    triangles = mesh[0]
    start, end = (vertices[edges[:, k], None] for k in (0, 1))
    places = ((1 - SHARES[:, None]) * start + SHARES[:, None] * end).reshape(-1, 3)
    near = np.repeat(triangle_at(triangles, len(vertices))[edges[:, 0]], len(SHARES))
    found = walk(vertices[:, :2], mesh, places[:, :2], near)
    height = np.where(found >= 0, heights_on(vertices[triangles[found]], places), np.nan)
    steep = np.flatnonzero(np.isnan(height))  # on a triangle of no area
    if len(steep):
        height[steep] = drop_on_triangles(vertices[triangles], places[steep])
    hang = places[:, 2] - height > HANG
    return hang.reshape(-1, len(SHARES)).any(axis=1), found.reshape(-1, len(SHARES))


def halve(lines, vertices, first, edges, missing):
    """Vertices with the middles of some edges, where no other is; edges between them.

    Parameters
    ----------
    lines : FootLines
    vertices : array, (v, 3) float64 [m]
    first : int
        Where the points on feet begin among them.
    edges : array, (e, 2) int64
    missing : array, (k, 2) int64
        Those that are halved.

    Returns
    -------
    vertices : array, (w, 3) float64 [m]
        The given ones first.
    edges : array, (f, 2) int64
    source : array, (w - v,) int
        Of which edge each new one is the middle.
    in_place : bool
        Whether no earlier one has given way to a lower middle.
    """
    count, middles = len(vertices) - first, vertices[missing].mean(axis=1)
    points = np.concatenate([vertices[first:], middles])
    lowest, place = merge_places(points)
    own = np.full(len(lowest), -1)
    own[place[:count]] = np.arange(count)
    lower, new = np.flatnonzero((own >= 0) & (lowest != own)), np.flatnonzero(own < 0)
    own[new] = count + np.arange(len(new))
    feet = np.concatenate([points[:count], points[lowest[new]]])
    feet[own[lower]] = points[lowest[lower]]
    fresh = own[np.concatenate([new, lower])]
    feet[fresh, 2] = highest_foot(lines, feet[fresh])
    middle = first + own[place[count:]]
    halves = np.concatenate([np.column_stack([missing[:, 0], middle]), np.column_stack([middle, missing[:, 1]])])
    left = edges[~np.isin(pair_keys(edges), pair_keys(missing))]
    pairs = np.sort(np.concatenate([left, halves]), axis=1)
    pairs = unique_pairs(pairs[pairs[:, 0] != pairs[:, 1]])
    return np.concatenate([vertices[:first], feet]), pairs, lowest[new] - count, not len(lower)


def sort_places(vertices, triangles, first):
    """Vertices and triangles with the points on feet sorted by place, before the others."""
    order = np.append(first + np.argsort(place_keys(vertices[first:]), kind="stable"), np.arange(first))
    number = np.empty(len(order), np.int64)
    number[order] = np.arange(len(order))
    return vertices[order], number[triangles]
