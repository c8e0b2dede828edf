"""What two cities have in common: patches that are the same in both, and boxes around all that differs."""

from dataclasses import fields

import numpy as np
from numba import njit

from ..patches.patches import Patches
from ..rays.random_numbers import are_among, mix, name_rows

WITHOUT = ("albedo", "other_side")  # of Patches: rays do not depend on the one, the other is told by number
LEAST = 1e-12  # part of a direction along an axis that is told from none
ABOVE = 1e-6  # sine of an angle, more than rounding
FROM_BEHIND = -1e-3  # cosine of incidence, less by more than rounding than that of a sun in the patch's plane


def match_patches(before, after):
    """The same patch of another PreparedScene for each patch: (p,) int, -1 if there is none.

    Two patches are the same if all is that their rays follow from, the triangle that others meet included.
    """
    names = [name_patches(one) for one in (before, after)]
    place = np.full(len(names[1]), -1)
    _, one, other = np.intersect1d(*names, assume_unique=True, return_indices=True)
    place[other] = one
    return place


def name_patches(prepared):
    """A number of 64 bits for each patch that tells all of it but its albedo: (p,) uint64, distinct."""
    corners = np.asarray(prepared.scene.vertices, float)[prepared.scene.triangles]
    names = [one.name for one in fields(Patches) if one.name not in WITHOUT]
    return name_rows([corners, *(getattr(prepared.patches, name) for name in names)])


def mark_altered(cities, after):
    """Patches of both cities, (o,) and (p,) bool, of which another one is the other side, or that coincide with others.

    Parameters
    ----------
    cities : tuple of TracedCity and PreparedScene
    after : (o,) int
    """
    before, prepared = cities
    number = np.append(after, -1)
    one, other = before.context.ray_scene.coincident, prepared.plan.ray_scene.coincident
    sides = number[before.prepared.patches.other_side], prepared.patches.other_side
    new = np.zeros(len(prepared.patches), bool)
    kept = np.flatnonzero(after >= 0)
    new[after[kept]] = sides[0][kept] != sides[1][after[kept]]
    pairs = [
        (np.repeat(np.arange(len(pairs.start) - 1), np.diff(pairs.start)), pairs.other, pairs.places)
        for pairs in (one, other)
    ]
    names = []
    for (face, met, places), numbers in zip(pairs, (number, np.arange(len(new))), strict=True):
        words = np.zeros(len(face), np.uint64)
        columns = numbers[face], numbers[met], np.sign(met - face), *places.reshape(len(face), 6).view(np.int64).T
        for column in columns:
            words = mix(words + np.uint64(1) ^ column.astype(np.int64).view(np.uint64))
        names.append((numbers[face], words))
    for (face, mine), (_, theirs) in zip(names, names[::-1], strict=True):
        odd = face[~are_among(mine, theirs)]
        new[odd[odd >= 0]] = True
    old = np.zeros(len(after), bool)
    old[kept] = new[after[kept]]
    return old, new


def name_trees(foliage):
    """A number of 64 bits for each tree, from its shape and its leaves: (k,) uint64."""
    if foliage is None:
        return np.zeros(0, np.uint64)
    crowns = foliage.crowns
    parts = np.column_stack([crowns.vertices[crowns.triangles].reshape(-1, 9), crowns.trunk])
    words = np.zeros(len(parts), np.uint64)
    for column in parts.T:
        words = mix(words + np.uint64(1) ^ np.ascontiguousarray(column).view(np.uint64))
    names = np.zeros(len(crowns), np.uint64)
    np.add.at(names, crowns.tree, words)
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
    order = np.argsort(directions[:, 2])
    along = np.ascontiguousarray(directions[order].T)
    inverse, facing = 1 / np.where(np.abs(along) > LEAST, along, LEAST), np.empty(len(order), np.bool_)
    for patch in range(len(middle)):
        low, high = boxes[0, 0] - radius[patch] - middle[patch], boxes[0, 1] + radius[patch] - middle[patch]
        x, y, z = normal[patch, 0], normal[patch, 1], normal[patch, 2]
        # Suns above the box around all stand behind none.
        aside = np.hypot(max(low[0], -high[0], 0.0), max(low[1], -high[1], 0.0))
        highest = max(high[2], 0.0) / np.hypot(high[2], aside) if aside > 0 else 1.0
        below, some = np.searchsorted(along[2], highest + ABOVE), False
        # That box first, of several suns at a time, and so without branches.
        for sun in range(below):
            a, b = low[0] * inverse[0, sun], high[0] * inverse[0, sun]
            c, d = low[1] * inverse[1, sun], high[1] * inverse[1, sun]
            e, f = low[2] * inverse[2, sun], high[2] * inverse[2, sun]
            near, far = max(min(a, b), min(c, d), min(e, f), 0.0), min(max(a, b), max(c, d), max(e, f))
            cosine = x * along[0, sun] + y * along[1, sun] + z * along[2, sun]
            facing[sun] = (near <= far) & (cosine >= FROM_BEHIND)
            some |= facing[sun]
        if some:
            for place in np.flatnonzero(facing[:below]):
                sun = order[place]
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
