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

from .build_hierarchy import LEAF

DEEPEST = 64
ENOUGH = 1e5  # optical depth that only trunks have
# Rays are shifted by less than a micrometre, so that none passes exactly through an edge of axis-parallel boxes.
ASIDE = (3.1e-7, 2.3e-7, 1.7e-7)


@njit(nogil=True, cache=True, error_model="numpy")
def sum_crossings(hierarchy, corners, costs, rays, depth):
    """Optical depth along rays, of the same crowns in two states.

    The length inside a closed surface is Σ t over the exits minus Σ t over the entries, each at most at the ray's
    reach; it needs no order of the crossings and holds for rays that start or end inside. Bodies beyond the reach add
    nothing and are passed over; what whole bodies add is never below 0, so that the sum may end between two bodies.

    Parameters
    ----------
    hierarchy : tuple of (n, 6) float64 and (n, 3) int64
        Of `build_hierarchy`.
    corners : (l, 3, 3, LEAF) float64 [m]
        Corner and axis of the triangles of each leaf; without extent where there is none.
    costs : tuple of two (l, LEAF) float64 and (l,) float64
        Optical depth per metre inside, per crossing within reach, and the share of both in the second state.
    rays : tuple of (m, 3) float64, (m, 3) float64, (m,) float64 and (m,) float64
        Origins, unit directions, reach [m], and the optical depth that is enough: above it in both states, the sum may
        end.
    depth : (2, m) float64
        Written.
    """
    (boxes, links), (per_metre, per_crossing, share), (origins, directions, reach, enough) = hierarchy, costs, rays
    waiting, inverse, shear = np.empty(DEEPEST, np.int64), np.empty(3), np.empty(3)
    added = np.empty(LEAF)
    for ray in range(depth.shape[1]):
        axes = prepare_ray(directions[ray], inverse, shear)
        x, y, z = origins[ray, 0] + ASIDE[0], origins[ray, 1] + ASIDE[1], origins[ray, 2] + ASIDE[2]
        total, least, count = 0.0, 0.0, 1
        waiting[0] = 0
        while count and least < ENOUGH:
            count -= 1
            node = waiting[count]
            first, size, whole = links[node, 0], links[node, 1], links[node, 2]
            if whole and least > enough[ray]:
                break
            near = enter_box(boxes, node, (x, y, z), inverse)
            if near == np.inf or (whole and near > reach[ray]):
                continue
            if size == 0:
                waiting[count], waiting[count + 1] = first, first + 1
                count += 2
                continue
            own = per_metre[first], per_crossing[first]
            cross_leaf(corners[first], own, ((x, y, z), axes, shear, reach[ray]), added)
            of_leaf = 0.0
            for triangle in range(size):
                of_leaf += added[triangle]
            total += of_leaf
            least += share[first] * of_leaf
        depth[0, ray], depth[1, ray] = total, least


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


@njit(nogil=True, cache=True, error_model="numpy")
def cross_leaf(corners, costs, ray, added):
    """Optical depth that the crossings of the triangles of a leaf add: per metre up to those where the ray leaves a
    crown, less that up to those where it enters one, and per crossing. Without branches: all are tested together.
    """
    (per_metre, per_crossing), ((x, y, z), (first, second, last), shear, reach) = costs, ray
    origin = (x, y, z)
    shear_first, shear_second, scale = shear[0], shear[1], shear[2]
    one, other, along = origin[first], origin[second], origin[last]
    for k in range(LEAF):
        az, bz, cz = corners[0, last, k] - along, corners[1, last, k] - along, corners[2, last, k] - along
        ax = corners[0, first, k] - one - shear_first * az
        ay = corners[0, second, k] - other - shear_second * az
        bx = corners[1, first, k] - one - shear_first * bz
        by = corners[1, second, k] - other - shear_second * bz
        cx = corners[2, first, k] - one - shear_first * cz
        cy = corners[2, second, k] - other - shear_second * cz
        u, v, w = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
        whole = u + v + w
        outside = ((u < 0) | (v < 0) | (w < 0)) & ((u > 0) | (v > 0) | (w > 0))
        t = (u * az + v * bz + w * cz) * scale / whole
        # The projected area is that of the corners seen against the last axis.
        side = 1.0 if (whole < 0) == (scale > 0) else -1.0
        found = side * per_metre[k] * min(t, reach) + (per_crossing[k] if t < reach else 0.0)
        added[k] = found if (not outside) & (whole != 0) & (t > 0) else 0.0
