"""Split large triangles, keeping the mesh conforming: no vertex on the edge of another triangle."""

import numpy as np

from ..city.check_geometry import check_patch_size
from ..settings.errors import InputError, check_array, check_triangles
from .flip_edges import find_inner_edges, flip_edges

MOST_PIECES = 50e6  # more would not fit into memory
AT_ONCE = 1 << 16  # triangles whose corners are taken together, so that they need little memory
SHORTEST = 1e-3  # [m] least patch size that can be given for a single triangle
ELONGATED = 4.0  # longest edge over height, from which a triangle is first cut crosswise
STRIP = 0.85  # of the patch size: strips narrower than this are cut so that the diagonals of their pieces fit as well
TIE = 1e-6  # relative; lengths closer than this count as equal, so that rounding does not choose between them


def refine_triangles(vertices, triangles, patch_size, surface=None):
    """Split every edge longer than patch_size until none is left.

    Neighbours that share an edge share its midpoint, so that no vertex lies on the edge of another triangle: a triangle
    with a larger patch size is split where its neighbour is.

            c              c              c
           / \\            /|\\            / \\
          /   \\          / | \\          q---p         one, two (here p, q) or three
         /     \\        /  |  \\        / \\  |\\        long edges: two, three or four
        a-------b      a---m---b      a---\\-b         triangles

    An edge is split at its midpoint, but along elongated triangles into as few equal parts as possible; their diagonals
    are not split before the outline is, and are then flipped (`flip_edges`): a wall of 1000 × 3 m becomes a row of
    near-squares cut in two, not slivers.

    Parameters
    ----------
    vertices : array, (v, 3) float64 [m]
    triangles : array, (t, 3) int
        Indices into vertices; identical points must have been merged.
    patch_size : float or array, (t,) float [m]
        Longest edge allowed, to one part in a million; one for all, or one for the pieces of each triangle.
    surface : array, (t,) int, optional
        Polygon of each triangle; diagonals within a polygon may be flipped. By default each triangle is its own.

    Returns
    -------
    vertices : array, (w, 3) float64 [m]
        The given ones first.
    triangles : array, (s, 3) int64
        Oriented like their parents.
    parent : array, (s,) int64
        Index of the given triangle that each one is a piece of, ascending; where diagonals were flipped, of a triangle
        of the same surface.

    Raises
    ------
    InputError
        Vertices, triangles or a length are invalid, or there would be too many pieces.
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
    surface = parent if surface is None else np.asarray(surface)
    thin = np.zeros(surface.max(initial=-1) + 1, bool)  # surfaces that had elongated triangles to split
    while True:
        measures = measure_triangles(vertices, triangles)
        long, elongated = find_long_edges(measures, patch_size[parent])
        new = np.unique(surface[parent[elongated]])
        if not thin[new].all():
            fresh = np.isin(np.arange(len(thin)), new) & ~thin
            thin |= fresh
            triangles = flip_thin(vertices, triangles, surface[parent], fresh)
            measures = measure_triangles(vertices, triangles)
            long, _ = find_long_edges(measures, patch_size[parent])
        if not long.any():
            break
        rows = thin[surface[parent]]
        long &= ~find_waiting(vertices, triangles, surface[parent], (long, rows), measures)
        some = long.any(axis=1)
        edges = ends_of_edges(triangles[some])[long[some]]
        halved, first, number = np.unique(key_of_edges(edges, vertices), return_index=True, return_inverse=True)
        parts = np.zeros(len(halved), np.int64)
        wanted = count_parts([measure[some] for measure in measures], patch_size[parent[some]])
        np.maximum.at(parts, number.reshape(-1), wanted[long[some]])
        middle = find_middles(vertices, triangles, halved)
        vertices = np.concatenate([vertices, cut_edges(vertices[edges[first]], parts)])
        cut = np.zeros(len(thin), bool)
        cut[surface[parent[(middle >= 0).any(axis=1)]]] = True
        triangles, parent = _split(vertices, triangles, parent, middle)
        triangles = flip_thin(vertices, triangles, surface[parent], thin & cut)
    order = np.argsort(parent, kind="stable")
    return vertices, triangles[order], parent[order]


def ends_of_edges(triangles):
    """Vertices at the ends of the edges ab, bc and ca, the smaller number first: (t, 3, 2) int64."""
    return np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)


def key_of_edges(edges, vertices):
    """One number for each edge (..., 2) between vertices: (...) int64."""
    return edges[..., 0] * np.int64(len(vertices)) + edges[..., 1]


def find_middles(vertices, triangles, halved):
    """The new vertex on each edge that is among those cut, keys in ascending order; else -1: (t, 3) int64."""
    middle = np.empty((len(triangles), 3), np.int64)
    for first in range(0, len(triangles), AT_ONCE):
        key = key_of_edges(ends_of_edges(triangles[first : first + AT_ONCE]), vertices)
        place = np.minimum(np.searchsorted(halved, key), len(halved) - 1)
        middle[first : first + AT_ONCE] = np.where(halved[place] == key, len(vertices) + place, -1)
    return middle


def cut_edges(ends, parts):
    """First cut of edges between ends (m, 2, 3) that are to be split into so many equal parts: (m, 3).

    For an odd number the smaller half lies at the same end of all parallel edges.
    """
    along = ends[:, 1] - ends[:, 0]
    rows = np.arange(len(along))
    forward = along[rows, np.abs(along).argmax(axis=1)] > 0
    share = np.where(forward, parts // 2, parts - parts // 2) / parts
    # For two halves this gives identical bits, whichever end comes first.
    return np.where((parts == 2)[:, None], 0.5 * (ends[:, 0] + ends[:, 1]), ends[:, 0] + share[:, None] * along)


def measure_triangles(vertices, triangles):
    """Edges ab, bc and ca (t, 3), and the height over the longest of them (t,), in metres."""
    length, height = np.empty((len(triangles), 3)), np.empty(len(triangles))
    for first in range(0, len(triangles), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        length[some], height[some] = measure_some(vertices, triangles[some])
    return length, height


def measure_some(vertices, triangles):
    """What `measure_triangles` returns, of a few of them."""
    a, b, c = (vertices[triangles[:, corner]].T for corner in range(3))  # (3, t) each
    length = np.column_stack([norm(b - a), norm(c - b), norm(a - c)])
    longest = np.maximum(np.maximum(length[:, 0], length[:, 1]), length[:, 2])
    (x, y, z), (u, v, w) = b - a, c - a
    doubled = norm((y * w - z * v, z * u - x * w, x * v - y * u))
    return length, np.divide(doubled, longest, out=np.zeros(len(longest)), where=longest > 0)


def norm(vectors):
    """Lengths of vectors (3, n) of which x, y and z are given: (n,)."""
    x, y, z = vectors
    return np.sqrt(x * x + y * y + z * z)


def find_long_edges(measures, patch_size):
    """Edges that are too long (t, 3), and elongated triangles that have one (t,), from their lengths and heights."""
    length, height = measures
    long = length > (1 + TIE) * patch_size[:, None]
    return long, long.any(axis=1) & (length.max(axis=1, initial=0) > ELONGATED * height)


def count_parts(measures, patch_size):
    """Number of equal parts into which to cut each edge, (t, 3): 2, but along elongated triangles as many as it takes
    to fit the patch size, and along narrow strips as many as it takes for the diagonals to fit it."""
    length, height = measures
    elongated = length.max(axis=1, initial=0) > ELONGATED * height
    piece = np.sqrt(patch_size**2 - np.where(height < STRIP * patch_size, height, 0) ** 2)
    parts = np.maximum(np.ceil(length / piece[:, None] - TIE), 2)
    return np.where(elongated[:, None], parts, 2).astype(np.int64)


def find_waiting(vertices, triangles, surface, wanted, measures):
    """Edges (t, 3) of some rows that are not split yet, since they may be flipped: between two elongated triangles that
    both have a long edge on the outline, which is split in any case."""
    (long, rows), (length, height) = wanted, measures
    rows = np.flatnonzero(rows & (long.sum(axis=1) > 1) & (length.max(axis=1, initial=0) > ELONGATED * height))
    waiting = np.zeros(long.shape, bool)
    pairs, corners = find_inner_edges(vertices, triangles[rows], surface[rows])
    inner = np.zeros((len(rows), 3), bool)
    sides = [side_of(triangles[rows][pairs[:, k]], corners[:, k]) for k in (0, 1)]
    for k in (0, 1):
        inner[pairs[:, k], sides[k]] = True
    wait = (long[rows] & ~inner).any(axis=1)[pairs].all(axis=1)
    for k in (0, 1):
        waiting[rows[pairs[wait, k]], sides[k][wait]] = True
    return waiting


def side_of(triangles, start):
    """Index of the edge of each triangle that starts at a vertex."""
    return np.argmax(triangles == start[:, None], axis=1)


def flip_thin(vertices, triangles, surface, thin):
    """Triangles with the diagonals of some surfaces flipped."""
    rows = np.flatnonzero(thin[surface])
    if len(rows):
        triangles = triangles.copy()
        triangles[rows] = flip_edges(vertices, triangles[rows], surface[rows])
    return triangles


def check_pieces(vertices, triangles, patch_size):
    """Refuse more pieces than fit into memory, for example because one vertex is far away by mistake."""
    length, height = measure_triangles(vertices, triangles)
    longest = length.max(axis=1, initial=0)
    pieces = (1 + longest / patch_size) * (1 + height / patch_size)
    if pieces.sum() > MOST_PIECES:
        problem = f"{patch_size.min():g} m gives about {pieces.sum():.0e} patches"
        cure = f"give a larger size, or check the coordinates: the longest edge has {longest.max():,.0f} m"
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
