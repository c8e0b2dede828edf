"""Coincident faces: triangles that overlap in one plane, whichever way each of them faces.

They are found with a hash grid: boxes sorted by the cubic cells that they touch. Triangles are
sorted by size into layers; the cells of a layer are as large as its triangles, so that each of
these, and every smaller one, touches at most eight cells. Every triangle is compared with the
triangles of its own layer and of the coarser ones.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numba import njit

from ..settings.threads import map_in_order
from ..settings.tolerances import GEOMETRY
from .random_numbers import GOLDEN

MOST_PAIRS = 256  # per triangle; a pair that shares several cells counts in each


@dataclass
class Coincident:
    """For each of p patches, those that overlap it in its plane, no further away than the offset of
    ray origins.
    """

    start: np.ndarray  # (p + 1,) int64, where the entries of each patch begin
    other: np.ndarray  # (e,) int32, ascending for each patch
    # (e, 2, 3) float64, maps (1, b1, b2) of a point on the patch to b1 and b2 on the other
    places: np.ndarray

    def __len__(self):
        return len(self.other)

    def take(self, kept):
        """The entries that a mask, (e,) bool, keeps."""
        start = np.concatenate([[0], np.cumsum(kept)])[self.start]
        return Coincident(start, self.other[kept], self.places[kept])

    def measure_overlaps(self, entries):
        """What both faces of some entries have in common: its middle in barycentric weights of the
        other face, (e, 2) float32, and its share of the area of that, (e,) float64.
        """
        return _measure_overlaps(self.places[entries])


def find_coincident(corners, offset, threads=1, *, layer_growth=2.0, triangles_per_task=1 << 15):
    """Pairs of triangles that overlap in one plane.

    Parameters
    ----------
    corners : (t, 3, 3) float [m]
    offset : (t,) float [m]
        Distance of ray origins from the plane: triangles no further away than this coincide.
        Triangles that overlap by less than this in any direction only touch.
    threads : int

    Returns
    -------
    Coincident
        Each pair in both orders.
    """
    # Planes, boxes that reach as far as the offset, and the layer of each triangle by its size.
    corners, offset = np.ascontiguousarray(corners, float), np.asarray(offset, float)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.sqrt(normal[:, 0] ** 2 + normal[:, 1] ** 2 + normal[:, 2] ** 2)
    normal /= np.maximum(length, np.finfo(float).tiny)[:, None]
    boxes = np.concatenate(
        [corners.min(axis=1) - offset[:, None], corners.max(axis=1) + offset[:, None]], axis=1
    )
    extent = (boxes[:, 3:] - boxes[:, :3]).max(axis=1, initial=0)
    # `layer_growth`: as a power of two: cells of one layer are four times as large as in the next
    # finer one.
    layer = np.ceil(np.log2(np.maximum(extent, np.finfo(np.float32).tiny)) / layer_growth).astype(
        np.int32
    )
    largest = int(layer[length > 0].max(initial=-(1 << 20)))
    layer[length == 0] = largest + 1  # triangles without area are compared with none
    faces, order = (corners, normal, offset, boxes, layer), np.argsort(layer, kind="stable")
    sorted_layer = layer[order]
    pairs = [np.zeros((0, 2), np.int32)]
    # A layer at a time: its triangles in buckets; they and all finer ones are compared with them.
    for one in np.unique(sorted_layer[sorted_layer <= largest]):
        size = 2.0 ** (layer_growth * one)
        first, last = np.searchsorted(sorted_layer, [one, one + 1])
        buckets = 1 << int(2 * (last - first)).bit_length()
        start, listed = _fill_buckets(order[first:last], boxes, size, buckets)
        # contiguous: most pairs fail by normals
        grid = (
            start,
            listed,
            normal[listed].astype(np.float32),
        )
        tasks = [
            order[begin : min(begin + triangles_per_task, last)]
            for begin in range(0, last, triangles_per_task)
        ]
        pairs.extend(
            map_in_order(
                partial(
                    _pairs_in_grid, grid=grid, size=size, faces=faces, parallel=GEOMETRY.facing
                ),
                tasks,
                threads,
            )
        )
    return _list_pairs(np.concatenate(pairs), corners)


def _list_pairs(pairs, corners):
    """Coincident from pairs of triangles, which may contain repetitions.

    Parameters
    ----------
    pairs : (k, 2) int32
    corners : (t, 3, 3) float64 [m]

    Returns
    -------
    Coincident
    """
    count = len(corners)
    # Both orders of each pair, once, sorted by their first triangle.
    both = np.concatenate([pairs, pairs[:, ::-1]]).astype(np.int64)
    one, other = np.divmod(np.unique(both[:, 0] * count + both[:, 1]), max(count, 1))
    edges = corners[:, 1:] - corners[:, :1]
    # A point of the one, a + b1·e1 + b2·e2, relative to the other's first corner and in its edges.
    points = np.concatenate([corners[one, :1] - corners[other, :1], edges[one]], axis=1)
    # Dual vectors of the other's edges in its plane, 1 along one edge and 0 along the other.
    normal = np.cross(edges[other, 0], edges[other, 1])
    normal /= np.maximum((normal**2).sum(axis=1, keepdims=True), np.finfo(float).tiny)
    dual = np.stack([np.cross(edges[other, 1], normal), np.cross(normal, edges[other, 0])], axis=1)
    places = np.einsum("eix,ekx->eik", dual, points)
    return Coincident(np.searchsorted(one, np.arange(count + 1)), other.astype(np.int32), places)


@njit(nogil=True, cache=True)
def _pairs_in_grid(chosen, grid, size, faces, parallel):
    """Pairs of chosen triangles with triangles of a grid: (k, 2) int32, some of them several times.

    The cosine between their normals is at least `parallel`, whichever way they face.

    A triangle is the first one in at most MOST_PAIRS of them: more in one place are an error of the
    model, and thousands would give millions of pairs.
    """
    (start, listed, normals), (corners, normal, offset, boxes, layer) = grid, faces
    mask, touched = np.uint64(len(start) - 2), np.empty(27, np.int64)
    pairs, found = np.empty((64, 2), np.int32), 0
    for one in chosen:
        most = found + MOST_PAIRS
        # Every bucket that the triangle's box touches; of its entries those in another plane or
        # apart fall out by cheap tests first.
        for place in range(_touch_cells(boxes, one, size, mask, touched)):
            for entry in range(start[touched[place]], start[touched[place] + 1]):
                other = listed[entry]
                if found == most or (other <= one and layer[one] == layer[other]):
                    # the triangle has its most pairs; or, as buckets are in descending order, the
                    # remaining pairs are found from their other triangle
                    break
                along = normal[one, 0] * normals[entry, 0] + normal[one, 1] * normals[entry, 1]
                if abs(along + normal[one, 2] * normals[entry, 2]) < parallel or not _boxes_meet(
                    boxes, one, other
                ):
                    continue
                # In one plane if either's corners lie within reach of the other's; overlapping if
                # no edge of the two separates them.
                reach = max(offset[one], offset[other])
                level = _lies_in_plane(corners, normal, one, other, reach)
                level = level or _lies_in_plane(corners, normal, other, one, reach)
                if level and not _separated(corners, normal, one, other, reach):
                    if found == len(pairs):
                        # Twice the room; np.concatenate takes numba three times as long to compile.
                        wider = np.empty((2 * found, 2), np.int32)
                        for row in range(found):
                            wider[row, 0], wider[row, 1] = pairs[row, 0], pairs[row, 1]
                        pairs = wider
                    pairs[found, 0], pairs[found, 1] = one, other
                    found += 1
    return pairs[:found]


@njit(nogil=True, cache=True, inline="always")
def _boxes_meet(boxes, one, other):
    """Whether the bounding boxes of two triangles overlap."""
    for axis in range(3):
        if boxes[one, axis] > boxes[other, axis + 3] or boxes[other, axis] > boxes[one, axis + 3]:
            return False
    return True


@njit(nogil=True, cache=True, inline="always")
def _lies_in_plane(corners, normal, one, other, reach):
    """Whether all corners of a triangle lie within `reach` of the plane of another."""
    for point in range(3):
        height = 0.0
        for axis in range(3):
            height += (corners[one, point, axis] - corners[other, 0, axis]) * normal[other, axis]
        if abs(height) > reach:
            return False
    return True


@njit(nogil=True, cache=True, inline="always")
def _separated(corners, normal, one, other, reach):
    """Whether an edge of one of two triangles separates them up to `reach`, seen along the normal
    of the first.
    """
    n0, n1, n2 = normal[one, 0], normal[one, 1], normal[one, 2]
    # Separating axes: if along the normal of some edge, in the plane, their extents have no more in
    # common than `reach`, they only touch.
    for owner in (one, other):
        for corner in range(3):
            after = (corner + 1) % 3
            e0 = corners[owner, after, 0] - corners[owner, corner, 0]
            e1 = corners[owner, after, 1] - corners[owner, corner, 1]
            e2 = corners[owner, after, 2] - corners[owner, corner, 2]
            # normal to the edge, in the plane
            a0, a1, a2 = (
                e1 * n2 - e2 * n1,
                e2 * n0 - e0 * n2,
                e0 * n1 - e1 * n0,
            )
            one_low, one_high = _reach_along(corners, one, a0, a1, a2)
            other_low, other_high = _reach_along(corners, other, a0, a1, a2)
            common = min(one_high - other_low, other_high - one_low)
            if common <= reach * np.sqrt(a0 * a0 + a1 * a1 + a2 * a2):
                return True
    return False


@njit(nogil=True, cache=True, inline="always")
def _reach_along(corners, one, a0, a1, a2):
    """Smallest and largest coordinate of a triangle's corners along a direction."""
    low, high = np.inf, -np.inf
    for point in range(3):
        place = (
            corners[one, point, 0] * a0 + corners[one, point, 1] * a1 + corners[one, point, 2] * a2
        )
        low, high = min(low, place), max(high, place)
    return low, high


