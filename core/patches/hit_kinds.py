"""Fates of rays: what each of them reaches, or whether it ends in a crown before."""

import numpy as np
from numba import njit

SKY, FAR_GROUND, FRONT, LEAVES, BACK, DARK = range(6)  # fate of a ray; the last three carry nothing


@njit(nogil=True, cache=True)
def classify_rays(hit, directions, facing, fate):
    """Write the fate of each ray into the last argument.

    Parameters
    ----------
    hit : (c, rays) int32
    directions : (3, c, rays) float32
    facing : (p, 4) float32
    fate : (c, rays) uint8
    """
    for patch in range(len(hit)):
        for ray in range(hit.shape[1]):
            met = hit[patch, ray]
            x, y, z = (
                directions[0, patch, ray],
                directions[1, patch, ray],
                directions[2, patch, ray],
            )
            if met < 0:
                fate[patch, ray] = SKY if z > 0 else FAR_GROUND
                continue
            along = x * facing[met, 0] + y * facing[met, 1] + z * facing[met, 2] + facing[met, 3]
            fate[patch, ray] = BACK if along > 0 else FRONT


def stop_in_crowns(ray_scene, patches, rays, places, wanted):
    """Rays stopped by the leaves or the trunks between their origin and what they hit.

    Parameters
    ----------
    ray_scene : FacingScene
        With a canopy.
    patches : Patches
    rays : tuple of (c, r, 3) float32 and (c, r, 3) float32
        Origins and unit directions, in rows whose random numbers are evenly spread.
    places : HitPlaces
        (c, r), what the rays hit.
    wanted : (c, r) bool
        Rays in question.

    Returns
    -------
    (states, c, r) bool
    """
    stopped = np.zeros((ray_scene.canopy.states, *wanted.shape), bool)
    rows = np.flatnonzero(wanted.any(axis=1))
    if len(rows):
        origins, directions = (part[rows] for part in rays)
        reach = _measure_reach(patches, origins, directions, places.take(rows))
        stopped[:, rows] = ray_scene.canopy.stop_rays(origins, directions, reach) & wanted[rows]
    return stopped


def _measure_reach(patches, origins, directions, places):
    """Distance from origins to hits, (c, r) float64 [m]; practically infinite where nothing
    is hit.
    """
    hit, b1, b2 = places
    reach = np.full(hit.shape, 1e30)
    row, ray = np.nonzero(hit >= 0)
    met = hit[row, ray]
    weights = np.stack([b1[row, ray], b2[row, ray]], axis=1)[:, :, None]
    place = patches.corner[met].astype(float) + (weights * patches.edges[met]).sum(axis=1)
    reach[row, ray] = np.einsum("ki,ki->k", place - origins[row, ray], directions[row, ray])
    return reach
