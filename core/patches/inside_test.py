"""The inside test, of places from which rays meet hardly anything but fronts: in something, or in a
gap or a court.

┌──────────────┐ roof          No ray from the wall w reaches the sky, and half of them meet the
                               front of the house
│  ┌────┐      │               inside, not a back. What a ray reaches without crossing a face is
inside if the place │  │    │ ←─ w │               is; so rays go on from fronts until they meet a
back or leave. In a court they leave. └──┴────┴──────┘               In a closed room, all of
fronts, they never do: no light gets there.

By the cosine a ray would leave a deep gap after as many turns as the square of its depth over its
width. Whether rays can leave does not depend on the law of their directions, so they go on by one
as likely to take them from one to two widths of the gap along it as from a hundred to two hundred.
"""

import numpy as np
from numba import njit

from ..rays.hemisphere_rays import rays_from_patches
from ..rays.random_numbers import GOLDEN, mix, uniform_of

RAYS = 8  # from each point
STRAY_RAYS = 1  # of them that may reach the sky through a hole from inside an open shell
TURNS = 32  # most faces that a ray goes on from
# before a place counts as closed: of a shaft 50 times as deep as wide one turn in a hundred leaves
MANY_TURNS = 200
# [m]: faces that look at each other from closer than this touch, but for the rounding of a model
CONTACT = 0.01


def judge_ends(backs, skies, below):
    """Whether points lie inside something, from how many of their RAYS rays end at backs, in the
    sky and below the horizon: (k,) bool. If none leaves, the others still go on: the place is
    closed."""
    return (2 * backs > RAYS) & (skies <= STRAY_RAYS) | (skies + below == 0)


def lie_inside(ray_scene, patches, places, keys, ahead=0.0, *, turns=TURNS):
    """Whether some points of patches lie inside something, by RAYS rays from each that go on from
    fronts: (k,) bool.

    Parameters
    ----------
    places : HitPlaces
        k.
    keys : (k,) uint64
        Of random numbers.
    ahead : float [m]
        From the points to where their rays begin, such as CONTACT behind a face that looks back.
    turns : int
        As of `follow`.
    """
    # RAYS rays from each point; `ends` counts how they end, at backs, in the sky, below.
    point, ends = np.repeat(np.arange(len(keys)), RAYS), np.zeros((3, len(keys)), np.int64)
    step = (ahead * patches.normal[places.triangle[point]]).astype(np.float32)
    rays = places.take(point), point, number_rays(keys).ravel()
    follow(ray_scene, patches, rays, ends, owner=places.triangle, ahead=step, turns=turns)
    return judge_ends(*ends)


def number_rays(keys):
    """Keys of random numbers of the RAYS rays of some points, (k,) uint64: (k, RAYS) uint64."""
    return mix(keys[:, None] + np.arange(1, RAYS + 1).astype(np.uint64) * GOLDEN)


def follow(ray_scene, patches, rays, ends, *, owner, ahead=0, turns=TURNS):
    """Rays go on from fronts until they meet a back or leave, at most so many times.

    Parameters
    ----------
    ray_scene : RayScene
    patches : Patches
        Of all triangles of `ray_scene`.
    rays : tuple of HitPlaces, (r,) int and (r,) uint64
        Where they start, the point that each belongs to, and keys of random numbers.
    ends : (3, k) int
        For each point, how many end at backs, in the sky and below the horizon is added to the
        rows. From points with more than STRAY_RAYS in the sky none is followed any more.
    owner : (k,) int
        The patch of each point.
    ahead : (r, 3) float32 [m], optional
        From each place to where its ray starts.
    """
    (triangle, b1, b2), point, keys = rays
    for turn in range(turns):
        u, v = uniform_of(keys[:, None], np.arange(2 * turn + 1, 2 * turn + 3)).T
        # Directions along the face with an even logarithm of their cosine to the normal.
        # The flattest rays have a cosine of 0.001 to the normal.
        height, angle = np.float32(1e-3) ** u, np.float32(2 * np.pi) * v
        along = np.sqrt(1 - height * height)
        local = tuple(
            part[:, None] for part in (along * np.cos(angle), along * np.sin(angle), height)
        )
        # One ray on from each place, on the side of the face that it came to.
        starts = rays_from_patches(patches, triangle, b1[:, None], b2[:, None], local)
        origins, directions = (part[:, 0] for part in starts)
        origins = origins + ahead if turn == 0 else origins
        met, b1, b2 = ray_scene.trace_places(origins, directions)
        # Ended at a back or outside: counted for its point; the others go on, but not for points in
        # the open.
        back = patches.meets_back(met[:, None], directions[:, None])[:, 0]
        gone, upwards = met < 0, directions[:, 2] > 0
        for number, which in enumerate((back, gone & upwards, gone & ~upwards)):
            ends[number] += np.bincount(point[which], minlength=ends.shape[1])
        on = np.flatnonzero(~gone & ~back & (ends[1] <= STRAY_RAYS)[point])
        triangle, b1, b2, point, keys = met[on], b1[on], b2[on], point[on], keys[on]
        if not len(on):
            break


def find_touching(patches, own, hits):
    """Which rays meet a face that looks back at their patch from less than CONTACT.

    Parameters
    ----------
    patches : Patches
    own : (m,) int
        The patch that each starts from.
    hits : HitPlaces
        m; where it ends.

    Returns
    -------
    (m,) bool
    """
    # On patches smaller than 1 m (the root of the area) they must be closer in proportion.
    closest = (CONTACT * np.minimum(np.sqrt(patches.area[own]), 1)).astype(np.float32)
    return facing_distance(patches, own, hits) < closest


def facing_distance(patches, own, hits):
    """Distance from patches to the faces that rays from there meet, as of `find_touching`: (m,)
    float32 [m]; infinite where these do not look back at them."""
    distance = np.full(len(own), np.inf, np.float32)
    _measure_facing((patches.corner, patches.edges, patches.facing), own, tuple(hits), distance)
    return distance


@njit(nogil=True, cache=True)
def _measure_facing(shapes, own, hits, distance):
    """Write the last argument, (m,) float32 [m], for `facing_distance`.

    Parameters
    ----------
    shapes : tuple of (p, 3) float32 [m], (p, 2, 3) float32 [m] and (p, 4) float32
        `corner`, `edges` and `facing` of `Patches`.
    own : (m,) int
        The patch that each ray starts from.
    hits : tuple of (m,) int, (m,) float32 and (m,) float32
        Of `HitPlaces`.
    """
    (corner, edges, facing), (met, b1, b2) = shapes, hits
    for ray in range(len(own)):
        # cosine  between the normals of the two faces; away  distance of the hit in front of the
        # patch's plane [m].
        one, other = own[ray], met[ray]
        if other < 0:
            continue
        cosine, away = np.float32(0), np.float32(0)
        for axis in range(3):
            along = b1[ray] * edges[other, 0, axis] + b2[ray] * edges[other, 1, axis]
            cosine += facing[one, axis] * facing[other, axis]
            away += facing[one, axis] * (corner[other, axis] + along - corner[one, axis])
        if cosine < -0.9:
            distance[ray] = away
