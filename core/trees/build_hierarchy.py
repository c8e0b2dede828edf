"""Bounding volume hierarchy of closed bodies and their triangles, built level by level with whole-array operations."""

import numpy as np

LEAF = 8  # triangles of a leaf, at most: as many as are tested together


def build_hierarchy(corners, body):
    """Bounding volume hierarchy: bodies are halved along the longest extent of their middles, then their triangles.

    Parameters
    ----------
    corners : (t, 3, 3) float64 [m]
    body : (t,) int
        Closed surface, or trunk, that each triangle belongs to.

    Returns
    -------
    boxes : (n, 6) float64
        Low and high corner of each node.
    links : (n, 3) int64
        First child and 0 (the second child follows it), or number of the leaf and that of its triangles; and 1 where
        the node holds nothing but whole bodies.
    order : (l, LEAF) int64
        Triangles of each leaf, followed by -1.
    """
    low, high, centre = corners.min(axis=1), corners.max(axis=1), corners.mean(axis=1)
    middle, body = middles_of_bodies(centre, body), np.unique(body, return_inverse=True)[1]
    order, first, whole = np.arange(len(corners)), np.zeros(1, np.int64), np.ones(1, bool)  # nodes of one level
    boxes, links, leaves, nodes = [], [], [], 1
    while len(first):
        size = np.diff(np.append(first, len(order)))
        box = (function.reduceat(part[order], first) for function, part in ((np.minimum, low), (np.maximum, high)))
        boxes.append(np.concatenate(list(box), axis=1))
        several = np.minimum.reduceat(body[order], first) < np.maximum.reduceat(body[order], first)
        several &= whole
        done = (size <= LEAF) & ~several
        link = np.stack([np.zeros_like(size), size, whole], axis=1)
        link[done, 0] = sum(map(len, leaves)) + np.arange(done.sum())
        link[~done, 0] = nodes + 2 * np.arange((~done).sum())
        link[~done, 1] = 0
        links.append(link)
        leaves.append(fill_leaves(order, first[done], size[done]))
        nodes += 2 * int((~done).sum())
        order, first, several = keep_nodes(order, first, ~done, several)
        order, cut = halve_nodes(order, first, several, (middle, centre, body))
        first, whole = np.stack([first, cut], axis=1).ravel(), np.repeat(several, 2)
    return np.concatenate(boxes), np.concatenate(links), np.concatenate(leaves)


def middles_of_bodies(centre, body):
    """Mean of the centroids of the triangles of its body, for each triangle: (t, 3) float64 [m]."""
    own = np.unique(body, return_inverse=True)[1]
    sums = np.column_stack([np.bincount(own, centre[:, axis]) for axis in range(3)])
    return (sums / np.bincount(own)[:, None])[own]


def fill_leaves(order, first, size):
    """Triangles of leaves, each followed by -1: (l, LEAF) int64."""
    place = first[:, None] + np.arange(LEAF)
    return np.where(np.arange(LEAF) < size[:, None], order[np.minimum(place, len(order) - 1)], -1)


def keep_nodes(order, first, kept, several):
    """Triangles of some nodes of a level, (n,) bool, where each begins among them, and which hold several bodies."""
    size = np.diff(np.append(first, len(order)))
    return order[np.repeat(kept, size)], np.append(0, np.cumsum(size[kept]))[:-1][: kept.sum()], several[kept]


def halve_nodes(order, first, several, scene):
    """Triangles of the nodes of a level in two halves each, and where the second halves begin.

    Parameters
    ----------
    order : (m,) int64
    first : (n,) int64
    several : (n,) bool
        Nodes of several bodies: these stay whole.
    scene : tuple of (t, 3) float64, (t, 3) float64 and (t,) int64
        Middles of the bodies, centroids, and bodies of all triangles.

    Returns
    -------
    (m,) int64
    (n,) int64
    """
    middle, centre, body = scene
    if not len(first):
        return order, first
    size = np.diff(np.append(first, len(order)))
    node = np.repeat(np.arange(len(first)), size)
    place = np.where(several[node, None], middle[order], centre[order])
    extent = np.maximum.reduceat(place, first) - np.minimum.reduceat(place, first)
    along = place[np.arange(len(order)), extent.argmax(axis=1)[node]]
    order = order[np.lexsort((np.where(several[node], body[order], 0), along, node))]
    # The first triangle of a body that is nearest to the half, or the half itself.
    half = first + size // 2
    begins = np.append(True, body[order[1:]] != body[order[:-1]]) | ~several[node]
    begins[first] = False
    starts = np.flatnonzero(begins)
    after = np.searchsorted(starts, half)
    before, after = starts[np.maximum(after - 1, 0)], starts[np.minimum(after, len(starts) - 1)]
    inside = (before > first) & (before < first + size)
    near = inside & (half - before <= np.abs(after - half))
    return order, np.where(near | (after >= first + size), before, after)