@njit(nogil=True, cache=True, inline="always")
def _bucket_of_cell(x, y, z, mask):
    """Hash bucket of a cell; collisions only cost time."""
    # The bits of the cell's three numbers are stirred until all depend on all.
    word = np.uint64(x) * GOLDEN
    word = (word ^ (word >> np.uint64(29)) ^ np.uint64(y)) * np.uint64(0xBF58476D1CE4E5B9)
    word = (word ^ (word >> np.uint64(32)) ^ np.uint64(z)) * np.uint64(0x94D049BB133111EB)
    return np.int64((word ^ (word >> np.uint64(31))) & mask)


@njit(nogil=True, cache=True, inline="always")
def _cell_along(place, size):
    """Number of the cell, along one axis, that holds a coordinate [m]."""
    return np.int64(np.floor(place / size))


@njit(nogil=True, cache=True)
def _touch_cells(boxes, one, size, mask, touched):
    """Write the buckets of the cells that one of some boxes touches, each once, into `touched`, and
    return their number.

    Parameters
    ----------
    boxes : (t, 6) float64
        Low and high corner [m].
    one : int
    size : float
        Of the cells, no smaller than the box.
    mask : uint64
        One less than the number of buckets.
    touched : (27,) int64
    """
    # All cells between the corners of the box, each bucket once.
    count = 0
    for x in range(_cell_along(boxes[one, 0], size), _cell_along(boxes[one, 3], size) + 1):
        for y in range(_cell_along(boxes[one, 1], size), _cell_along(boxes[one, 4], size) + 1):
            for z in range(_cell_along(boxes[one, 2], size), _cell_along(boxes[one, 5], size) + 1):
                bucket = _bucket_of_cell(x, y, z, mask)
                known = False
                for place in range(count):
                    known |= touched[place] == bucket
                if not known:
                    touched[count] = bucket
                    count += 1
    return count


