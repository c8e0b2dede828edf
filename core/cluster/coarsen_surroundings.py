"""Fewer triangles for the surroundings of a tile: the further away, the coarser, by no more than the sun's disc.

    tile         ▕▔▏▁▔▏        ┌─┬─┬─┐            ┌─────┐      Corners that share a cell become one; triangles of
    ▁▁▁▁▁▁▁▁▁▁▁▁▁▕▁▏▁▁▏▁▁▁▁▁▁▁▁├─┼─┼─┤▁▁▁▁▁▁▁▁▁▁▁▁│     │▁     which two corners do are gone. Cells are as wide as
    own: exact    near: exact  └─┴─┴─┘ 100 m on   └─────┘      the sun looks from the tile.

The sun is 0.53° wide, 0.0093 of the distance. What is smaller than that casts no shadow of its own, only a penumbra.

Source: clustering of vertices with quadrics, which keep edges and corners of buildings where they are: P. Lindstrom,
Out-of-core simplification of large polygonal models, SIGGRAPH 2000, doi:10.1145/344779.344912.
"""

import numpy as np

from .tiles import gap

WIDTH = 0.0093  # of a cell, as a share of its distance from the tile: the sun's disc
SMALLEST = 1.0  # [m] cells: what is closer than this over WIDTH stays as it is
STIFFNESS = 1e-3  # by which a corner is held to the mean of its cell, as a share of how planes hold it
SLIVER = 1e-3  # [m]: what is thinner after its corners were moved is gone


def coarsen(vertices, triangles, own, exact):
    """Move corners of distant triangles together.

    Corners of one cell become one: where the planes of their triangles meet, else at their mean; one alone stays in its
    place. Cells are cubes, aligned with the axes, of a power of two of a metre: WIDTH of their distance in plan from
    the tile's own triangles or less.

    Parameters
    ----------
    vertices : (v, 3) float64 [m]
    triangles : (t, 3) int
    own : (t,) bool
        The tile's triangles.
    exact : (t,) bool
        Those that keep their corners, among them all of `own`.

    Returns
    -------
    vertices : (w, 3) float64 [m]
    triangles : (k, 3) int32
        Into these, without those that have become lines or points, or the same as one before them.
    kept : (k,) int
        Their rows.
    moved : (k,) bool
        Whether any of their corners has moved.
    """
    kept = np.arange(len(triangles))
    if not own.any():
        return vertices, triangles, kept, np.zeros(len(triangles), bool)
    free = np.ones(len(vertices), bool)
    free[triangles[exact]] = False
    group = group_corners(vertices, free, vertices[triangles[own]].reshape(-1, 3))
    places = move_together(vertices, triangles, group)
    moved = (places[group] != vertices).any(axis=1)[triangles].any(axis=1)
    triangles = group[triangles].astype(np.int32)
    for drop in (are_lines, repeat_another, lambda corners: heights(places[corners]) <= SLIVER):
        among = np.flatnonzero(moved)
        stay = np.ones(len(triangles), bool)
        stay[among] = ~drop(triangles[among])
        triangles, kept, moved = triangles[stay], kept[stay], moved[stay]
    return places, triangles, kept, moved


def move_together(vertices, triangles, group):
    """Where each group of corners goes, within their bounds: (w, 3) float64 [m]."""
    order = np.argsort(group, kind="stable")
    count = np.bincount(group)
    start = np.concatenate([[0], np.cumsum(count)[:-1]])
    first = vertices[order[start]]
    offset = vertices - first[group]
    mean = np.stack([np.bincount(group, offset[:, axis]) for axis in range(3)], axis=1) / count[:, None]
    low, high = (bounds.reduceat(offset[order], start) for bounds in (np.minimum, np.maximum))
    shared = (low != high).any(axis=1)
    place = np.cumsum(shared) - 1
    matrix, vector = add_planes((vertices, offset), triangles, np.where(shared, place, -1)[group], int(shared.sum()))
    held = np.maximum(STIFFNESS * np.trace(matrix, axis1=1, axis2=2), 1e-12)
    pull = vector - np.einsum("gij,gj->gi", matrix, mean[shared])
    mean[shared] += np.linalg.solve(matrix + held[:, None, None] * np.eye(3), pull[:, :, None])[:, :, 0]
    return first + np.clip(mean, low, high)


