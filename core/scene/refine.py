"""Split large triangles so that neighbours still meet edge to edge."""

import numpy as np

from ..check_arrays import check_array, check_triangles
from ..city.check_geometry import check_patch_size
from ..errors import InputError

MOST_PIECES = 50e6  # more need more memory than there is
SHORTEST = 1e-3  # [m] that a patch of its own size may be asked to be
TIE = 1e-6  # lengths that differ by less than this share are equal: rounding must not choose between them


def refine_triangles(vertices, triangles, patch_size):
    """Split every edge longer than patch_size at its midpoint, again and again, until none is left.

    Neighbours that share an edge share its midpoint, so that no vertex lies on the edge of another triangle: one that
    may be larger is split where its neighbour is.

            c              c              c
           / \\            /|\\            / \\
          /   \\          / | \\          q---p         one, two (here p, q) or three
         /     \\        /  |  \\        / \\  |\\        long edges: two, three or four
        a-------b      a---m---b      a---\\-b         triangles

    Parameters
    ----------
    vertices : array, (v, 3) float64 [m]
    triangles : array, (t, 3) int
        Into vertices; identical points are merged beforehand.
    patch_size : float or array, (t,) float [m]
        Longest edge that stays, to one part in a million; one for all, or one for the pieces of each triangle.

    Returns
    -------
    vertices : array, (w, 3) float64 [m]
        The old ones first.
    triangles : array, (s, 3) int64
        Oriented as their parents.
    parent : array, (s,) int64
        Index of the given triangle that each one is a piece of, ascending.

    Raises
    ------
    InputError
        Vertices, triangles or a length cannot be used, or the pieces would be too many.
    """
    if not np.ndim(patch_size):
        check_patch_size(patch_size)
    vertices, triangles = check_triangles(vertices, triangles)
    vertices, triangles = np.asarray(vertices, float), np.asarray(triangles, np.int64)
    if np.ndim(patch_size):
        check_array("patch_size", patch_size, (len(triangles),), least=SHORTEST)
    patch_size = np.broadcast_to(np.asarray(patch_size, float), len(triangles))
    check_pieces(vertices, triangles, patch_size)
    parent = np.arange(len(triangles))
    while True:
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)  # (3 t, 2)
        length = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
        long = length > (1 + TIE) * np.repeat(patch_size[parent], 3)
        if not long.any():
            break
        key = edges[:, 0] * np.int64(len(vertices)) + edges[:, 1]
        halved, first = np.unique(key[long], return_index=True)
        place = np.minimum(np.searchsorted(halved, key), len(halved) - 1)
        middle = np.where(halved[place] == key, len(vertices) + place, -1)
        ends = edges[long][first]
        vertices = np.concatenate([vertices, 0.5 * (vertices[ends[:, 0]] + vertices[ends[:, 1]])])
        triangles, parent = _split(vertices, triangles, parent, middle.reshape(-1, 3))
    order = np.argsort(parent, kind="stable")
    return vertices, triangles[order], parent[order]


def check_pieces(vertices, triangles, patch_size):
    """Refuse more pieces than memory holds, as where one vertex stands far away by mistake."""
    corners = vertices[triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1, initial=0)
    doubled = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    height = np.divide(doubled, longest, out=np.zeros(len(longest)), where=longest > 0)
    pieces = (1 + longest / patch_size) * (1 + height / patch_size)
    if pieces.sum() > MOST_PIECES:
        problem = f"{patch_size.min():g} m would make about {pieces.sum():.0e} patches"
        cure = f"give a larger one; the longest edge has {longest.max():,.0f} m, look whether that is right"
        raise InputError("--patch-size", problem, cure)


def _split(vertices, triangles, parent, middle):
    """One round: middle (t, 3) is the new vertex on the edges ab, bc, ca, or -1."""
    count = (middle >= 0).sum(axis=1)
    pieces, parents = [triangles[count == 0]], [parent[count == 0]]
    for marked, template in ((1, _in_two), (2, _in_three), (3, _in_four)):
        chosen = count == marked
        new = template(vertices, triangles[chosen], middle[chosen])
        pieces += new
        parents += [parent[chosen]] * len(new)
    return np.concatenate(pieces), np.concatenate(parents)


def _turn(triangles, middle, start):
    """Cyclic shift so that corner and edge number start come first."""
    order = (start[:, None] + np.arange(3)) % 3
    return np.take_along_axis(triangles, order, axis=1).T, np.take_along_axis(middle, order, axis=1).T


def _in_two(_, triangles, middle):
    (a, b, c), (m, _, _) = _turn(triangles, middle, np.argmax(middle >= 0, axis=1))
    return [np.column_stack(corners) for corners in ((a, m, c), (m, b, c))]


def _in_three(vertices, triangles, middle):
    # Edges bc and ca are long, ab is not; the quadrilateral a b p q is cut along its shorter diagonal.
    (a, b, c), (_, p, q) = _turn(triangles, middle, np.argmin(middle >= 0, axis=1))
    first = np.linalg.norm(vertices[a] - vertices[p], axis=1)
    second = np.linalg.norm(vertices[b] - vertices[q], axis=1)
    along = (first <= (1 + TIE) * second)[:, None]
    left = np.where(along, np.column_stack([a, b, p]), np.column_stack([a, b, q]))
    right = np.where(along, np.column_stack([a, p, q]), np.column_stack([b, p, q]))
    return [left, right, np.column_stack([q, p, c])]


def _in_four(_, triangles, middle):
    (a, b, c), (m, p, q) = triangles.T, middle.T
    return [np.column_stack(corners) for corners in ((a, m, q), (m, b, p), (q, p, c), (m, p, q))]
