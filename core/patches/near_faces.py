"""Which cells of patches have a face close in front of them: a ray from each goes straight
ahead.
"""

import numpy as np

from ..rays.hemisphere_rays import CELL_DIVISIONS
from .cover_cells import pack_cells
from .find_covered import UPRIGHT, starts_in_cells


def cells_near_faces(ray_scene, patches, chosen, clearances):
    """Which cells of some patches look at a face from less than each clearance.

    Parameters
    ----------
    ray_scene : FacingScene
    patches : Patches
    chosen : (c,) int
    clearances : sequence of k float [m]

    Returns
    -------
    (c, k) uint64
        As of `pack_cells`.
    """
    if ray_scene.whole is not None:
        ray_scene, patches, rows = ray_scene.whole
        chosen = rows[chosen]

    def measure(some, cells):
        b1, b2, _ = starts_in_cells(patches.place_key[some], cells)
        origins = patches.points(some, b1, b2).reshape(-1, 3)
        own = np.repeat(some, len(cells))
        hits = ray_scene.trace_places(origins, patches.normal[own])
        return patches.facing_distance(own, hits).reshape(b1.shape)

    looks_at_face = np.zeros((len(chosen), len(clearances), CELL_DIVISIONS**2), bool)
    # Some cells tell which patches have anything near; of these all cells are measured, straight
    # ahead.
    near = np.flatnonzero((measure(chosen, UPRIGHT) < max(clearances)).any(axis=1))
    distance = measure(chosen[near], np.arange(CELL_DIVISIONS**2))
    looks_at_face[near] = distance[:, None] < np.float32(clearances)[:, None]
    return pack_cells(looks_at_face)
