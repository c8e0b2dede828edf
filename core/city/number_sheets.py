"""Parts of meshes that may be ground: faces that point up, with walls that rise from their rim but
hang from none.

A mesh may hold the ground and the houses on it, as objects that were joined do, with corners in
common or not.
"""

import numpy as np
from scipy.spatial import cKDTree

from .polygons import edges_of, normals_of, number_connected


def number_sheets(vertices, triangles, upward, mesh):
    """Number the sheets of meshes that may be ground.

    A mesh whose triangles all point up is one sheet. Of any other, each set of such triangles with
    common edges is one, unless other triangles of the mesh go down from a tenth of its rim or more.

    Parameters
    ----------
    vertices : (v, 3) float64 [m]
    triangles : (t, 3) int
    upward : (t,) bool
    mesh : (t,) int
        -1 for triangles that are no candidates.

    Returns
    -------
    sheet : (t,) int
        0 to n - 1, or -1.
    whole : (n,) bool
        The sheet is all of its mesh.
    """
    sheet = np.full(len(triangles), -1)
    mixed = np.zeros(mesh.max(initial=-1) + 2, bool)
    mixed[mesh[~upward]] = True
    mixed[-1] = False  # of those that are no candidates
    sheet[(mesh >= 0) & ~mixed[mesh]] = mesh[(mesh >= 0) & ~mixed[mesh]]
    rows = np.flatnonzero(mixed[mesh])
    sheet[rows] = _number_pieces(vertices, triangles[rows], upward[rows], mesh[rows])
    sheet[rows[sheet[rows] >= 0]] += len(mixed)
    chosen = sheet >= 0
    numbers, sheet[chosen] = np.unique(sheet[chosen], return_inverse=True)
    return sheet, numbers < len(mixed)


def _number_pieces(vertices, triangles, upward, mesh):
    """Pieces of meshes that also hold walls: upward triangles that hang together, as the number of
    the piece of each triangle, (t,) int. It is -1 for triangles that do not face up, and for pieces
    with walls that hang from a tenth of their rim or more, such as roofs.
    """
    count = len(triangles)
    if not count:
        return np.zeros(0, int)
    normal = normals_of(vertices, triangles)
    normal /= np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)[:, None]
    ends, owner = np.sort(edges_of(triangles), axis=1), np.tile(np.arange(count), 3)
    named = (mesh[owner].astype(np.int64) * len(vertices) + ends[:, 0]) * len(vertices) + ends[:, 1]
    edge = np.unique(named, return_inverse=True)[1].reshape(-1)
    # Upward triangles on both sides of an edge belong together, unless it is a sharp crease.
    order = np.flatnonzero(upward[owner])
    order = order[np.argsort(edge[order], kind="stable")]
    one, other = order[:-1], order[1:]
    bend = (normal[owner[one]] * normal[owner[other]]).sum(axis=1)
    # Ground hardly bends by more than 30°; roofs that reach down to it do.
    both = (edge[one] == edge[other]) & (bend > np.cos(np.radians(30.0)))
    piece = number_connected(owner[one[both]], owner[other[both]], count)
    # The rim: edges with one triangle of the piece. Other triangles with this edge rise from it or
    # go down; a wall hangs where all go down.
    inner = np.zeros(edge.max() + 1, bool)
    inner[edge[one[both]]] = True
    rise = vertices[triangles, 2].mean(axis=1)[owner] - vertices[ends, 2].mean(axis=1)
    length = np.linalg.norm(vertices[ends[:, 0]] - vertices[ends[:, 1]], axis=1)
    rim = np.flatnonzero(upward[owner] & ~inner[edge])
    lowest, highest = np.zeros((2, len(inner)))
    others = ~inner[edge] & ~upward[owner]
    np.minimum.at(lowest, edge[others], rise[others])
    np.maximum.at(highest, edge[others], rise[others])
    hangs = (lowest < 0) & (highest <= 0)
    around, hanging = (
        np.bincount(piece[owner[rim]], weight, count)
        for weight in (length[rim], (length * hangs[edge])[rim])
    )
    # Of a roof or a deck, walls hang from most of its rim; of the ground from less than a tenth.
    kept = upward & (hanging < 0.1 * np.maximum(around, np.finfo(float).tiny))[piece]
    return np.where(kept, piece, -1)


def find_yards(vertices, triangles, sheet, ground):
    """Sheets beside the ground and as high as it, such as yards that houses enclose.

    Parameters
    ----------
    vertices : (v, 3) float64 [m]
    triangles : (t, 3) int
    sheet : (t,) int
        Result of `number_sheets`.
    ground : (t,) bool
        At least one.

    Returns
    -------
    (t,) bool
    """
    rows = np.flatnonzero((sheet >= 0) & ~ground)
    if not len(rows):
        return ground
    corners = vertices[np.unique(triangles[ground])]
    middle = vertices[triangles[rows]].mean(axis=1)
    step = np.abs(middle[:, 2] - corners[cKDTree(corners[:, :2]).query(middle[:, :2])[1], 2])
    far = np.zeros(sheet.max() + 1, bool)
    # A yard lies within 1.5 m of the ground nearby; the flat roof of a house does not.
    far[sheet[rows[step > 1.5]]] = True
    yards = ground.copy()
    yards[rows] = ~far[sheet[rows]]
    return yards
