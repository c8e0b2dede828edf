"""Which parts of patches lie inside or under something."""

import numpy as np
from numba import njit

from ..sampling.hemisphere_rays import CELL_DIVISIONS, points_of_patches, rays_from_patches
from ..sampling.random_numbers import mix, uniform
from ..sampling.sample_points import additive_recurrence, cell_contacts, cosine_direction, shifted, stratified_points

RAYS_PER_CELL = 8  # the vote that judges
STRAY_RAYS = 1  # of them that may find a hole to the sky from the inside of an open shell
UNKNOWN, OPEN, COVERED = np.int8([-1, 0, 1])  # verdicts on a cell


def meets_back(patches, hit, directions):
    """Whether rays meet the back of a patch: they run along its normal, or it is a footprint. Sheets have none.

    Parameters
    ----------
    hit : (c, rays) int32
        -1 where nothing is met.
    directions : (c, rays, 3) float32

    Returns
    -------
    (c, rays) bool
    """
    facing = patches.facing[hit]
    along = directions[..., 0] * facing[..., 0]
    along += directions[..., 1] * facing[..., 1]
    along += directions[..., 2] * facing[..., 2]
    along += facing[..., 3]
    return (along > 0) & (hit >= 0) & (patches.other_side[hit] < 0)


def find_covered_cells(ray_scene, patches, chosen, verdict=None):
    """Which cells of some patches lie inside or under something.

    One point in each cell looks around; it is covered when more than half of its rays meet backs and at most one the
    sky. Real models are open shells: a single ray decides nothing, and who looks into an open house from outside meets
    backs, but the sky too. A wall that goes on below the ground meets the ground's back upwards and nothing downwards:
    no ray of it brings light, and it is covered too. Below a slope some of its rays would leave into the sky under the
    hill; there a ray straight up tells, which meets the ground's back first.

    Parameters
    ----------
    ray_scene : RayScene
    patches : Patches
    chosen : (c,) int
    verdict : (c, CELL_DIVISIONS²) int8, optional
        What is known of the cells already, of `judge_cells`; only the others look around.

    Returns
    -------
    (c, CELL_DIVISIONS²) bool
    """
    count, cells = len(chosen), CELL_DIVISIONS**2
    verdict = np.full((count, cells), UNKNOWN) if verdict is None else verdict
    numbers = uniform(mix(patches.key[chosen] ^ np.uint64(0xC0FE)), 4 * cells).reshape(count, cells, 4)
    b1, b2 = stratified_points(numbers, CELL_DIVISIONS)
    covered = verdict == COVERED
    row, cell = np.nonzero(verdict == UNKNOWN)
    shifts = numbers[row, cell, 2:]
    covered[row, cell] = vote_covered(ray_scene, patches, chosen[row], (b1[row, cell], b2[row, cell]), shifts)
    return covered | lie_in_earth(ray_scene, patches, points_of_patches(patches, chosen, b1, b2))


def vote_covered(ray_scene, patches, chosen, places, shifts, *, rays=RAYS_PER_CELL, stray=STRAY_RAYS):
    """The vote of the rays around one point of each of some patches, whether it lies inside or under something.

    Parameters
    ----------
    chosen : (k,) int
    places : tuple of (k,) and (k,) float32
        Barycentric weights of the points.
    shifts : (k, 2) float32
        Random numbers.
    rays : int
        That vote.
    stray : int
        Of them that may find a hole to the sky from the inside of an open shell.

    Returns
    -------
    (k,) bool
    """
    around = additive_recurrence(rays, 2)
    u, v = (shifted(around[:, axis], shifts[:, axis]) for axis in (0, 1))
    b1, b2 = (np.repeat(weights[:, None], rays, axis=1) for weights in places)
    origins, directions = rays_from_patches(patches, chosen, b1, b2, cosine_direction(u, v))
    hit = ray_scene.trace_closest(origins.reshape(-1, 3), directions.reshape(-1, 3)).reshape(u.shape)
    back = meets_back(patches, hit, directions)
    upwards = directions[..., 2] > 0
    met = (back, (hit < 0) & upwards, (hit < 0) & ~upwards)
    back, sky, below = (which.sum(axis=1) for which in met)
    inside = (2 * back > rays) & (sky <= stray)
    under = (4 * back > rays) & (back + below == rays)
    return inside | under


def lie_in_earth(ray_scene, patches, points):
    """Whether the first thing straight above some points is the ground, seen from below.

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
    return ((above >= 0) & patches.ground[above] & (patches.normal[above, 2] > 0)).reshape(points.shape[:2])


def enclosed_cells(covered):
    """Covered cells all around which the patch is covered too.

    Parameters
    ----------
    covered : (c, cells) bool

    Returns
    -------
    (c, cells) bool
    """
    enclosed = np.zeros(covered.shape, bool)
    mark_enclosed(covered, cell_contacts(round(np.sqrt(covered.shape[1]))), enclosed)
    return enclosed


@njit(nogil=True, cache=True)
def mark_enclosed(covered, contacts, enclosed):
    """Set cells in `enclosed`, (c, cells) bool, that are covered as all are that touch them.

    A product of matrices would tell it too, but wake the threads of a library that then compete with the tracer's.
    """
    for patch in range(len(covered)):
        for cell in range(covered.shape[1]):
            if covered[patch, cell]:
                alone = False
                for other in range(covered.shape[1]):
                    alone |= contacts[cell, other] and not covered[patch, other]
                enclosed[patch, cell] = not alone
