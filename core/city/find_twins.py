"""Surfaces drawn twice: they lie, within the accuracy of the data, on another surface that faces
the same way.

Party walls, which face opposite ways, are not among them. Of two in the same place the larger
counts, else the one in front.
"""

import numpy as np
import shapely

from ..settings.tolerances import GEOMETRY
from .plan_geometry import list_runs
from .polygons import plane_axes, polygon_bounds

# surfaces whose neighbours are looked at together, so that they need little memory
AT_ONCE = 1 << 14


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
    pairs = _find_parallel_pairs(shape, normal, wanted)
    # the larger one first
    pairs = np.where((rank[pairs[:, 0]] < rank[pairs[:, 1]])[:, None], pairs, pairs[:, ::-1])
    slices = [pairs[first : first + AT_ONCE] for first in range(0, max(len(pairs), 1), AT_ONCE)]
    common, ahead = np.concatenate(
        [_measure_overlaps(shape, normal, some) for some in slices], axis=1
    )
    # [m²] of each behind others, and in the same place as larger ones
    hidden = np.zeros((2, len(area)))
    pairs_in_common = np.flatnonzero(common)
    # The largest first, so that a surface on a twin does not become a twin for that reason alone.
    for pair in pairs_in_common[
        np.lexsort((rank[pairs[pairs_in_common, 1]], rank[pairs[pairs_in_common, 0]]))
    ]:
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


def _find_parallel_pairs(shape, normal, wanted):
    """Pairs of surfaces that face the same way, overlap by more than an edge, and lie near one
    plane: (k, 2) int64.
    """
    points, ring_start, polygon_start = shape
    low, high = polygon_bounds(points, ring_start, polygon_start)
    low, high = low - GEOMETRY.accuracy, high + GEOMETRY.accuracy
    boxes = shapely.box(*low[:, :2].T, *high[:, :2].T)
    tree, corner, found = (
        shapely.STRtree(boxes),
        points[ring_start[polygon_start[:-1]]],
        [np.zeros((0, 2), np.int64)],
    )
    for first in range(0, len(boxes), AT_ONCE):
        one, other = tree.query(boxes[first : first + AT_ONCE])
        one = one + first
        kept = (one < other) & (wanted[one] | wanted[other])
        one, other = one[kept], other[kept]
        kept = (normal[one] * normal[other]).sum(axis=1) > GEOMETRY.facing
        one, other = one[kept], other[kept]
        common = np.sort(
            np.minimum(high[one], high[other]) - np.maximum(low[one], low[other]), axis=1
        )
        # Two flat surfaces that coincide somewhere are within the accuracy of each other's planes
        # there.
        reach = sum(np.linalg.norm(high[rows] - low[rows], axis=1) for rows in (one, other))
        turn = np.linalg.norm(np.cross(normal[one], normal[other]), axis=1)
        apart = np.abs(np.einsum("ij,ij->i", corner[other] - corner[one], normal[one]))
        near = (common[:, 0] >= 0) & (common[:, 1] > GEOMETRY.edge)
        near &= apart <= GEOMETRY.accuracy + turn * reach
        found.append(np.column_stack([one, other])[near])
    pairs = np.concatenate(found)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def _measure_overlaps(shape, normal, pairs):
    """Area [m²] over which the surfaces of each pair coincide within the accuracy, and the mean
    distance [m] of the first in front of the second there, both (k,)."""
    points, ring_start, polygon_start = shape
    large, small = pairs.T
    origin = points[ring_start[polygon_start[large]]]
    axes = np.stack(plane_axes(normal[large]), axis=1)  # (k, 2, 3)
    common = shapely.intersection(
        *(draw_outlines(shape, index, origin, axes) for index in (large, small))
    )
    size = shapely.area(common)
    corners, pair = shapely.get_coordinates(common, return_index=True)
    places = origin[pair] + np.einsum("ki,kij->kj", corners, axes[pair])
    anchor = points[ring_start[polygon_start[small]]]
    along = np.einsum("ij,ij->i", normal[large], normal[small])
    ahead = np.einsum("ij,ij->i", places - anchor[pair], normal[small[pair]]) / along[pair]
    furthest = np.zeros(len(pairs))
    np.maximum.at(furthest, pair, np.abs(ahead))
    mean = np.bincount(pair, ahead, len(pairs)) / np.maximum(
        np.bincount(pair, minlength=len(pairs)), 1
    )
    return np.where(furthest <= GEOMETRY.accuracy, size, 0.0), mean


def draw_outlines(shape, chosen, origin, axes):
    """Surfaces with their holes, each projected onto its own axes: (k,) valid shapely
    geometries.
    """
    points, ring_start, polygon_start = shape
    polygon, ring = list_runs(polygon_start[chosen], np.diff(polygon_start)[chosen])
    count = np.diff(ring_start)[ring] + 1  # the first point is repeated at the end
    of_ring, point = list_runs(ring_start[ring], count)
    starts = np.append(0, np.cumsum(count))
    point[starts[1:] - 1] = ring_start[ring]
    pair = polygon[of_ring]
    projected = np.einsum("kj,kij->ki", points[point] - origin[pair], axes[pair])
    offsets = starts, np.append(0, np.cumsum(np.diff(polygon_start)[chosen]))
    outlines = shapely.from_ragged_array(shapely.GeometryType.POLYGON, projected, offsets)
    broken = ~shapely.is_valid(outlines)
    outlines[broken] = shapely.make_valid(outlines[broken])
    return outlines
