"""Places from which rays meet hardly anything but fronts: inside something, or outside in a gap or court.

┌──────────────┐ roof          No ray from the wall w reaches the sky, and half of them meet the front of the house
│  ┌────┐      │               inside, not a back. What a ray reaches without crossing a face is inside if the place
│  │    │ ←─ w │               is; so rays go on from fronts until they meet a back or leave. In a court they leave,
└──┴────┴──────┘               or go on to the end.
"""

import numpy as np
from numba import njit

from ..sampling.hemisphere_rays import points_of_patches, rays_from_patches
from ..sampling.random_numbers import GOLDEN, mix, uniform_of
from ..sampling.sample_points import cosine_direction
from .classify_rays import meets_back

RAYS = 8  # from each point
STRAY_RAYS = 1  # of them that may reach the sky through a hole
TURNS = 16  # most faces that a ray goes on from; then it tells nothing
TOUCHING = 0.01  # [m]: faces that look at each other from closer than this touch, but for the rounding of a model
WIDTH = 1.0  # [m] of a patch, the root of its area; on smaller ones they must be closer in proportion
OPPOSITE = -0.9  # cosine between the normals of faces that look at each other


def lie_inside(ray_scene, patches, places, sees_back, keys):
    """Whether some points of patches, from which no ray reaches the sky, lie inside something.

    Rays go on from the fronts that they meet. Where a front looks back from less than TOUCHING, they start behind it.

    Parameters
    ----------
    ray_scene : RayScene
    patches : Patches
        Of all triangles of `ray_scene`.
    places : Places
        k.
    sees_back : (k,) bool
        Whether any ray met a back so far. If none did and no front is close, the point is outside.
    keys : (k,) uint64
        Of random numbers.

    Returns
    -------
    (k,) bool
    """
    own, b1, b2 = places
    origins = points_of_patches(patches, own, b1[:, None], b2[:, None])[:, 0]
    touching = find_touching(patches, own, ray_scene.trace_places(origins, patches.normal[own]))
    found = np.zeros(len(own), bool)
    chosen = np.flatnonzero(sees_back | touching)
    ahead = (TOUCHING * touching[chosen, None] * patches.normal[own[chosen]]).astype(np.float32)
    found[chosen] = walk(ray_scene, patches, places.take(chosen), ahead, keys[chosen])
    return found


def walk(ray_scene, patches, places, ahead, keys):
    """Whether more than half of RAYS walks from some points end at backs, and at most STRAY_RAYS in the sky: (k,) bool.

    Parameters
    ----------
    ahead : (k, 3) float32 [m]
        From each point to where its walks begin.
    """
    count = len(keys)
    keys = mix(keys[:, None] + np.arange(1, RAYS + 1).astype(np.uint64) * GOLDEN).ravel()
    point = going = np.arange(len(keys))
    point = point // RAYS
    triangle, b1, b2 = places.take(point)
    inside, above = np.zeros((2, count), np.int64)
    for turn in range(TURNS):
        u, v = uniform_of(keys[going, None], np.arange(2 * turn + 1, 2 * turn + 3)).T
        local = tuple(part[:, None] for part in cosine_direction(u, v))
        starts = rays_from_patches(patches, triangle, b1[:, None], b2[:, None], local)
        origins, directions = (part[:, 0] for part in starts)
        met, b1, b2 = ray_scene.trace_places(origins + ahead[point[going]] if turn == 0 else origins, directions)
        back = meets_back(patches, met[:, None], directions[:, None])[:, 0]
        inside += np.bincount(point[going[back]], minlength=count)
        above += np.bincount(point[going[(met < 0) & (directions[:, 2] > 0)]], minlength=count)
        on = np.flatnonzero((met >= 0) & ~back & (above <= STRAY_RAYS)[point[going]])
        going, triangle, b1, b2 = going[on], met[on], b1[on], b2[on]
    return (2 * inside > RAYS) & (above <= STRAY_RAYS)


def find_touching(patches, own, hits):
    """Which rays meet a face that looks back at their patch from less than TOUCHING.

    Parameters
    ----------
    patches : Patches
    own : (m,) int
        The patch that each starts from.
    hits : Places
        m; where it ends.

    Returns
    -------
    (m,) bool
    """
    touching = np.zeros(len(own), bool)
    closest = (TOUCHING * np.minimum(np.sqrt(patches.area[own]) / WIDTH, 1)).astype(np.float32)
    mark_touching((patches.corner, patches.edges, patches.facing), (own, closest), tuple(hits), touching)
    return touching


@njit(nogil=True, cache=True)
def mark_touching(shapes, starts, hits, touching):
    """Set entries of the last argument, (m,) bool, for `find_touching`.

    Parameters
    ----------
    shapes : tuple of (p, 3) float32 [m], (p, 2, 3) float32 [m] and (p, 4) float32
        `corner`, `edges` and `facing` of `Patches`.
    starts : tuple of (m,) int and (m,) float32 [m]
        The patch that each ray starts from, and how close a face must be.
    hits : tuple of (m,) int, (m,) float32 and (m,) float32
        Of `Places`.
    """
    (corner, edges, facing), (own, closest), (met, b1, b2) = shapes, starts, hits
    for ray in range(len(own)):
        one, other = own[ray], met[ray]
        if other < 0:
            continue
        cosine, distance = np.float32(0), np.float32(0)
        for axis in range(3):
            along = b1[ray] * edges[other, 0, axis] + b2[ray] * edges[other, 1, axis]
            cosine += facing[one, axis] * facing[other, axis]
            distance += facing[one, axis] * (corner[other, axis] + along - corner[one, axis])
        touching[ray] = cosine < OPPOSITE and distance < closest[ray]
