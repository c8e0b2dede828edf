"""All crossings of rays with the triangles of closed bodies, summed up (compiled by numba).

Embree finds the first triangle on a ray; the way through a crown needs all of them. The rays that
Embree found to meet any crown pass through a bounding volume hierarchy of their own here, in
float64. It is built level by level with whole-array operations. The test of a ray against a
triangle is watertight: a ray through a shared edge crosses exactly one of the two triangles.

References
----------
Woop, Benthin, Wald (2013), Watertight ray/triangle intersection, Journal of Computer Graphics
Techniques 2(1).
"""

import numpy as np
from numba import njit

LEAF = 8  # triangles of a leaf, at most: as many as are tested together
# Rays are shifted by less than a micrometre, so that none passes exactly through an edge of
# axis-parallel boxes.
ASIDE = (3.1e-7, 2.3e-7, 1.7e-7)


def build_hierarchy(corners, body):
    """Bounding volume hierarchy: bodies are halved along the longest extent of their middles, then
    their triangles.

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
        First child and 0 (the second child follows it), or number of the leaf and how many
        triangles it has; and 1 where the node holds nothing but whole bodies.
    order : (l, LEAF) int64
        Triangles of each leaf, followed by -1.
    """
    # Boxes of triangles, and the middle of the body that each belongs to.
    low, high, centre = corners.min(axis=1), corners.max(axis=1), corners.mean(axis=1)
    body = np.unique(body, return_inverse=True)[1]
    sums = np.column_stack([np.bincount(body, centre[:, axis]) for axis in range(3)])
    middle = (sums / np.bincount(body)[:, None])[body]  # of the body of each triangle
    # At first one node, the root, holds all triangles, in one list with the place where each node
    # of the level begins.
    order, first, whole = (
        np.arange(len(corners)),
        np.zeros(1, np.int64),
        np.ones(1, bool),
    )
    # Level by level: every node that is too large for a leaf is halved into two of the next level.
    boxes, links, leaves, nodes = [], [], [], 1
    while len(first):
        # Number of triangles and box of each node, and whether it still holds several bodies.
        size = np.diff(np.append(first, len(order)))
        box = (
            function.reduceat(part[order], first)
            for function, part in ((np.minimum, low), (np.maximum, high))
        )
        boxes.append(np.concatenate(list(box), axis=1))
        several = np.minimum.reduceat(body[order], first) < np.maximum.reduceat(body[order], first)
        several &= whole
        # Leaves get the next numbers of leaves, nodes that are halved the numbers of their
        # children.
        # A leaf is small and of one body: nodes of several bodies are halved between these, however
        # small they are.
        done = (size <= LEAF) & ~several
        link = np.stack([np.zeros_like(size), size, whole], axis=1)
        link[done, 0] = sum(map(len, leaves)) + np.arange(done.sum())
        link[~done, 0] = nodes + 2 * np.arange((~done).sum())
        link[~done, 1] = 0
        links.append(link)
        # Triangles of leaves leave the list; the rest is sorted into halves.
        place = first[done, None] + np.arange(LEAF)
        filled = np.arange(LEAF) < size[done, None]
        leaves.append(np.where(filled, order[np.minimum(place, len(order) - 1)], -1))
        nodes += 2 * int((~done).sum())
        order, first = order[np.repeat(~done, size)], (np.cumsum(size[~done]) - size[~done])
        several = several[~done]
        order, cut = _halve_nodes(order, first, several, (middle, centre, body))
        # Halves of a node of several bodies hold whole bodies, halves of one body do not.
        first, whole = np.stack([first, cut], axis=1).ravel(), np.repeat(several, 2)
    return np.concatenate(boxes), np.concatenate(links), np.concatenate(leaves)


def _halve_nodes(order, first, several, scene):
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


