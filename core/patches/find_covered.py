"""Which parts of patches lie inside or under something: the vote of rays from each of 64 cover
cells.

A surface counts as covered where more than half of its area is (`counted_area`). What the cells of
a patch tell on each other stands in `cover_cells`, rays that go on from fronts in `inside_test`.
"""

import numpy as np

from ..rays import sample_points
from ..rays.hemisphere_rays import CELL_DIVISIONS, points_of_patches, rays_from_patches
from ..rays.random_numbers import mix, uniform_of
from ..rays.ray_scene import HitPlaces
from .cover_cells import (
    COVERED,
    FACING,
    LEADING,
    OPEN,
    TOUCHING,
    UNKNOWN,
    enclosed_cells,
    settled_cells,
    share_verdicts,
)
from .hit_kinds import BACK, DARK, FRONT, SKY, classify_rays
from .inside_test import (
    CONTACT,
    MANY_TURNS,
    RAYS,
    STRAY_RAYS,
    find_touching,
    follow,
    judge_ends,
    lie_inside,
    number_rays,
)

AFTER_FIRST = np.arange(RAYS) > 0
# cells: all along the edges, half of the others
UPRIGHT = np.flatnonzero(sample_points.cell_places(CELL_DIVISIONS)[1] % 2 == 0)
STATE_OF_FATE = np.full(DARK + 1, UNKNOWN)
STATE_OF_FATE[[FRONT, SKY, BACK]] = FACING, OPEN, COVERED


def find_covered_cells(ray_scene, patches, chosen):
    """Which cells of some patches lie inside or under something.

    Points and rays are the same for every seed and any number of samples: what is covered is
    geometry, and a wall that is covered for about half would otherwise be eligible with some seeds
    only. Each cell has one point. First rays from the upright cells, which are all that line the
    edges of a patch and half of the others, tell whether the patch is examined at all. They rise
    wherever they can: below the ground, rays that descend hit nothing.

    Parameters
    ----------
    ray_scene : RayScene
    patches : Patches
    chosen : (c,) int

    Returns
    -------
    (c, CELL_DIVISIONS²) bool
    """
    # Of a part of the city, such as a tile, cover is judged in the whole one.
    if ray_scene.whole is not None:
        ray_scene, patches, rows = ray_scene.whole
        chosen = rows[chosen]
    # One ray from each upright cell: what meets a back, or a face as good as in the same place,
    # makes a patch suspect.
    starts = starts_in_cells(patches.place_key[chosen], UPRIGHT)
    first = _first_states(ray_scene, patches, chosen, starts, rising=True)
    covered = np.zeros((len(chosen), CELL_DIVISIONS**2), bool)
    # Where all first rays met fronts, rays from the middle that go on tell a closed room from a
    # court.
    suspected, shut = (first >= TOUCHING).any(axis=1), np.flatnonzero((first == FACING).all(axis=1))
    middle = np.full(len(shut), 1 / 3, np.float32)
    keys = mix(patches.place_key[chosen[shut]] ^ np.uint64(0xC105ED))
    places = HitPlaces(chosen[shut], middle, middle)
    suspected[shut] = lie_inside(ray_scene, patches, places, keys, turns=MANY_TURNS)
    # Only suspects are examined cell by cell.
    suspect = np.flatnonzero(suspected)
    if len(suspect):
        starts = starts_in_cells(patches.place_key[chosen[suspect]], np.arange(CELL_DIVISIONS**2))
        covered[suspect] = _examine_cells(ray_scene, patches, chosen[suspect], starts)
    return covered


def starts_in_cells(keys, cells):
    """One point in each of some cells of patches, and random numbers: `starts` of `_first_states`.

    Parameters
    ----------
    keys : (c,) uint64
    cells : (m,) int
    """
    keys = mix(keys ^ np.uint64(0xC0FE))[:, None]
    u, v, *shifts = (uniform_of(keys, 4 * cells + number) for number in range(1, 5))
    return *sample_points.stratified_points(u, v, CELL_DIVISIONS, cells), shifts


