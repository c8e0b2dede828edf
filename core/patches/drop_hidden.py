"""Which fronts of coincident faces light can reach: not those of party walls, which face into a neighbour's house.

To a ray, a roof drawn from both sides and a party wall are the same: a back and a front in one place. They differ in
what is in front of the front. Rays from the middle of the overlap of the two faces find out.
"""

import numpy as np
from numba import njit

from ..rays.places import Places
from ..sampling.random_numbers import mix, uniform
from ..settings.threads import map_in_order
from .find_coincident import Coincident
from .find_covered import vote_covered

RAYS = 16  # per vote
STRAY_RAYS = 2  # of them that may reach the sky through a hole
MOST_CORNERS = 24  # of a triangle clipped by three edges: 6, and never more than twice as many after each cut
PAIRS_PER_TASK = 1 << 13


def drop_hidden(ray_scene, patches, coincident, threads=1):
    """Coincident faces without the fronts that light does not reach; only pairs that face opposite ways are tested.

    Parameters
    ----------
    ray_scene : RayScene
    patches : Patches
    coincident : Coincident
    threads : int

    Returns
    -------
    Coincident
    """
    one = np.repeat(np.arange(len(patches)), np.diff(coincident.start))
    other = coincident.other
    opposite = np.einsum("ex,ex->e", patches.normal[one], patches.normal[other]) < 0
    doubtful = np.flatnonzero(opposite & patches.receives[other])
    tasks = [doubtful[begin : begin + PAIRS_PER_TASK] for begin in range(0, len(doubtful), PAIRS_PER_TASK)]

    def vote(entries):
        faces, middle = other[entries], middle_of_overlap(coincident.places[entries])
        shifts, places = uniform(mix(patches.key[faces] ^ np.uint64(0x51DE)), 2), Places(faces, *middle.T)
        return vote_covered(ray_scene, patches, places, shifts, rays=RAYS, stray=STRAY_RAYS)

    kept = ~opposite
    for entries, hidden in zip(tasks, map_in_order(vote, tasks, threads), strict=True):
        kept[entries] = ~hidden
    start = np.concatenate([[0], np.cumsum(kept)])[coincident.start]
    return Coincident(start, other[kept], coincident.places[kept])


@njit(nogil=True, cache=True)
def middle_of_overlap(places):
    """A point that lies on both faces of each pair, in barycentric weights of the other face: (e, 2) float32.

    The first face is clipped by the edges of the other; the result is convex, so the mean of its corners lies inside.

    Parameters
    ----------
    places : (e, 2, 3) float64
        Of `Coincident`.
    """
    middle = np.empty((len(places), 2), np.float32)
    corners, clipped = np.empty((MOST_CORNERS, 2)), np.empty((MOST_CORNERS, 2))
    for entry in range(len(places)):
        for axis in range(2):
            for corner in range(3):
                corners[corner, axis] = places[entry, axis, 0]
            corners[1, axis] += places[entry, axis, 1]
            corners[2, axis] += places[entry, axis, 2]
        count = places.shape[2]
        for edge in range(3):
            count = cut_off(corners, count, edge, clipped)
            corners, clipped = clipped, corners
        for axis in range(2):
            total = 0.0
            for corner in range(count):
                total += corners[corner, axis]
            middle[entry, axis] = total / count if count else 1 / 3
    return middle


@njit(nogil=True, cache=True)
def cut_off(corners, count, edge, clipped):
    """Clip a convex polygon of `count` corners, in barycentric weights, to the inner side of an edge.

    The result is written to `clipped`, and its number of corners returned. Loops over numbers, not slices of arrays,
    which would take numba ten times as long to compile.

    References
    ----------
    Sutherland and Hodgman (1974), doi:10.1145/360767.360802.
    """
    kept = 0
    for corner in range(count):
        after = (corner + 1) % count
        inside_here, inside_there = inside_of_edge(corners, corner, edge), inside_of_edge(corners, after, edge)
        if inside_here >= 0:
            for axis in range(2):
                clipped[kept, axis] = corners[corner, axis]
            kept += 1
        if inside_here * inside_there < 0:
            share = inside_here / (inside_here - inside_there)
            for axis in range(2):
                clipped[kept, axis] = corners[corner, axis] + share * (corners[after, axis] - corners[corner, axis])
            kept += 1
    return kept


@njit(nogil=True, cache=True, inline="always")
def inside_of_edge(corners, corner, edge):
    """Barycentric weight of a corner that is 0 on an edge."""
    return corners[corner, edge] if edge < 2 else 1 - corners[corner, 0] - corners[corner, 1]
