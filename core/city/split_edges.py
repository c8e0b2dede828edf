"""Split large triangles, keeping the mesh conforming: no vertex on the edge of another triangle.

Diagonals of flat surfaces are flipped, so that triangles are as close to halves of squares as
possible.

References
----------
C. L. Lawson (1977), Software for C1 surface interpolation, doi:10.1016/B978-0-12-587260-7.50011-X.
"""

import numpy as np

from ..settings.errors import InputError, check_array, check_triangles
from ..settings.tolerances import GEOMETRY
from .check_geometry import check_patch_size
from .plan_geometry import pair_keys

ELONGATED = 4.0  # longest edge over height, from which a triangle is first cut crosswise


def refine_triangles(vertices, triangles, patch_size, surface=None):
    """Split every edge longer than patch_size until none is left.

    Neighbours that share an edge share its midpoint, so that no vertex lies on the edge of another
    triangle: a triangle with a larger patch size is split where its neighbour is.

            c              c              c
           / \\            /|\\            / \\
          /   \\          / | \\          q---p         one, two (here p, q) or three
         /     \\        /  |  \\        / \\  |\\        long edges: two, three or four
        a-------b      a---m---b      a---\\-b         triangles

    An edge is split at its midpoint, but along elongated triangles into as few equal parts as
    possible; their diagonals are not split before the outline is, and are then flipped
    (`_flip_edges`): a wall of 1000 × 3 m becomes a row of near-squares cut in two, not slivers.

    Parameters
    ----------
    vertices : array, (v, 3) float64 [m]
    triangles : array, (t, 3) int
        Indices into vertices; identical points must have been merged.
    patch_size : float or array, (t,) float [m]
        Longest edge allowed, to one part in a million; one for all, or one for the pieces of each
        triangle.
    surface : array, (t,) int, optional
        Polygon of each triangle; diagonals within a polygon may be flipped. By default each
        triangle is its own.

    Returns
    -------
    vertices : array, (w, 3) float64 [m]
        The given ones first.
    triangles : array, (s, 3) int64
        Oriented like their parents.
    parent : array, (s,) int64
        Index of the given triangle that each one is a piece of, ascending; where diagonals were
        flipped, of a triangle of the same surface.

    Raises
    ------
    InputError
        Vertices, triangles or a length are invalid, or there would be too many pieces.
    """
    # Lengths by triangle, and a guess of the number of pieces, so that a slip of the coordinates is
    # told before memory ends.
    if not np.ndim(patch_size):
        check_patch_size(patch_size)
    vertices, triangles = check_triangles(vertices, triangles)
    vertices, triangles = np.asarray(vertices, float), np.asarray(triangles, np.int64)
    if np.ndim(patch_size):
        check_array("patch_size", patch_size, (len(triangles),), least=1e-3)
    patch_size = np.broadcast_to(np.asarray(patch_size, float), len(triangles))
    length, height = _measure_triangles(vertices, triangles)
    longest = length.max(axis=1, initial=0)
    pieces = ((1 + longest / patch_size) * (1 + height / patch_size)).sum()
    # More than 50 million pieces would not fit into memory.
    if pieces > 50e6:  # for example because one vertex is far away by mistake
        raise InputError(
            "--patch-size",
            f"{patch_size.min():g} m gives about {pieces:.0e} patches",
            "give a larger size, or check the coordinates: the longest edge has "
            f"{longest.max():,.0f} m",
        )
    parent = np.arange(len(triangles))
    surface = parent if surface is None else np.asarray(surface)
    # surfaces that had elongated triangles to split
    thin = np.zeros(surface.max(initial=-1) + 1, bool)
    # Each pass cuts every edge that is too long, until none is.
    while True:
        length, height = measures = _measure_triangles(vertices, triangles)
        long = length > (1 + GEOMETRY.tie) * patch_size[parent, None]
        # Surfaces with slivers get their diagonals flipped first, once; the pass begins anew.
        elongated = long.any(axis=1) & (length.max(axis=1, initial=0) > ELONGATED * height)
        new = np.unique(surface[parent[elongated]])
        if not thin[new].all():
            fresh = np.isin(np.arange(len(thin)), new) & ~thin
            thin |= fresh
            triangles = _flip_edges(vertices, triangles, surface[parent], fresh[surface[parent]])
            continue
        if not long.any():
            break
        # Diagonals of these wait until the outline is cut.
        rows = thin[surface[parent]]
        long &= ~_find_waiting(vertices, triangles, surface[parent], (long, rows), measures)
        # Ends of the edges ab, bc and ca, triangle by triangle, the smaller number first.
        ends, chosen = (
            np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2),
            np.flatnonzero(long),
        )
        # Each edge once, though two triangles share it, and into as many parts as either asks for;
        # its new vertices get numbers behind the others.
        key = pair_keys(ends)
        halved, first, number = np.unique(key[chosen], return_index=True, return_inverse=True)
        parts = np.zeros(len(halved), np.int64)
        np.maximum.at(parts, number, _count_parts(measures, patch_size[parent])[long])
        place = np.minimum(np.searchsorted(halved, key), len(halved) - 1)
        middle = np.where(halved[place] == key, len(vertices) + place, -1).reshape(-1, 3)
        vertices = np.concatenate([vertices, _cut_edges(vertices[ends[chosen[first]]], parts)])
        # Triangles are cut along these vertices, and the surfaces of slivers flipped again.
        cut = np.zeros(len(thin), bool)
        cut[surface[parent[(middle >= 0).any(axis=1)]]] = True
        triangles, parent = _split(vertices, triangles, parent, middle)
        triangles = _flip_edges(vertices, triangles, surface[parent], (thin & cut)[surface[parent]])
    # Pieces in the order of the triangles that they come from.
    order = np.argsort(parent, kind="stable")
    return vertices, triangles[order], parent[order]


