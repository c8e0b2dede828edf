"""What all stages of the gather estimator share."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from ..city.scene import Surfaces
from ..effects.plan_effects import EffectPlan
from ..patches.facing_scene import FacingScene
from ..patches.patches import Patches
from ..patches.read_albedo import brdfs_of_triangles
from ..settings.request import Request
from ..settings.threads import usable_threads
from ..transfer.surface_means import area_means


@dataclass
class GatherContext:
    """What all stages of one run share."""

    ray_scene: FacingScene
    patches: Patches  # with the albedo of diffuse reflection only
    plan: TracePlan
    request: Request
    surfaces: Surfaces
    owner: np.ndarray  # (p,) int, surface of each patch; -1: generated ground
    merge: sparse.csr_matrix  # (n, p), averages patches over their surface
    eligible_area: np.ndarray  # (n,) float64 [m²], 0 for surfaces that are not eligible
    threads: int
    progress: Callable
    rounds: bool = False  # whether further ones go on from what this one finds


def prepare_gather(prepared, request, progress):
    """What the stages of a run share.

    Parameters
    ----------
    prepared : PreparedScene
    request : Request
    progress : callable
        See `core.progress`.

    Returns
    -------
    GatherContext
    """
    scene, patches = prepared.scene, prepared.patches
    others = brdfs_of_triangles(scene, request, prepared.materials).index >= 0  # they reflect, but not by Lambert's law
    if others.any():
        patches = replace(patches, albedo=np.where(others, np.float32(0), patches.albedo))
    threads = usable_threads(request.threads)
    ray_scene = prepared.plan.ray_scene or FacingScene(scene, patches, threads)
    ray_scene.canopy = prepared.canopy_of_seasons()
    return GatherContext(
        ray_scene=ray_scene,
        patches=patches,
        plan=prepared.plan,
        request=request,
        surfaces=scene.surfaces,
        owner=scene.triangle_surface,
        merge=area_means(scene.triangle_surface, patches.area, len(scene.surfaces)),
        eligible_area=np.where(scene.surfaces.eligible, scene.surfaces.area, 0.0),
        threads=threads,
        progress=progress,
        rounds=prepared.round is not None,
    )
