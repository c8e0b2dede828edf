"""Covered share of each surface (inside or under something), without tracing anything else."""

import numpy as np

from ..patches.facing_scene import FacingScene
from ..patches.find_covered import RAYS_PER_CELL, find_covered_cells
from ..patches.patches import patches_of_scene
from ..progress import silent
from ..sampling.hemisphere_rays import CELL_DIVISIONS
from ..sampling.sample_points import HEMISPHERE_REPLICATES
from ..scene.add_backs import add_backs
from ..threads import map_in_order, usable_threads
from ..transfer.surface_means import area_means, cover_of_surfaces
from .trace_hemisphere import RAYS_PER_TASK, trace_hemisphere

COVER_STAGE = "finding interior surfaces"
RAYS = 8 * HEMISPHERE_REPLICATES  # per patch; if one hits a back, the cells of the patch are examined


def measure_cover(scene, threads=None, progress=silent):
    """Covered share of each surface.

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
    chosen = patches.receives & (scene.triangle_surface >= 0)
    covered_share = measure_patches(ray_scene, patches, chosen, threads, progress)
    return cover_of_surfaces(area_means(scene.triangle_surface, patches.area, len(scene.surfaces)), covered_share)


def measure_patches(ray_scene, patches, chosen, threads, progress=silent):
    """Covered share of the chosen patches: (p,) float32; 0 for the others, 1 for those that receive nothing."""
    hemisphere = trace_hemisphere(
        ray_scene,
        patches,
        chosen,
        sample_count=RAYS,
        reflections=False,
        threads=threads,
        progress=lambda _, done, total, unit: progress(COVER_STAGE, done, total, unit),
    )
    return np.where(patches.receives, hemisphere.covered_share, np.float32(1))


def find_cover(ray_scene, patches, threads):
    """Covered share of each patch, and which of its cells are covered.

    Returns
    -------
    covered_share : (p,) float32
    covered : (p, CELL_DIVISIONS²) bool
    """
    covered_share = measure_patches(ray_scene, patches, patches.receives, threads)
    covered = np.zeros((len(patches), CELL_DIVISIONS**2), bool)
    rows = np.flatnonzero((covered_share > 0) & patches.receives)
    step = max(1, RAYS_PER_TASK // (RAYS_PER_CELL * CELL_DIVISIONS**2))
    tasks = [rows[start : start + step] for start in range(0, len(rows), step)]

    def find_rows(chosen):
        return find_covered_cells(ray_scene, patches, chosen)

    for chosen, cells in zip(tasks, map_in_order(find_rows, tasks, threads), strict=True):
        covered[chosen] = cells
    return covered_share, covered