def add_planes(corners, triangles, group, count):
    """Quadrics of groups of corners: the squares of distances from the planes of their triangles, by area.

    Parameters
    ----------
    corners : tuple of two (v, 3) float64 [m]
        Where they lie, and where as seen from the origin of their group.
    triangles : (t, 3) int
    group : (v,) int
        -1 for those of no group.
    count : int
        Of groups.

    Returns
    -------
    matrix : (count, 3, 3) float64 [m²]
    vector : (count, 3) float64 [m³]
        The least squares are where `matrix` times the place is `vector`.
    """
    vertices, offset = corners
    triangles = triangles[(group[triangles] >= 0).any(axis=1)]
    a, b, c = (vertices[corner] for corner in triangles.T)
    normal = np.cross(b - a, c - a)
    normal /= np.sqrt(np.maximum(np.linalg.norm(normal, axis=1), 1e-12))[:, None]  # whose square is twice the area
    matrix, vector = np.zeros((count, 3, 3)), np.zeros((count, 3))
    for corner in triangles.T:
        held = np.flatnonzero(group[corner] >= 0)
        owner, along = group[corner[held]], normal[held]
        away = np.einsum("ij,ij->i", along, offset[corner[held]])
        for row in range(3):
            vector[:, row] += np.bincount(owner, along[:, row] * away, count)
            for column in range(row + 1):
                matrix[:, row, column] += np.bincount(owner, along[:, row] * along[:, column], count)
    return matrix + np.tril(matrix, -1).transpose(0, 2, 1), vector


def group_corners(vertices, free, own):
    """Number of the cell of each corner that is free to move, and of each of the others: (v,) int, without gaps."""
    low, high = own.min(axis=0), own.max(axis=0)
    wide = WIDTH * gap(vertices, vertices, low, high)
    chosen = np.flatnonzero(free & (wide >= SMALLEST))
    level = np.floor(np.log2(wide[chosen])).astype(np.int64)
    cell = np.floor(vertices[chosen] / np.exp2(level)[:, None]).astype(np.int64)
    group = np.full(len(vertices), -1)
    group[chosen] = np.unique(pack(np.column_stack([level, cell])), return_inverse=True)[1].ravel()
    fixed = group < 0
    group[fixed] = group.max(initial=-1) + 1 + np.arange(fixed.sum())
    return group


def pack(columns):
    """One whole number for each row of some columns of whole numbers: (k,) int64."""
    found = np.zeros(len(columns), np.int64)
    for column in columns.T:
        low = column.min(initial=0)
        found = found * (column.max(initial=0) - low + 1) + column - low
    return found


def are_lines(triangles):
    """Whether two of their corners are the same: (t,) bool."""
    a, b, c = triangles.T
    return (a == b) | (b == c) | (c == a)


def repeat_another(triangles):
    """Whether one before has the same corners in the same sense: (t,) bool."""
    start = triangles.argmin(axis=1)
    a, b, c = (triangles[np.arange(len(triangles)), (start + step) % 3] for step in range(3))
    order = np.lexsort((c, b, a))  # stable
    same = np.zeros(len(order), bool)
    same[1:] = True
    for corner in (a, b, c):
        same[1:] &= corner[order[1:]] == corner[order[:-1]]
    found = np.empty(len(order), bool)
    found[order] = same
    return found


def heights(corners):
    """Of triangles, above their longest sides: (t,) float64 [m]."""
    edges = corners[:, 1:] - corners[:, :1]
    twice = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    longest = np.maximum(np.linalg.norm(edges, axis=2).max(axis=1), np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1))
    return twice / longest