@njit(nogil=True, cache=True, error_model="numpy")
def sum_crossings(hierarchy, corners, costs, rays, depth):
    """Optical depth along rays, of the same crowns in two states.

    The length inside a closed surface is Σ t over the exits minus Σ t over the entries, each at
    most at the ray's reach; it needs no order of the crossings and holds for rays that start or end
    inside. Bodies beyond the reach add nothing and are passed over; what whole bodies add is never
    below 0, so that the sum may end between two bodies.

    Parameters
    ----------
    hierarchy : tuple of (n, 6) float64 and (n, 3) int64
        Of `build_hierarchy`.
    corners : (l, 3, 3, LEAF) float64 [m]
        Corner and axis of the triangles of each leaf; without extent where there is none.
    costs : tuple of two (l, LEAF) float64 and (l,) float64
        Optical depth per metre inside, per crossing within reach, and the share of both in the
        second state.
    rays : tuple of (m, 3) float64, (m, 3) float64, (m,) float64 and (m,) float64
        Origins, unit directions, reach [m], and the optical depth that is enough: above it in both
        states, the sum may end.
    depth : (2, m) float64
        Written.
    """
    (boxes, links), (per_metre, per_crossing, share), (origins, directions, reach, enough) = (
        hierarchy,
        costs,
        rays,
    )
    waiting, inverse, shear = np.empty(64, np.int64), np.empty(3), np.empty(3)
    added = np.empty(LEAF)
    for ray in range(depth.shape[1]):
        # A ray moved aside by a hair, so that it never runs exactly along an edge; nodes that wait
        # to be visited, the root first.
        axes = _prepare_ray(directions[ray], inverse, shear)
        x, y, z = origins[ray, 0] + ASIDE[0], origins[ray, 1] + ASIDE[1], origins[ray, 2] + ASIDE[2]
        total, least, count = 0.0, 0.0, 1
        waiting[0] = 0
        # The sum ends at an optical depth of 1e5, which only trunks have: no light is left.
        while count and least < 1e5:
            count -= 1
            node = waiting[count]
            first, size, whole = links[node, 0], links[node, 1], links[node, 2]
            # Enough already, or out of reach: no need to look inside.
            if whole and least > enough[ray]:
                break
            near = _enter_box(boxes, node, (x, y, z), inverse)
            if near == np.inf or (whole and near > reach[ray]):
                continue
            # A node has two children; a leaf adds exits less entries of its triangles.
            if size == 0:
                waiting[count], waiting[count + 1] = first, first + 1
                count += 2
                continue
            own = per_metre[first], per_crossing[first]
            _cross_leaf(corners[first], own, ((x, y, z), axes, shear, reach[ray]), added)
            of_leaf = 0.0
            for triangle in range(size):
                of_leaf += added[triangle]
            total += of_leaf
            least += share[first] * of_leaf
        depth[0, ray], depth[1, ray] = total, least


@njit(nogil=True, cache=True)
def _prepare_ray(direction, inverse, shear):
    """Write the inverse of a direction and its shear; axes in the order in which the last one is
    the longest.
    """
    last = 0
    for axis in range(3):
        inverse[axis] = 1 / direction[axis] if direction[axis] != 0 else 1e300
        if abs(direction[axis]) > abs(direction[last]):
            last = axis
    first, second = (last + 1) % 3, (last + 2) % 3
    shear[0], shear[1] = direction[first] / direction[last], direction[second] / direction[last]
    shear[2] = inverse[last]
    return first, second, last


@njit(nogil=True, cache=True, inline="always")
def _enter_box(boxes, node, origin, inverse):
    """Distance at which a ray enters the box of a node, 0 from inside; infinite if the box is not
    ahead of it.
    """
    near, far = 0.0, np.inf
    for axis in range(3):
        one = (boxes[node, axis] - origin[axis]) * inverse[axis]
        other = (boxes[node, axis + 3] - origin[axis]) * inverse[axis]
        if one > other:
            one, other = other, one
        near = one if one > near else near
        far = other if other < far else far
    return near if near <= far else np.inf


@njit(nogil=True, cache=True, error_model="numpy")
def _cross_leaf(corners, costs, ray, added):
    """Optical depth that the crossings of the triangles of a leaf add: per metre up to those where
    the ray leaves a crown, less that up to those where it enters one, and per crossing. Without
    branches: all are tested together.

    `added`, (LEAF,) float64, is written: what each triangle adds, of the first state.
    """
    (per_metre, per_crossing), ((x, y, z), (first, second, last), shear, reach) = costs, ray
    origin = (x, y, z)
    shear_first, shear_second, scale = shear[0], shear[1], shear[2]
    one, other, along = origin[first], origin[second], origin[last]
    for k in range(LEAF):
        # Corners relative to the ray's origin, sheared so that the ray runs along the last axis.
        az, bz, cz = (
            corners[0, last, k] - along,
            corners[1, last, k] - along,
            corners[2, last, k] - along,
        )
        ax = corners[0, first, k] - one - shear_first * az
        ay = corners[0, second, k] - other - shear_second * az
        bx = corners[1, first, k] - one - shear_first * bz
        by = corners[1, second, k] - other - shear_second * bz
        cx = corners[2, first, k] - one - shear_first * cz
        cy = corners[2, second, k] - other - shear_second * cz
        # Edge functions: all of one sign where the ray passes through the triangle.
        u, v, w = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
        whole = u + v + w
        outside = ((u < 0) | (v < 0) | (w < 0)) & ((u > 0) | (v > 0) | (w > 0))
        # Distance along the ray, from the barycentric mean of the corners' depths.
        t = (u * az + v * bz + w * cz) * scale / whole
        # Signed area of the corners in projection, seen against the last axis.
        side = 1.0 if (whole < 0) == (scale > 0) else -1.0
        # Leaving a crown adds the depth up to there, entering one subtracts it.
        crossing_depth = side * per_metre[k] * min(t, reach) + (
            per_crossing[k] if t < reach else 0.0
        )
        # A triangle that the ray misses, runs along or meets behind its origin adds nothing.
        added[k] = crossing_depth if (not outside) & (whole != 0) & (t > 0) else 0.0
