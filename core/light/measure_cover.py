"""Which parts of surfaces lie inside or under something, without tracing anything else."""

import numpy as np

from ..city.scene import add_backs
from ..patches.facing_scene import FacingScene
from ..patches.find_covered import find_covered_cells
from ..patches.patches import patches_of_scene
from ..rays.hemisphere_rays import CELL_DIVISIONS
from ..settings.progress import silent
from ..settings.threads import map_in_order, usable_threads
from .kept_matrix import area_means, cover_of_surfaces

COVER_STAGE = "finding interior surfaces"
PATCHES_PER_TASK = 1 << 12


def measure_cover(scene, threads=None, progress=silent):
    """Covered share of each surface, that of a run with the same patches.

    Parameters
    ----------
    scene : Scene
    threads : int, optional
    progress : callable, optional
        See `core.progress`.

    Returns
    -------
    (n,) float64
    """
    scene = add_backs(scene)
    patches = patches_of_scene(scene, np.zeros(len(scene.triangles)), seed=0)
    threads = usable_threads(threads)
    ray_scene = FacingScene(scene, patches, threads)
    covered = find_cover(ray_scene, patches, patches.receives & (scene.triangle_surface >= 0), threads, progress)
    means = area_means(scene.triangle_surface, patches.area, len(scene.surfaces))
    return cover_of_surfaces(means, covered.mean(axis=1, dtype=np.float32))


def find_cover(ray_scene, patches, wanted, threads, progress=silent):
    """Which cells of patches are covered: those of a run of either estimator, whatever its seed and samples.

    Parameters
    ----------
    wanted : (p,) bool
        Patches whose cells are examined.

    Returns
    -------
    (p, CELL_DIVISIONS²) bool
        False for patches that receive light and are not wanted; True for those that receive none.
    """
    covered = np.zeros((len(patches), CELL_DIVISIONS**2), bool)
    covered[~patches.receives] = True
    rows = np.flatnonzero(wanted & patches.receives)
    tasks, done = [rows[start : start + PATCHES_PER_TASK] for start in range(0, len(rows), PATCHES_PER_TASK)], 0
    found = map_in_order(lambda chosen: find_covered_cells(ray_scene, patches, chosen), tasks, threads)
    if tasks:
        progress(COVER_STAGE, done, len(rows), "patches")
    for chosen, cells in zip(tasks, found, strict=True):
        covered[chosen] = cells
        done += len(chosen)
        progress(COVER_STAGE, done, len(rows), "patches")
    return covered
