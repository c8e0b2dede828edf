"""Surfaces drawn twice: they lie, within the accuracy of the data, on another surface that faces
the same way.

Party walls, which face opposite ways, are not among them. Of two in the same place the larger
counts, else the one in front.
"""

import numpy as np

from ..rays.find_coincident import find_coincident
from ..settings.tolerances import GEOMETRY
from .polygons import triangulate


def find_twins(shape, area, normal, wanted, *, twin_share=0.5):
    """Surfaces that lie by more than half on others that face the same way.

    Parameters
    ----------
    shape : tuple
        points (m, 3) float64 [m] with a local origin, ring_start (r + 1,), polygon_start (n + 1,).
    area : array, (n,) float [m²]
    normal : array, (n, 3) float
    wanted : array, (n,) bool
        Surfaces that may be twins; they may lie on any other.

    Returns
    -------
    array, (n,) bool
    """
    order = np.lexsort((np.arange(len(area)), -area))
    rank = np.empty(len(area), np.int64)
    rank[order] = np.arange(len(area))
    pairs, common, ahead = _measure_pairs(shape, normal, rank, wanted)
    # [m²] of each behind others, and in the same place as larger ones
    hidden = np.zeros((2, len(area)))
    # The largest first, so that a surface on a twin does not become a twin for that reason alone.
    for pair in np.lexsort((rank[pairs[:, 1]], rank[pairs[:, 0]])):
        large, small = pairs[pair]
        # Closer than by computing alone, neither of two surfaces is in front of the other.
        if ahead[pair] < -GEOMETRY.computed:
            hidden[0, large] += common[pair]
        elif ahead[pair] > GEOMETRY.computed:
            hidden[0, small] += common[pair]
        # `twin_share`: of its area that lies on others, the same share as for covered surfaces.
        elif hidden[:, large].sum() <= twin_share * area[large]:
            hidden[1, small] += common[pair]
    return wanted & (hidden.sum(axis=0) > twin_share * area)


def _measure_pairs(shape, normal, rank, wanted):
    """Pairs of surfaces that face the same way and coincide, (k, 2) int64, the one with the lower
    rank first; how much of them does, (k,) [m²], and how far the first is in front of the second
    there, (k,) [m].
    """
    # Triangles of the surfaces that lie in one place.
    triangles, owner = triangulate(*shape)
    corners = shape[0][triangles]
    found = find_coincident(corners, np.full(len(corners), GEOMETRY.accuracy))
    one = np.repeat(np.arange(len(corners)), np.diff(found.start))
    large, small = owner[one], owner[found.other]
    kept = (rank[large] < rank[small]) & (wanted[large] | wanted[small])
    kept &= (normal[large] * normal[small]).sum(axis=1) > GEOMETRY.facing
    one, other, large, small = one[kept], found.other[kept], large[kept], small[kept]
    # What each two have in common, and the height of its middle on the one over the other.
    middle, share = found.measure_overlaps(kept)
    edges = corners[other, 1:] - corners[other, :1]
    size = share * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
    place = corners[other, 0] + np.einsum("ei,eix->ex", middle, edges)
    height = np.einsum("ex,ex->e", corners[one, 0] - place, normal[large])
    # All triangles of two surfaces together.
    pairs, number = np.unique(np.column_stack([large, small]), axis=0, return_inverse=True)
    common = np.bincount(number.reshape(-1), size, len(pairs))
    ahead = np.bincount(number.reshape(-1), size * height, len(pairs))
    return pairs, common, ahead / np.maximum(common, np.finfo(float).tiny)
