"""What two cities have in common: patches that are the same in both, and boxes around all that differs."""

from dataclasses import fields

import numpy as np
from numba import njit

from ..patches.patches import Patches
from ..rays.random_numbers import mix, mix_columns, name_rows

WITHOUT = ("albedo", "other_side")  # of Patches: rays do not depend on the one, the other is told by name
ABOVE = 1e-6  # sine of an angle, more than rounding
LEAST = 1e-12  # part of a direction along an axis that is told from none
FROM_BEHIND = -1e-3  # cosine of incidence, less by more than rounding than that of a sun in the patch's plane


def match_patches(before, after):
    """The same patch of another PreparedScene with its tree for each patch: (p,) int, -1 if there is none.

    Two patches are the same if all is that their rays follow from, the triangle that others meet, its other side and
    the faces that coincide with it included.
    """
    names = [name_patches(one) for one in (before, after)]
    place = np.full(len(names[1]), -1)
    _, one, other = np.intersect1d(*names, assume_unique=True, return_indices=True)
    place[other] = one
    return place


def name_patches(prepared):
    """A number of 64 bits for each patch that tells all of it but its albedo: (p,) uint64, distinct."""
    corners = np.asarray(prepared.scene.vertices, float)[prepared.scene.triangles]
    parts = [getattr(prepared.patches, one.name) for one in fields(Patches) if one.name not in WITHOUT]
    names, pairs = name_rows([corners, *parts]), prepared.plan.ray_scene.coincident
    found = mix_columns((names, np.append(names, np.uint64(0))[prepared.patches.other_side]))
    face = np.repeat(np.arange(len(names)), np.diff(pairs.start))
    order = np.sign(pairs.other - face).astype(np.int64)  # of coincident faces the first one counts
    columns = names[pairs.other], order.view(np.uint64), *pairs.places.reshape(-1, 6).view(np.uint64).T
    np.add.at(found, face, mix_columns(columns))
    return found


def name_trees(foliage):
    """A number of 64 bits for each tree, from its shape and its leaves: (k,) uint64."""
    if foliage is None:
        return np.zeros(0, np.uint64)
    crowns = foliage.crowns
    parts = np.column_stack([crowns.vertices[crowns.triangles].reshape(-1, 9), crowns.trunk])
    names = np.zeros(len(crowns), np.uint64)
    np.add.at(names, crowns.tree, mix_columns(np.ascontiguousarray(parts.T, float).view(np.uint64)))
    for depth in (*foliage.in_leaf, *foliage.bare):
        names = mix(names ^ np.ascontiguousarray(depth, float).view(np.uint64))
    return names


@njit(nogil=True, cache=True)
def pass_boxes(patches, directions, boxes, found):
    """Whether a sun in front of a patch may stand behind any of some boxes.

    Parameters
    ----------
    patches : tuple of (c, 3), (c,) and (c, 3) float64
        A ball around each, middle and radius [m], and its normal.
    directions : (s, 3) float64
    boxes : (b, 2, 3) float64 [m]
        Of `boxes_of`.
    found : (c, s) bool
        Written.
    """
    middle, radius, normal = patches
    found[:] = False
    if not len(boxes):
        return
    for patch in range(len(middle)):
        low, high = boxes[0, 0] - radius[patch] - middle[patch], boxes[0, 1] + radius[patch] - middle[patch]
        # Suns above the box around all stand behind none.
        aside = np.hypot(max(low[0], -high[0], 0.0), max(low[1], -high[1], 0.0))
        highest = max(high[2], 0.0) / np.hypot(high[2], aside) + ABOVE if aside > 0 else 1.0
        for sun in range(len(directions)):
            if directions[sun, 2] > highest:
                continue
            cosine = 0.0
            for axis in range(3):
                cosine += normal[patch, axis] * directions[sun, axis]
            if cosine < FROM_BEHIND or not passes(middle[patch], directions[sun], boxes[0], radius[patch]):
                continue
            for box in range(1, len(boxes)):
                if passes(middle[patch], directions[sun], boxes[box], radius[patch]):
                    found[patch, sun] = True
                    break


@njit(nogil=True, cache=True)
def rays_through(rays, box, margin):
    """Which rays, a tuple of origins and unit directions, (m, 3) float32 each, meet a box: (m,) bool."""
    origins, directions = rays
    found = np.empty(len(origins), np.bool_)
    for ray in range(len(origins)):
        found[ray] = passes(origins[ray], directions[ray], box, margin)
    return found


@njit(nogil=True, cache=True, inline="always")
def passes(origin, direction, box, margin):
    """Whether a ray meets a box that is wider by a margin on all sides."""
    near, far = 0.0, np.inf
    for axis in range(3):
        low, high = box[0, axis] - margin - origin[axis], box[1, axis] + margin - origin[axis]
        if abs(direction[axis]) < LEAST:
            if low > 0 or high < 0:
                return False
        else:
            one, other = low / direction[axis], high / direction[axis]
            near, far = max(near, min(one, other)), min(far, max(one, other))
    return near <= far
