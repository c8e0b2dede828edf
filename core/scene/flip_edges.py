"""Flip the diagonals of flat surfaces so that their triangles are as close to halves of squares as possible.

            c                 c
           /|\\              / \\
          / | \\            /   \\        The edge ab, between two angles that make more than 180° together,
         a--|         a--|--b   from    a-----b       becomes pq (Lawson 1977, doi:10.1016/B978-0-12-587260-7.50011-X).
"""

import numpy as np

FLAT = 1e-4  # [m] distance from a triangle's plane beyond which its neighbour does not lie in it
TIE = 1e-6  # of the sum of two cotangents, so that rounding does not choose between diagonals
MOST_ROUNDS = 200


def flip_edges(vertices, triangles, surface):
    """Delaunay triangulation within each flat surface; outlines, bends and curved surfaces stay unchanged.

    Parameters
    ----------
    vertices : array, (v, 3) float64 [m]
    triangles : array, (t, 3) int64
    surface : array, (t,) int
        Only edges between triangles of one surface are flipped.

    Returns
    -------
    array, (t, 3) int64
        The same number for each surface, in the same rows, oriented as before.
    """
    triangles, active = triangles.copy(), np.arange(len(triangles))
    for _ in range(MOST_ROUNDS):
        rows, corners = find_inner_edges(vertices, triangles[active], surface[active])
        worth = measure_edges(vertices, corners)
        bad = worth < -TIE
        if not bad.any():
            break
        rows, corners, worth = active[rows[bad]], corners[bad], worth[bad]
        active = active[np.isin(surface[active], surface[rows[:, 0]])]  # surfaces without a flip stay unchanged
        # Each triangle takes part in one flip of a round, its worst edge first.
        rank = np.empty(len(worth), np.int64)
        rank[np.lexsort((rows[:, 0], worth))] = np.arange(len(worth))
        best = np.full(len(triangles), len(worth))
        np.minimum.at(best, rows.reshape(-1), np.repeat(rank, 2))
        chosen = (best[rows] == rank[:, None]).all(axis=1)
        a, b, p, q = corners[chosen].T
        triangles[rows[chosen, 0]], triangles[rows[chosen, 1]] = np.column_stack([p, a, q]), np.column_stack([q, b, p])
    return triangles


def find_inner_edges(vertices, triangles, surface):
    """Edges between two coplanar triangles of one surface: rows (e, 2) of the triangles, and corners (e, 4).

    The first triangle runs a, b, p and the second b, a, q.
    """
    start, end, apex = (np.roll(triangles, -k, axis=1).reshape(-1) for k in range(3))
    owner = np.repeat(np.arange(len(triangles)), 3)
    key = (np.minimum(start, end).astype(np.int64) << 32) + 2 * np.maximum(start, end) + (start > end)
    order = np.argsort(key)  # of the two at an edge, the one that starts at its smaller end comes first
    edge = key[order] >> 1
    same = edge[1:] == edge[:-1]
    used_more = np.concatenate([[False], same[:-1] & same[1:]]) | np.concatenate([same[:-1] & same[1:], [False]])
    first = np.flatnonzero(same & ~used_more[: len(same)]) if len(same) else np.zeros(0, np.int64)
    one, other = order[first], order[first + 1]
    kept = (surface[owner[one]] == surface[owner[other]]) & (start[one] == end[other])
    one, other = one[kept], other[kept]
    corners = np.column_stack([start[one], end[one], apex[one], apex[other]])
    a, b, p, q = (vertices[index] for index in corners.T)
    normal, back = np.cross(b - a, p - a), np.cross(a - b, q - b)
    size = np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)
    bend = np.abs(np.einsum("ij,ij->i", q - a, normal)) / size
    flat = (bend <= FLAT) & (np.einsum("ij,ij->i", normal, back) > 0)
    return np.column_stack([owner[one], owner[other]])[flat], corners[flat]


def measure_edges(vertices, corners):
    """Sum of the cotangents of the two angles opposite to each edge, (e,): negative if they sum to more than 180°."""
    a, b, p, q = (vertices[index] for index in corners.T)
    return cotangent(a - p, b - p) + cotangent(a - q, b - q)


def cotangent(one, other):
    """Cotangent of the angle between two vectors, (e,)."""
    sine = np.linalg.norm(np.cross(one, other), axis=1)
    return np.einsum("ij,ij->i", one, other) / np.maximum(sine, np.finfo(float).tiny)
