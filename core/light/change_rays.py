"""Which patches have a ray, or look at a sun, that a change of the city may reach.

patch ─► ray ─► box of the change? ─► changed triangle? ─► ends elsewhere in the edited city? ─►
traced anew
patch ─► sun ─► behind a box?      ─► changed triangle in front of a point? ─► looked at again
"""

import numpy as np
from numba import njit

from ..rays.hemisphere_rays import hemisphere_rays
from ..rays.ray_scene import RayScene
from ..rays.sample_points import HEMISPHERE_REPLICATES, sobol_digits
from ..settings.threads import map_in_order
from .shadow_points import shadow_points
from .sun_visibility import projection_in_front, work_in_slices
from .trace_hemisphere import LEAST, RAYS_PER_TASK, source_rays

MARGIN = 1e-3  # [m] around what has changed: more than rounding of places in single precision


def _scene_of_corners(corners):
    """Triangles, (k, 3, 3) [m], alone: RayScene."""
    return RayScene(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


def find_changed_rows(before, now, patches, rows, change):
    """Patches with a ray that ends at another triangle than before the edit, or passes a changed
    crown of a tree.

    Parameters
    ----------
    before : GatherContext
        Of the city before, whose triangles have the same numbers.
    now : FacingScene
        Of the edited city.
    patches : Patches
    rows : tuple of (r,) int and (r,) int
        Patches that send rays, and how many.
    change : SceneChange

    Returns
    -------
    (c,) int
    """
    solids, crowns = _scene_of_corners(change.solids), _scene_of_corners(change.crowns)
    (rows, counts), boxes = rows, change.boxes
    # Patches that face away from all of the change, or lie behind it, cannot see it.
    ahead = _look_ahead(patches, rows, boxes)
    rows, counts = rows[ahead], counts[ahead]

    def differ(task):
        chosen, count = task
        other = np.zeros(len(chosen), bool)
        # The rays are generated again by their keys; only those that pass a box of the change are
        # followed.
        for owner, origins, directions in _rays_of_patches(before, patches, chosen, count):
            near = _meet_boxes((origins, directions), boxes, MARGIN)
            own, start, towards = owner[near], origins[near], directions[near]
            # Leaves stop rays by chance: what passes a changed crown counts as changed.
            other[own[crowns.trace_closest(start, towards) >= 0]] = True
            # Rays that meet a solid that came or went: is their end another triangle in the edited
            # city?
            met = np.flatnonzero((solids.trace_closest(start, towards) >= 0) & ~other[own])
            ends = [
                one.trace_places(start[met], towards[met]).triangle
                for one in (before.ray_scene, now)
            ]
            other[own[met][ends[0] != ends[1]]] = True
        return chosen[other]

    tasks = []
    # Patches with equally many rays, cut into tasks for the threads.
    for count in np.unique(counts):
        some, step = rows[counts == count], max(1, RAYS_PER_TASK // int(count))
        tasks += [(some[start : start + step], int(count)) for start in range(0, len(some), step)]
    return np.concatenate([np.zeros(0, int), *map_in_order(differ, tasks, before.threads)])


def _rays_of_patches(city, patches, chosen, count):
    """All rays of some patches, to the hemisphere and to sources in the sky: owner (m,), origins,
    directions (m, 3).
    """
    sequence = sobol_digits(count // HEMISPHERE_REPLICATES)
    rays_of = [(np.arange(len(chosen)), hemisphere_rays(patches, chosen, sequence)[:2])]
    few = sequence[: -(-len(sequence) // city.rays_share)]
    for source in city.sources:
        facing = np.flatnonzero(source.unshaded(patches.normal[chosen]).astype(np.float32) > LEAST)
        if len(facing):
            rays_of.append(
                (
                    facing,
                    source_rays(patches, source, chosen[facing], few, share=city.rays_share)[:2],
                )
            )
    for owner, (origins, directions) in rays_of:
        yield np.repeat(owner, origins.shape[1]), origins.reshape(-1, 3), directions.reshape(-1, 3)


def _look_ahead(patches, rows, boxes):
    """Which patches, (r,) int, have any part of a box in front of their plane: (r,) bool."""
    normal, corner = patches.normal[rows].astype(float), patches.corner[rows].astype(float)
    in_front = np.zeros(len(rows), bool)
    for low, high in boxes:
        in_front |= ((np.where(normal > 0, high, low) - corner) * normal).sum(axis=1) > -MARGIN
    return in_front


@njit(nogil=True, cache=True)
def _meet_boxes(rays, boxes, margin):
    """Which rays, origins and unit directions, (m, 3) float32 each, meet any box, (b, 2, 3): (m,)
    bool.
    """
    origins, directions = rays
    meets = np.zeros(len(origins), np.bool_)
    for ray in range(len(origins)):
        for box in range(len(boxes)):
            if _passes(origins[ray], directions[ray], boxes[box], margin):
                meets[ray] = True
                break
    return meets


@njit(nogil=True, cache=True, inline="always")
def _passes(origin, direction, box, margin):
    """Whether a ray meets a box that is wider by a margin on all sides."""
    near, far = 0.0, np.inf
    for axis in range(3):
        low, high = box[0, axis] - margin - origin[axis], box[1, axis] + margin - origin[axis]
        if abs(direction[axis]) < 1e-12:
            if low > 0 or high < 0:
                return False
        else:
            one, other = low / direction[axis], high / direction[axis]
            near, far = max(near, min(one, other)), min(far, max(one, other))
    return near <= far


def find_shadowed(watch, rows, directions, change):
    """Which suns some patches are to look at again: those before which a changed triangle stands.

    Parameters
    ----------
    watch : SunWatch
    rows : (r,) int
        Patches.
    directions : (s, 3) float32
    change : SceneChange

    Returns
    -------
    (r, s) bool
    """
    # A tree of what changed alone, and a ball around each patch.
    patches, shadowed = watch.patches, np.zeros((len(rows), len(directions)), bool)
    # Where nothing changed no sun is looked at again.
    if not len(change.boxes):
        return shadowed
    small = _scene_of_corners(np.concatenate([change.solids, change.crowns]))
    corners = patches.corner[rows, None].astype(float) + np.pad(
        patches.edges[rows].astype(float), ((0, 0), (1, 0), (0, 0))
    )
    middle = corners.mean(axis=1)
    radius = (
        np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
        + patches.offset[rows]
        + MARGIN
    )
    balls, towards = (middle, radius, patches.normal[rows].astype(float)), directions.astype(float)

    def look(part):
        # First by balls and boxes: which suns may stand behind something that changed.
        behind = np.zeros((len(rows[part]), len(directions)), bool)
        _find_suns_behind(tuple(ball[part] for ball in balls), towards, change.boxes, behind)
        # Then by rays from the shadow points against what changed: only suns that it hides from at
        # least one point are looked at again.
        asked = np.flatnonzero(behind.any(axis=1))
        for start in range(0, len(asked), 1 << 10):
            some = asked[start : start + (1 << 10)]
            own = rows[part][some]
            wanted = behind[some] & (projection_in_front(patches.normal[own], directions) > 0)
            free = small.trace_shadow_rays(
                shadow_points(patches, own, watch.point_count), wanted, directions
            )
            shadowed[part][some] = wanted & ~free.all(axis=2)

    work_in_slices(look, len(rows), watch.threads)
    return shadowed


@njit(nogil=True, cache=True)
def _find_suns_behind(patches, directions, boxes, found):
    """Whether a sun in front of a patch may stand behind any of some boxes.

    Parameters
    ----------
    patches : tuple of (c, 3), (c,) and (c, 3) float64
        A ball around each, middle and radius [m], and its normal.
    directions : (s, 3) float64
    boxes : (b, 2, 3) float64 [m]
    found : (c, s) bool
        Written: set where it may.
    """
    middle, radius, normal = patches
    for patch in range(len(middle)):
        for box in range(len(boxes)):
            low = boxes[box, 0] - radius[patch] - middle[patch]
            high = boxes[box, 1] + radius[patch] - middle[patch]
            if high[2] < 0:
                continue
            # No sun that is higher than the box, as seen from its nearest side, stands behind it.
            aside = np.hypot(max(low[0], -high[0], 0.0), max(low[1], -high[1], 0.0))
            highest = high[2] / np.hypot(high[2], aside) + 1e-6 if aside > 0 else 1.0
            for sun in range(len(directions)):
                x, y, z = directions[sun, 0], directions[sun, 1], directions[sun, 2]
                if found[patch, sun] or z > highest:
                    continue
                if normal[patch, 0] * x + normal[patch, 1] * y + normal[patch, 2] * z < -1e-3:
                    continue
                found[patch, sun] = _passes(
                    middle[patch], directions[sun], boxes[box], radius[patch]
                )
