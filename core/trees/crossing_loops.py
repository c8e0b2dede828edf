"""All crossings of rays with triangles, summed up (compiled by numba).

Embree finds the first triangle on a ray; the way through a crown needs all of them. The rays that Embree found to meet
any crown pass through a bounding volume hierarchy of their own here, in float64. The test of a ray against a triangle
is watertight: a ray through a shared edge crosses exactly one of the two triangles.

References
----------
Woop, Benthin, Wald (2013), Watertight ray/triangle intersection, Journal of Computer Graphics Techniques 2(1).
"""

import numpy as np
from numba import njit

LEAF = 4  # most triangles of a leaf
DEEPEST = 64
ENOUGH = 1e5  # optical depth that only trunks have
# Rays are shifted by less than a micrometre, so that none passes exactly through an edge of axis-parallel boxes.
ASIDE = (3.1e-7, 2.3e-7, 1.7e-7)


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
        First child and 0 (the second child follows it), or first triangle in `order` and their number; and 1 where the
        node holds nothing but whole bodies.
    order : (t,) int64
    """
    low, high, centre = corners.min(axis=1), corners.max(axis=1), corners.mean(axis=1)
    middle = middles_of_bodies(centre, body)
    order, boxes, links = np.arange(len(corners)), [None], [None]
    waiting = [(0, 0, len(corners), 1)]
    while waiting:
        node, first, last, whole = waiting.pop()
        own = order[first:last]
        boxes[node] = np.concatenate([low[own].min(axis=0), high[own].max(axis=0)])
        several = whole and (body[own] != body[own[0]]).any()
        if last - first <= LEAF and not several:
            links[node] = first, last - first, whole
            continue
        order[first:last], size = halve_bodies(own, middle, body) if several else halve_triangles(own, centre)
        links[node] = len(boxes), 0, whole
        whole = int(several)
        waiting += [(len(boxes), first, first + size, whole), (len(boxes) + 1, first + size, last, whole)]
        boxes += [None, None]
        links += [None, None]
    return np.array(boxes), np.array(links), order


def middles_of_bodies(centre, body):
    """Mean of the centroids of the triangles of its body, for each triangle: (t, 3) float64 [m]."""
    own = np.unique(body, return_inverse=True)[1]
    sums = np.column_stack([np.bincount(own, centre[:, axis]) for axis in range(3)])
    return (sums / np.bincount(own)[:, None])[own]


def halve_bodies(own, middle, body):
    """Triangles of several bodies in order of these, and how many of them make the first half: (m,) int64, int."""
    axis = np.ptp(middle[own], axis=0).argmax()
    own = own[np.lexsort((body[own], middle[own, axis]))]
    starts = np.flatnonzero(np.diff(body[own])) + 1
    return own, int(starts[np.abs(starts - len(own) // 2).argmin()])


def halve_triangles(own, centre):
    """Triangles in two halves along the longest extent of their centroids, and the size of the first."""
    axis, size = np.ptp(centre[own], axis=0).argmax(), len(own) // 2
    return own[np.argpartition(centre[own, axis], size)], size


@njit(nogil=True, cache=True, error_model="numpy")
def sum_crossings(hierarchy, corners, costs, rays, depth):
    """Optical depth along rays.

    The length inside a closed surface is Σ t over the exits minus Σ t over the entries, each at most at the ray's
    reach; it needs no order of the crossings and holds for rays that start or end inside. Bodies beyond the reach add
    nothing and are passed over; what whole bodies add is never below 0, so that the sum may end between two bodies.

    Parameters
    ----------
    hierarchy : tuple of (n, 6) float64 and (n, 3) int64
        Of `build_hierarchy`.
    corners : (t, 3, 3) float64 [m]
        Of the triangles in its order.
    costs : tuple of two (t,) float64
        Optical depth per metre inside, and per crossing within reach.
    rays : tuple of (m, 3) float64, (m, 3) float64, (m,) float64 and (m,) float64
        Origins, unit directions, reach [m], and the optical depth that is enough: above it, the sum may end.
    depth : (m,) float64
        Written.
    """
    (boxes, links), (per_metre, per_crossing), (origins, directions, reach, enough) = hierarchy, costs, rays
    waiting, inverse, shear = np.empty(DEEPEST, np.int64), np.empty(3), np.empty(3)
    for ray in range(len(depth)):
        axes = prepare_ray(directions[ray], inverse, shear)
        x, y, z = origins[ray, 0] + ASIDE[0], origins[ray, 1] + ASIDE[1], origins[ray, 2] + ASIDE[2]
        total, count = 0.0, 1
        waiting[0] = 0
        while count and total < ENOUGH:
            count -= 1
            node = waiting[count]
            first, size, whole = links[node, 0], links[node, 1], links[node, 2]
            if whole and total > enough[ray]:
                break
            near = enter_box(boxes, node, (x, y, z), inverse)
            if near == np.inf or (whole and near > reach[ray]):
                continue
            if size == 0:
                waiting[count], waiting[count + 1] = first, first + 1
                count += 2
                continue
            for triangle in range(first, first + size):
                t, side = cross_triangle(corners, triangle, (x, y, z), axes, shear)
                if t > 0:
                    total += side * per_metre[triangle] * min(t, reach[ray])
                    total += per_crossing[triangle] if t < reach[ray] else 0.0
        depth[ray] = total


@njit(nogil=True, cache=True)
def prepare_ray(direction, inverse, shear):
    """Write the inverse of a direction and its shear; axes in the order in which the last one is the longest."""
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
def enter_box(boxes, node, origin, inverse):
    """Distance at which a ray enters the box of a node, 0 from inside; infinite if the box is not ahead of it."""
    near, far = 0.0, np.inf
    for axis in range(3):
        one = (boxes[node, axis] - origin[axis]) * inverse[axis]
        other = (boxes[node, axis + 3] - origin[axis]) * inverse[axis]
        if one > other:
            one, other = other, one
        near = one if one > near else near
        far = other if other < far else far
    return near if near <= far else np.inf


@njit(nogil=True, cache=True, inline="always")
def enter_slab(low, high, origin, inverse):
    """Distances at which a ray enters and leaves the space between two planes across an axis."""
    one, other = (low - origin) * inverse, (high - origin) * inverse
    return (one, other) if inverse > 0 else (other, one)


@njit(nogil=True, cache=True, inline="always")
def cross_triangle(corners, triangle, origin, axes, shear):
    """Distance of a crossing, negative for none, and its side: 1 where the ray leaves the crown, -1 where it enters."""
    ax, ay, az = sheared(corners, (triangle, 0), origin, axes, shear)
    bx, by, bz = sheared(corners, (triangle, 1), origin, axes, shear)
    cx, cy, cz = sheared(corners, (triangle, 2), origin, axes, shear)
    u, v, w = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
    whole = u + v + w
    if ((u < 0 or v < 0 or w < 0) and (u > 0 or v > 0 or w > 0)) or whole == 0:
        return -1.0, 0.0
    # The projected area is that of the corners seen against the last axis.
    side = 1.0 if (whole < 0) == (shear[2] > 0) else -1.0
    return (u * az + v * bz + w * cz) * shear[2] / whole, side


@njit(nogil=True, cache=True, inline="always")
def sheared(corners, place, origin, axes, shear):
    """Corner in the plane across the ray, and its distance along the last axis."""
    (triangle, corner), (first, second, last) = place, axes
    along = corners[triangle, corner, last] - origin[last]
    x = corners[triangle, corner, first] - origin[first] - shear[0] * along
    y = corners[triangle, corner, second] - origin[second] - shear[1] * along
    return x, y, along
