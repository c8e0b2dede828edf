"""Buildings of a mesh without names: its polygons that hang together, and what stands on them."""

import numpy as np
import shapely

from ..settings.tolerances import GEOMETRY
from .polygons import measure_rings, number_connected
from .tangled_rings import is_tangled


def number_pieces(faces, vertices):
    """Connected piece of each polygon, (f,): polygons that share vertices or lie above one
    another.
    """
    # Vertices closer than a thousandth of the file's unit are merged.
    _, place = np.unique(np.round(vertices / 1e-3).astype(np.int64), axis=0, return_inverse=True)
    count = np.array([len(face) for face in faces])
    owner = np.repeat(np.arange(len(faces)), count)
    corner = len(faces) + place.reshape(-1)[np.concatenate(faces).astype(np.int64)]
    piece = number_connected(owner, corner, len(faces) + len(vertices))[: len(faces)]
    full = count > 2
    if piece.max() == 0 or not full.any():
        return np.unique(piece, return_inverse=True)[1]
    drawn = [faces[k] for k in np.flatnonzero(full)]
    below, above = _stacked(drawn, vertices, piece[full])
    below, above = _without_ground((below, above), drawn, vertices, piece[full])
    joined = number_connected(below, above, piece.max() + 1)[piece]
    # Pieces are numbered in the order of the file.
    _, first, number = np.unique(joined, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[number.reshape(-1)]


def _stacked(faces, vertices, piece):
    """Pairs of pieces where one lies, in plan view, mostly on the other."""
    plans = [vertices[face, :2] for face in faces]
    # A face that crosses itself very often is left out later, and carries nothing.
    shapes = np.array(
        [shapely.Polygon(None if is_tangled(plan) else plan) for plan in plans], dtype=object
    )
    middles = shapely.points(np.array([plan.mean(axis=0) for plan in plans]))
    tree = shapely.STRtree(shapely.make_valid(shapes))
    face, on = tree.query(middles, "dwithin", distance=GEOMETRY.accuracy)
    other = piece[face] != piece[on]
    # each polygon counts once per other piece
    pairs = np.unique(np.column_stack([face, piece[on]])[other], axis=0)
    pairs, faces_on = np.unique(
        np.column_stack([piece[pairs[:, 0]], pairs[:, 1]]), axis=0, return_counts=True
    )
    # To join the building of another piece, half of a piece's polygons must lie above or below it.
    mostly = faces_on >= 0.5 * np.bincount(piece)[pairs[:, 0]]
    return pairs[mostly].T


def _without_ground(pairs, faces, vertices, piece):
    """Pairs of pieces, (2, k), without the ones where either is the ground of the other.

    A piece is ground for another if all of it faces up, nothing of the other lies below it, and it
    extends beyond.
    """
    points = np.concatenate(faces)
    start = np.cumsum([0, *map(len, faces)])
    normal = measure_rings(vertices[points], start)
    count = piece.max() + 1
    up = np.bincount(piece, normal[:, 2] <= 0, count) == 0
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    of_point = np.repeat(piece, np.diff(start))
    np.minimum.at(low, of_point, vertices[points])
    np.maximum.at(high, of_point, vertices[points])
    plan = (high - low)[:, :2].prod(axis=1)
    kept = np.ones(len(pairs[0]), bool)
    for ground, other in (pairs, pairs[::-1]):
        kept &= ~(
            up[ground]
            & ~up[other]
            & (low[other, 2] >= low[ground, 2] - GEOMETRY.accuracy)
            & (plan[ground] > 2 * plan[other])
        )
    return pairs[0][kept], pairs[1][kept]
