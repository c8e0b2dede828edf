"""Which parts of patches lie inside or under something: the vote of rays from each of 64 cover
cells.

A surface counts as covered where more than half of its area is (`counted_area`). What the cells of
a patch tell on each other stands in `cover_cells`, what their rays meet in `rays.surroundings`.
"""

import numpy as np

from ..rays import sample_points, surroundings
from ..rays.faces import Fate
from ..rays.hemisphere_rays import CELL_DIVISIONS
from ..rays.random_numbers import mix, uniform_of
from ..rays.ray_scene import HitPlaces
from ..rays.sample_points import Cells, barycentric_of_square
from ..rays.surroundings import RAYS
from ..settings.tolerances import GEOMETRY
from . import cover_cells
from .cover_cells import COVERED, FACING, OPEN, TOUCHING, UNKNOWN

# cells: all along the edges, half of the others
UPRIGHT = np.flatnonzero(sample_points.Cells(CELL_DIVISIONS).places()[1] % 2 == 0)


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
    # court. Of a shaft 50 times as deep as wide one turn in a hundred leaves.
    suspected, shut = (first >= TOUCHING).any(axis=1), np.flatnonzero((first == FACING).all(axis=1))
    middle = np.full(len(shut), 1 / 3, np.float32)
    keys = mix(patches.place_key[chosen[shut]] ^ np.uint64(0xC105ED))
    places = HitPlaces(chosen[shut], middle, middle)
    suspected[shut] = surroundings.lie_inside(ray_scene, patches, places, keys, turns=200)
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
    return *stratified_points(u, v, CELL_DIVISIONS, cells), shifts


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
    places = HitPlaces(np.repeat(chosen, b1.shape[1]), b1.ravel(), b2.ravel())
    x, y, z = _directions(1, [part.ravel() for part in shifts])[..., 0]
    if rising:
        frames = [
            part[places.triangle, 2]
            for part in (*np.moveaxis(patches.tangents, 1, 0), patches.normal)
        ]
        height = x * frames[0] + y * frames[1] + z * frames[2]
        turned = (height < 0) & (z > 2 * height * frames[2])
        x, y, z = (
            np.where(turned, part - 2 * height * up, part)
            for part, up in zip((x, y, z), frames, strict=True)
        )
    # The kind of face that each ray meets: a back inside something, a front, or none.
    met = surroundings.send(ray_scene.trace_places, patches, places, (x, y, z))
    states = np.full(met.fate.shape, UNKNOWN)
    for fate, state in ((Fate.FRONT, FACING), (Fate.SKY, OPEN), (Fate.BACK, COVERED)):
        states[met.fate == fate] = state
    touching = _find_touching(patches, places.triangle, met.places)
    states[touching & (states == FACING)] = TOUCHING
    return states.reshape(b1.shape)


def _directions(count, shifts):
    """Directions by the cosine law, shifted from point to point by random numbers, two (k,): (3, k,
    count) float32.
    """
    around = sample_points.additive_recurrence(count, 2)
    u, v = (_shift(around[:, axis], shifts[axis]) for axis in (0, 1))
    return np.stack(sample_points.cosine_direction(u, v))


def _shift(points, shifts):
    """One coordinate of a point set, shifted at random modulo 1 (Cranley-Patterson rotation).

    Parameters
    ----------
    points : (m,) float32
    shifts : (...) float32

    Returns
    -------
    (..., m) float32 in [0, 1)

    References
    ----------
    Cranley and Patterson (1976), doi:10.1137/0713071.
    """
    moved = points + shifts[..., None]
    moved -= moved >= 1
    return moved


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
    verdict = cover_cells.settled_cells(states)

    def judge(asked):
        row, cell = np.nonzero(asked & (verdict == UNKNOWN))
        places = HitPlaces(chosen[row], b1[row, cell], b2[row, cell])
        keys = mix(patches.place_key[chosen[row]] ^ np.uint64(0x1A51DE)) + cell.astype(np.uint64)
        around = np.stack([part[row, cell] for part in shifts], axis=1)
        verdicts = _judge_cells(ray_scene, patches, places, around, keys)
        verdict[row, cell] = np.where(verdicts, COVERED, OPEN)

    # Leading cells vote by RAYS rays; what they agree on goes to the cells between; the rest vote
    # too.
    judge(np.isin(np.arange(states.shape[1]), cover_cells.LEADING))
    verdict = cover_cells.share_verdicts(verdict, states)
    judge(np.ones(1, bool))
    # What lies below the ground is covered, whatever the rays say.
    earth = patches.lie_in_earth(ray_scene, patches.points(chosen, b1, b2))
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
    # RAYS rays from each cell, and how many end at backs, in the sky and below the horizon.
    point = np.repeat(np.arange(len(keys)), RAYS)
    local = _directions(RAYS, shifts.T).reshape(3, -1)
    met = surroundings.send(ray_scene.trace_as_drawn, patches, places.take(point), local)
    fate = met.fate.reshape(-1, RAYS)
    ends = np.stack([(fate == kind).sum(axis=1) for kind in (Fate.BACK, Fate.SKY, Fate.FAR_GROUND)])
    # No ray reached the sky, and too few met backs: is there a face that looks back within touch?
    inside = surroundings.lies_inside(ends, closed=False)
    doubtful = ~inside & (ends[1] == 0)
    own, b1, b2 = places.take(doubtful)
    origins = patches.points(own, b1[:, None], b2[:, None])[:, 0]
    ahead = ray_scene.trace_places(origins, patches.normal[own])
    touching = np.zeros(len(inside), bool)
    touching[doubtful] = _find_touching(patches, own, ahead)
    # A cell that is not called inside, and from which a ray reached the sky, is outside. From all
    # other cells that touch nothing rays go on from the fronts that they met, and their ends
    # decide.
    asked = inside | (doubtful & ~touching)
    going = np.flatnonzero((met.fate == Fate.FRONT) & asked[point])
    side = np.where(met.behind[going], np.float32(-1), np.float32(1))
    numbers = surroundings.number_rays(keys).ravel()[going]
    rays = met.places.take(going), side, point[going], numbers
    surroundings.follow(ray_scene.trace_places, patches, rays, ends)
    inside = surroundings.lies_inside(ends)
    # A place that touches another face is judged from behind that face.
    inside[touching] = surroundings.lie_inside(
        ray_scene, patches, places.take(touching), keys[touching], GEOMETRY.accuracy
    )
    return inside


def _find_touching(patches, own, hits):
    """Which rays from patches, (m,) int, meet a face that looks back at these from less than
    the accuracy of the model: (m,) bool.
    """
    # On patches smaller than 1 m (the root of the area) they must be closer in proportion.
    closest = (GEOMETRY.accuracy * np.minimum(np.sqrt(patches.area[own]), 1)).astype(np.float32)
    return patches.facing_distance(own, hits) < closest


def stratified_points(u, v, divisions, cells=slice(None)):
    """Stratified sampling: one uniform point in each of the `divisions`² congruent sub-triangles.

    Parameters
    ----------
    u, v : (n, cells) float32
        Random numbers.
    divisions : int
    cells : (cells,) int, optional
        The sub-triangles; all if not given.

    Returns
    -------
    b1, b2 : (n, cells) float32
    """
    # (2, 1, cells) each
    first, second, third = np.moveaxis(Cells(divisions).corners()[cells], 0, -1)[:, :, None]
    b1, b2 = barycentric_of_square(u, v)
    return tuple(first + b1 * (second - first) + b2 * (third - first))