def _first_states(ray_scene, patches, chosen, starts, *, rising=False):
    """What a first ray from each of some points tells on them.

    Parameters
    ----------
    chosen : (c,) int
    starts : tuple of (c, m), (c, m) and two (c, m) float32
        Barycentric weights of the points, and two random numbers in [0, 1).
    rising : bool
        Whether rays that would descend are mirrored at the horizontal plane, where that leaves them
        in front.

    Returns
    -------
    (c, m) int8
        COVERED if it hits a back, FACING a front, TOUCHING one that is as good as in the same
        place; OPEN if it reaches the sky, UNKNOWN if it leaves below the horizon, from an open
        place or from below the ground.
    """
    # One cosine-distributed ray from each point, turned upwards where it would descend and the
    # surface still sees it.
    b1, b2, shifts = starts
    u, v = (
        sample_points.shifted(around, shifts[axis])[..., 0]
        for axis, around in enumerate(sample_points.additive_recurrence(1, 2).T)
    )
    local = sample_points.cosine_direction(u, v)
    origins, directions = rays_from_patches(patches, chosen, b1, b2, local)
    if rising:
        height = directions[..., 2]
        turned = (height < 0) & (local[2] > 2 * height * patches.normal[chosen, 2:])
        np.negative(height, where=turned, out=height)
    # The kind of face that each ray meets: a back inside something, a front, or none.
    rays, own = (origins.reshape(-1, 3), directions.reshape(-1, 3)), np.repeat(chosen, u.shape[1])
    places = ray_scene.trace_places(*rays)
    hit = places.triangle.reshape(u.shape)
    fate = np.empty(hit.shape, np.uint8)
    classify_rays(hit, np.ascontiguousarray(np.moveaxis(directions, -1, 0)), patches.facing, fate)
    # The back of a sheet is lit from there, so it counts as a front.
    backs = np.nonzero(fate == BACK)
    fate[backs] = np.where(patches.other_side[hit[backs]] < 0, BACK, FRONT)  # sheets have none
    states = STATE_OF_FATE[fate]
    touching = find_touching(patches, own, places).reshape(u.shape)
    states[touching & (states == FACING)] = TOUCHING
    return states


def _examine_cells(ray_scene, patches, chosen, starts):
    """Which cells of patches lie inside or under something, by rays from one point in each.

    First rays settle cells deep in the open or deep inside. In the others RAYS rays vote, first in
    the leading ones; a cell between such as agree takes their verdict, unless its first ray or a
    neighbour's denies it. A cell is covered if more than half of the rays hit backs and at most one
    reaches the sky. Real models are open shells: a single ray proves nothing, and rays into an open
    house from outside hit backs, but others reach the sky, or do so when they go on from the fronts
    that they meet. From a wall that continues below the ground, rays hit the back of the ground
    upwards and nothing downwards: no ray carries light, so the cell is covered too. Below a slope
    some rays would escape to the sky under the hill; there a vertical ray decides, which hits the
    back of the ground first.

    Parameters
    ----------
    chosen : (c,) int
    starts : tuple
        As of `_first_states`.

    Returns
    -------
    (c, cells) bool
    """
    # First rays settle cells whose neighbours all agree.
    states, (b1, b2, shifts) = _first_states(ray_scene, patches, chosen, starts), starts
    verdict = settled_cells(states)

    def judge(asked):
        row, cell = np.nonzero(asked & (verdict == UNKNOWN))
        places = HitPlaces(chosen[row], b1[row, cell], b2[row, cell])
        keys = mix(patches.place_key[chosen[row]] ^ np.uint64(0x1A51DE)) + cell.astype(np.uint64)
        around = np.stack([part[row, cell] for part in shifts], axis=1)
        verdicts = _judge_cells(ray_scene, patches, places, around, keys)
        verdict[row, cell] = np.where(verdicts, COVERED, OPEN)

    # Leading cells vote by RAYS rays; what they agree on goes to the cells between; the rest vote
    # too.
    judge(np.isin(np.arange(states.shape[1]), LEADING))
    verdict = share_verdicts(verdict, states)
    judge(np.ones(1, bool))
    # What lies below the ground is covered, whatever the rays say.
    earth = lie_in_earth(ray_scene, patches, points_of_patches(patches, chosen, b1, b2))
    return (verdict == COVERED) | earth


