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


def build_hierarchy(corners):
    """Bounding volume hierarchy, by halving along the longest extent of the centroids.

    Parameters
    ----------
    corners : (t, 3, 3) float64 [m]

    Returns
    -------
    boxes : (n, 6) float64
        Low and high corner of each node.
    links : (n, 2) int64
        First child and 0 (the second child follows it), or first triangle in `order` and their number.
    order : (t,) int64
    """
    low, high, centre = corners.min(axis=1), corners.max(axis=1), corners.mean(axis=1)
    order, boxes, links = np.arange(len(corners)), [None], [None]
    waiting = [(0, 0, len(corners))]
    while waiting:
        node, first, last = waiting.pop()
        own = order[first:last]
        boxes[node] = np.concatenate([low[own].min(axis=0), high[own].max(axis=0)])
        if last - first <= LEAF:
            links[node] = first, last - first
            continue
        axis, middle = np.ptp(centre[own], axis=0).argmax(), (last - first) // 2
        order[first:last] = own[np.argpartition(centre[own, axis], middle)]
        links[node] = len(boxes), 0
        waiting += [(len(boxes), first, first + middle), (len(boxes) + 1, first + middle, last)]
        boxes += [None, None]
        links += [None, None]
    return np.array(boxes), np.array(links), order


@njit(nogil=True, cache=True, error_model="numpy")
def sum_crossings(hierarchy, corners, costs, rays, depth):
    """Optical depth along rays.

    The length inside a closed surface is Σ t over the exits minus Σ t over the entries, each at most at the ray's
    reach; it needs no order of the crossings and holds for rays that start or end inside.

    Parameters
    ----------
    hierarchy : tuple of (n, 6) float64 and (n, 2) int64
        Of `build_hierarchy`.
    corners : (t, 3, 3) float64 [m]
        Of the triangles in its order.
    costs : tuple of two (t,) float64
        Optical depth per metre inside, and per crossing within reach.
    rays : tuple of (m, 3) float64, (m, 3) float64 and (m,) float64
        Origins, unit directions, reach [m].
    depth : (m,) float64
        Written.
    """
    (boxes, links), (per_metre, per_crossing), (origins, directions, reach) = hierarchy, costs, rays
    waiting, inverse, shear = np.empty(DEEPEST, np.int64), np.empty(3), np.empty(3)
    for ray in range(len(depth)):
        axes = prepare_ray(directions[ray], inverse, shear)
        x, y, z = origins[ray, 0] + ASIDE[0], origins[ray, 1] + ASIDE[1], origins[ray, 2] + ASIDE[2]
        total, count = 0.0, 1
        waiting[0] = 0
        while count and total < ENOUGH:
            count -= 1
            node = waiting[count]
            if not meets_box(boxes, node, (x, y, z), inverse):
                continue
            first, size = links[node, 0], links[node, 1]
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
def meets_box(boxes, node, origin, inverse):
    """Whether a ray meets the box of a node ahead of its origin."""
    near, far = 0.0, np.inf
    for axis in range(3):
        one = (boxes[node, axis] - origin[axis]) * inverse[axis]
        other = (boxes[node, axis + 3] - origin[axis]) * inverse[axis]
        if one > other:
            one, other = other, one
        near = one if one > near else near
        far = other if other < far else far
    return near <= far


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
