"""Which share of each surface lies inside or under something, without tracing anything else."""

import numpy as np

from ..progress import silent
from .patches import patches_of_scene
from .ray_scene import RayScene, usable_threads
from .sample_points import REPLICATES
from .trace_hemisphere import trace_hemisphere
from .trace_transfer import area_means

RAYS = 8 * REPLICATES  # per patch; one that meets a back has the patch looked at in cells


def measure_cover(scene, threads=None):
    """Covered share of each surface.

    Parameters
    ----------
    scene : Scene
    threads : int, optional

    Returns
    -------
    (n,) float64
    """
    patches = patches_of_scene(scene, np.zeros(len(scene.triangles)), seed=0)
    hemisphere = trace_hemisphere(
        RayScene(scene.vertices, scene.triangles),
        patches,
        patches.receives & (scene.triangle_surface >= 0),
        sample_count=RAYS,
        reflections=False,
        threads=usable_threads(threads),
        progress=silent,
    )
    hemisphere.covered_share[~patches.receives] = 1
    return area_means(scene.triangle_surface, patches.area, len(scene.surfaces)) @ hemisphere.covered_share