def _cut_edges(ends, parts):
    """First cut of edges between ends (m, 2, 3) that are to be split into so many equal parts: (m,
    3).

    For an odd number the smaller half lies at the same end of all parallel edges.
    """
    along = ends[:, 1] - ends[:, 0]
    rows = np.arange(len(along))
    forward = along[rows, np.abs(along).argmax(axis=1)] > 0
    share = np.where(forward, parts // 2, parts - parts // 2) / parts
    # For two halves this gives identical bits, whichever end comes first.
    return np.where(
        (parts == 2)[:, None], 0.5 * (ends[:, 0] + ends[:, 1]), ends[:, 0] + share[:, None] * along
    )


def _measure_triangles(vertices, triangles):
    """Edges ab, bc and ca (t, 3), and the height over the longest of them (t,), in metres."""
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    length = np.column_stack([np.linalg.norm(along, axis=1) for along in (b - a, c - b, a - c)])
    longest, doubled = length.max(axis=1, initial=0), np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return length, np.divide(doubled, longest, out=np.zeros(len(longest)), where=longest > 0)


def _count_parts(measures, patch_size):
    """Number of equal parts into which to cut each edge, (t, 3): 2, but along elongated triangles
    as many as it takes to fit the patch size, and along narrow strips as many as it takes for the
    diagonals to fit it."""
    length, height = measures
    elongated = length.max(axis=1, initial=0) > ELONGATED * height
    # Strips narrower than 0.85 patch sizes are cut so that the diagonals of their pieces fit as
    # well.
    piece = np.sqrt(patch_size**2 - np.where(height < 0.85 * patch_size, height, 0) ** 2)
    parts = np.maximum(np.ceil(length / piece[:, None] - GEOMETRY.tie), 2)
    return np.where(elongated[:, None], parts, 2).astype(np.int64)


def _find_waiting(vertices, triangles, surface, wanted, measures):
    """Edges (t, 3) of some rows that are not split yet, since they may be flipped: between two
    elongated triangles that both have a long edge on the outline, which is split in any case."""
    (long, rows), (length, height) = wanted, measures
    rows = np.flatnonzero(
        rows & (long.sum(axis=1) > 1) & (length.max(axis=1, initial=0) > ELONGATED * height)
    )
    waiting = np.zeros(long.shape, bool)
    pairs, corners = _find_inner_edges(vertices, triangles[rows], surface[rows])
    inner = np.zeros((len(rows), 3), bool)
    # Of each of the two, the edge that starts where the common one does.
    sides = [np.argmax(triangles[rows][pairs[:, k]] == corners[:, k, None], axis=1) for k in (0, 1)]
    for k in (0, 1):
        inner[pairs[:, k], sides[k]] = True
    wait = (long[rows] & ~inner).any(axis=1)[pairs].all(axis=1)
    for k in (0, 1):
        waiting[rows[pairs[wait, k]], sides[k][wait]] = True
    return waiting


def _split(vertices, triangles, parent, middle):
    """One round: middle (t, 3) is the new vertex on the edges ab, bc, ca, or -1."""
    count = (middle >= 0).sum(axis=1)
    # Of one long edge it comes first, of two the short one does, so that all of a kind are cut
    # alike.
    start = np.where(count == 1, np.argmax(middle >= 0, axis=1), np.argmin(middle >= 0, axis=1))
    order = (np.where(count % 3, start, 0)[:, None] + np.arange(3)) % 3
    corners, middles = (np.take_along_axis(part, order, axis=1) for part in (triangles, middle))
    a, b, c, m, p, q = np.column_stack([corners, middles]).T
    # Where two are long, the quadrilateral a b p q is cut along its shorter diagonal.
    first, second = (
        np.linalg.norm(vertices[one] - vertices[other], axis=1) for one, other in ((a, p), (b, q))
    )
    along = first <= (1 + GEOMETRY.tie) * second
    templates = {
        0: [(a, b, c)],
        1: [(a, m, c), (m, b, c)],
        2: [(a, b, np.where(along, p, q)), (np.where(along, a, b), p, q), (q, p, c)],
        3: [(a, m, q), (m, b, p), (q, p, c), (m, p, q)],
    }
    pieces, parents = [], []
    for marked, template in templates.items():
        chosen = count == marked
        pieces += [np.column_stack(piece)[chosen] for piece in template]
        parents += [parent[chosen]] * len(template)
    return np.concatenate(pieces), np.concatenate(parents)


def _flip_edges(vertices, triangles, surface, wanted=True):
    """Delaunay triangulation within each flat surface; outlines, bends and curved surfaces stay
    unchanged.

    Parameters
    ----------
    vertices : array, (v, 3) float64 [m]
    triangles : array, (t, 3) int64
    surface : array, (t,) int
        Only edges between triangles of one surface are flipped.
    wanted : array, (t,) bool, optional
        Triangles of surfaces in question.

    Returns
    -------
    array, (t, 3) int64
        As many triangles of each surface, in the same rows, oriented as before.
    """
    triangles, active = triangles.copy(), np.flatnonzero(np.broadcast_to(wanted, len(triangles)))
    near = active
    moved = np.ones(len(vertices), bool)
    # Flips go in rounds, 200 at most, until no edge is left that is better flipped; after the
    # first, only edges between corners of edges that were such in the last one are asked.
    for _ in range(200):
        rows, corners = _find_inner_edges(vertices, triangles[near], surface[near])
        asked = moved[corners[:, 0]] & moved[corners[:, 1]]
        rows, corners = near[rows[asked]], corners[asked]
        # Sum of the cotangents of the two angles opposite to each edge: negative if they sum to
        # more than 180°.
        (a, b, *apexes), worth = (vertices[index] for index in corners.T), np.zeros(len(corners))
        for apex in apexes:
            sine = np.linalg.norm(np.cross(a - apex, b - apex), axis=1)
            worth += ((a - apex) * (b - apex)).sum(axis=1) / np.maximum(sine, np.finfo(float).tiny)
        bad = worth < -GEOMETRY.tie
        if not bad.any():
            break
        rows, corners, worth = rows[bad], corners[bad], worth[bad]
        # Surfaces without a flip stay unchanged; in others, edges can change only between corners
        # of those that flip.
        flipping = np.zeros(surface.max() + 1, bool)
        flipping[surface[rows[:, 0]]] = True
        active = active[flipping[surface[active]]]
        moved[:] = False
        moved[corners] = True
        near = active[moved[triangles[active]].sum(axis=1) > 1]
        # Each triangle takes part in one flip of a round, its worst edge first.
        rank = np.empty(len(worth), np.int64)
        rank[np.lexsort((rows[:, 0], worth))] = np.arange(len(worth))
        best = np.full(len(triangles), len(worth))
        np.minimum.at(best, rows.reshape(-1), np.repeat(rank, 2))
        chosen = (best[rows] == rank[:, None]).all(axis=1)
        a, b, p, q = corners[chosen].T
        triangles[rows[chosen, 0]], triangles[rows[chosen, 1]] = (
            np.column_stack([p, a, q]),
            np.column_stack([q, b, p]),
        )
    return triangles


def _find_inner_edges(vertices, triangles, surface):
    """Edges between two coplanar triangles of one surface: rows (e, 2) of the triangles, and
    corners (e, 4).

    The first triangle runs a, b, p and the second b, a, q.
    """
    start, end, apex = (np.roll(triangles, -k, axis=1).reshape(-1) for k in range(3))
    owner = np.repeat(np.arange(len(triangles)), 3)
    key = (
        (np.minimum(start, end).astype(np.int64) << 32) + 2 * np.maximum(start, end) + (start > end)
    )
    # of the two at an edge, the one that starts at its smaller end comes first
    order = np.argsort(key)
    edge = key[order] >> 1
    same = edge[1:] == edge[:-1]
    used_more = np.concatenate([[False], same[:-1] & same[1:]]) | np.concatenate(
        [same[:-1] & same[1:], [False]]
    )
    first = np.flatnonzero(same & ~used_more[: len(same)]) if len(same) else np.zeros(0, np.int64)
    one, other = order[first], order[first + 1]
    kept = (surface[owner[one]] == surface[owner[other]]) & (start[one] == end[other])
    one, other = one[kept], other[kept]
    corners = np.column_stack([start[one], end[one], apex[one], apex[other]])
    a, b, p, q = (vertices[index] for index in corners.T)
    normal, back = np.cross(b - a, p - a), np.cross(a - b, q - b)
    size = np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)
    bend = np.abs(np.einsum("ij,ij->i", q - a, normal)) / size
    # A neighbour whose corner lies off a triangle's plane by computing alone lies in it.
    flat = (bend <= GEOMETRY.computed) & (np.einsum("ij,ij->i", normal, back) > 0)
    return np.column_stack([owner[one], owner[other]])[flat], corners[flat]