@njit(nogil=True, cache=True)
def _fill_buckets(members, boxes, size, buckets):
    """Sort triangles by the cells that their boxes touch.

    Parameters
    ----------
    members : (n,) int
        Ascending.
    boxes : (t, 6) float64
        Low and high corner of each triangle's box.
    size : float
        Of the cells.
    buckets : int
        A power of two.

    Returns
    -------
    start : (buckets + 1,) int64
        Where the entries of each bucket begin.
    listed : (e,) int64
        The triangles, descending in each bucket.
    """
    mask, touched = np.uint64(buckets - 1), np.empty(27, np.int64)
    # Counting sort: how many entries each bucket has, where it ends, and the entries from the end
    # on.
    start = np.zeros(buckets + 1, np.int64)
    for member in members:
        for place in range(_touch_cells(boxes, member, size, mask, touched)):
            start[touched[place]] += 1
    for bucket in range(buckets):
        start[bucket + 1] += start[bucket]
    listed = np.empty(start[buckets], np.int64)
    for member in members:
        for place in range(_touch_cells(boxes, member, size, mask, touched)):
            start[touched[place]] -= 1
            listed[start[touched[place]]] = member
    return start, listed


def _measure_overlaps(places):
    """Middle, (e, 2) float32, and share, (e,) float64, of overlaps, as of
    `Coincident.measure_overlaps`.

    The first face is clipped by the edges of the other; the result is convex, so the mean of its
    corners lies inside.

    Parameters
    ----------
    places : (e, 2, 3) float64
        Of `Coincident`.

    References
    ----------
    Sutherland and Hodgman (1974), doi:10.1145/360767.360802.
    """
    # The first face in the weights of the other: (e, k, 2); only the first `count` are corners.
    first, one, other = np.moveaxis(places, 2, 0)
    corners, count = np.stack([first, first + one, first + other], axis=1), np.full(len(places), 3)
    for edge in range(3):
        # The weight of a corner is 0 on the edge, and negative beyond it.
        weight = corners[..., edge] if edge < 2 else 1 - corners.sum(axis=2)
        known, after = _walk_around(corners, count)
        weight_after = np.take_along_axis(weight, after, axis=1)
        crosses = known & (weight * weight_after < 0)
        share = np.divide(weight, weight - weight_after, out=np.zeros(weight.shape), where=crosses)
        side = np.take_along_axis(corners, after[..., None], axis=1) - corners
        # Kept are corners that are inside, and behind each where its side crosses the edge.
        candidates = np.stack([corners, corners + share[..., None] * side], axis=2)
        kept = np.stack([known & (weight >= 0), crosses], axis=2)
        kept = kept.reshape(len(places), 2 * corners.shape[1])
        count = kept.sum(axis=1)
        order = np.argsort(~kept, axis=1, kind="stable")[:, : count.max(initial=0)]
        candidates = candidates.reshape(*kept.shape, 2)
        corners = np.take_along_axis(candidates, order[..., None], axis=1)
    # Twice the area in weights, by Gauss's formula, is the share: the whole face has 1/2.
    known, after = _walk_around(corners, count)
    corners = np.where(known[..., None], corners, 0)
    ahead = np.take_along_axis(corners, after[..., None], axis=1)
    share = (corners[..., 0] * ahead[..., 1] - ahead[..., 0] * corners[..., 1]).sum(axis=1)
    middle = corners.sum(axis=1) / np.maximum(count, 1)[:, None]
    return np.where(count[:, None] > 0, middle, 1 / 3).astype(np.float32), np.abs(share)


def _walk_around(corners, count):
    """Of polygons with `count` corners, (e,), in rows of (e, k, 2): which are corners, (e, k) bool,
    and which follows each.
    """
    place, count = np.arange(corners.shape[1]), count[:, None]
    return place < count, np.where(place + 1 < count, place + 1, 0)