def _judge_cells(ray_scene, patches, places, shifts, keys):
    """Whether some cells lie inside or under something, by a vote of rays that go on from fronts
    where they disagree.

    Parameters
    ----------
    places : HitPlaces
        k, one in each cell.
    shifts : (k, 2) float32
        Random numbers in [0, 1).
    keys : (k,) uint64
        Of more of these.

    Returns
    -------
    (k,) bool
    """
    hits, back, sky, below = _trace_vote(ray_scene, patches, places, shifts)
    backs, skies, belows = ends = np.stack([which.sum(axis=1) for which in (back, sky, below)])
    # Inside something, or in the earth.
    inside = ((2 * backs > RAYS) & (skies <= STRAY_RAYS)) | (
        (4 * backs > RAYS) & (backs + belows == RAYS)
    )
    # No ray reached the sky, and too few met backs: is there a face that looks back within touch?
    doubtful = ~inside & (ends[1] == 0)
    touching = np.zeros(len(inside), bool)
    own, b1, b2 = places.take(doubtful)
    origins = points_of_patches(patches, own, b1[:, None], b2[:, None])[:, 0]
    touching[doubtful] = find_touching(
        patches, own, ray_scene.trace_places(origins, patches.normal[own])
    )
    # hidden  places from which no ray met a back or the sky; going  rays that go on from the fronts
    # they met.
    hidden = doubtful & ~touching & (ends[0] == 0)
    going = (inside | (doubtful & ~touching))[:, None] & ~(back | sky | below)
    # Of places from which all rays met fronts most are in the open: one that leaves tells, and
    # spares the others.
    for part in (going & ~(hidden[:, None] & AFTER_FIRST), going & (hidden[:, None] & AFTER_FIRST)):
        point, ray = np.nonzero(part & ~(hidden & (ends[1] + ends[2] > 0))[:, None])
        rays = hits.take((point, ray)), point, number_rays(keys)[point, ray]
        follow(ray_scene, patches, rays, ends, owner=places.triangle)
    # Their ends decide; a place that touches another face is judged from behind that face.
    mixed = going.any(axis=1)
    inside[mixed] = judge_ends(*ends[:, mixed])
    inside[touching] = lie_inside(
        ray_scene, patches, places.take(touching), keys[touching], CONTACT
    )
    return inside


def _trace_vote(ray_scene, patches, places, shifts):
    """Where the rays of a vote end: HitPlaces, and whether at a back, in the sky, below the
    horizon: all (k, RAYS).
    """
    # RAYS directions by the cosine, shifted from point to point.
    around = sample_points.additive_recurrence(RAYS, 2)
    u, v = (sample_points.shifted(around[:, axis], shifts[:, axis]) for axis in (0, 1))
    own, b1, b2 = places
    b1, b2 = (np.repeat(weights[:, None], RAYS, axis=1) for weights in (b1, b2))
    origins, directions = rays_from_patches(
        patches, own, b1, b2, sample_points.cosine_direction(u, v)
    )
    rays = origins.reshape(-1, 3), directions.reshape(-1, 3)
    hits = ray_scene.trace_as_drawn(*rays)
    hits = HitPlaces(*(part.reshape(u.shape) for part in hits))
    gone, upwards = hits.triangle < 0, directions[..., 2] > 0
    return hits, patches.meets_back(hits.triangle, directions), gone & upwards, gone & ~upwards


def lie_in_earth(ray_scene, patches, points):
    """Whether the first face straight above some points is the ground, hit from below.

    Parameters
    ----------
    points : (c, m, 3) float32 [m]

    Returns
    -------
    (c, m) bool
    """
    if not patches.ground.any():
        return np.zeros(points.shape[:2], bool)
    up = np.tile(np.float32([0, 0, 1]), (points.shape[0] * points.shape[1], 1))
    above = ray_scene.trace_closest(points.reshape(-1, 3), up)
    return ((above >= 0) & patches.ground[above] & (patches.normal[above, 2] > 0)).reshape(
        points.shape[:2]
    )


def cells_near_cover(covered, within):
    """Cells that are covered or touch a covered one: (c, cells) bool.

    In these, whether a ray starts in the open is decided ray by ray: it does if it does not hit a
    back.

    Parameters
    ----------
    covered : (c, cells) bool
    within : (w,) int
        Patches that have such cells.
    """
    near_cover = np.zeros(covered.shape, bool)
    # all but open cells surrounded by open ones
    near_cover[within] = ~enclosed_cells(~covered[within])
    return near_cover
