"""Rays that end in the crown of a tree before what they hit."""

import numpy as np


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
