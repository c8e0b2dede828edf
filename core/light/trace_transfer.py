"""From a scene and its suns to the Transfer: the gather estimator."""

import time
from dataclasses import asdict

import numpy as np

from ..request import check_request
from ..sun.check_suns import check_suns
from ..sun.keep_suns import keep_suns
from .check_arrays import check_scene
from .closed_form import ground_view_of_tilt, sky_view_of_tilt
from .gather_diffuse import gather_diffuse
from .gather_direct import gather_direct
from .read_albedo import finishes_of_surfaces
from .reflect import factor_of_cells
from .sample_points import REPLICATES
from .shadow_points import cells_of_light, points_above
from .trace_hemisphere import trace_hemisphere
from .tracing import begin_tracing
from .transfer import Transfer

ONE_POINT = "of direct light: one shadow point per patch tells no spread; ask for --shadow-samples 2 or more"


def trace_transfer(scene, suns, request, progress, folder=None):
    """Trace a scene.

    Parameters
    ----------
    scene : Scene
    suns : Suns
    request : Request
    progress : callable
        See `core.progress`.
    folder : path-like, optional
        Where matrices of surfaces × suns lie that are too large for the memory.

    Returns
    -------
    Transfer
        Its `settings` say what was decided, how many rays were traced and how long each stage took. Whoever cancels
        after some suns (see `core.progress`) gets those that were traced as `suns`, and is told so by `interrupted`.

    Raises
    ------
    CancelledError
        It was cancelled before any sun was of use.
    InputError
        If a number, an array or a setting cannot be used: no ray is traced with it.
    """
    check_scene(scene)
    check_suns(suns)
    check_request(request)
    clock = Clock()
    finishes = finishes_of_surfaces(scene, request)
    tracing = begin_tracing(scene, request, progress)
    patches, plan, merge, ray_scene = tracing.patches, tracing.plan, tracing.merge, tracing.ray_scene
    clock.lap("plan and tree")

    hemisphere = look_around(tracing, cells_of_light(points_above(request.shadow_samples)))
    clock.lap("sky and reflections")

    diffuse = gather_diffuse(tracing, hemisphere)
    hemisphere.sky_of_cells = None  # of no more use, and large
    clock.lap("diffuse reflections")
    direct = gather_direct(tracing, hemisphere, suns, folder)
    clock.lap("suns")
    return Transfer(
        surfaces=scene.surfaces,
        site=scene.site,
        suns=suns if direct.kept == len(suns) else keep_suns(suns, direct.kept),
        covered_share=merge @ hemisphere.covered_share,
        sky_view_factor=merge @ hemisphere.sky.mean(axis=1),
        far_ground_view_factor=merge @ hemisphere.far_ground.mean(axis=1),
        ground_albedo=request.ground_albedo if plan.far_ground else 0.0,
        diffuse_relative=diffuse.mean,
        diffuse_relative_standard_error=diffuse.standard_error,
        visible_share=direct.visible_share,
        direct_reflected=direct.reflected,
        direct_annual_standard_error=direct.standard_error,
        settings={
            "request": request.as_dict(),
            "effects": [asdict(effect) for effect in plan.effects],
            "max_bounces": plan.max_bounces,
            "brightest_albedo": max(float(patches.albedo.max(initial=0)), request.ground_albedo),
            "patches": len(patches),
            "threads": tracing.threads,
            "engine": ray_scene.engine,
            "hemisphere_rays": hemisphere.ray_count,
            "shadow_rays": direct.ray_count,
            "seconds": clock.seconds,
            "embree_thread_seconds": ray_scene.thread_seconds,
            "last_bounce_share_diffuse": diffuse.last,
            "last_bounce_share_direct": direct.last,
            "change_by_even_patches": {"diffuse": diffuse.evened, "direct": direct.evened},
            "degrees_of_freedom": {"diffuse": REPLICATES - 1, "direct_reflected": REPLICATES - 1},
            **tell_interruption(direct.kept, len(suns)),
            **({"standard_error_unknown": ONE_POINT} if np.isnan(direct.standard_error).any() else {}),
        },
        **finishes,
    )


def tell_interruption(kept, count):
    """What the settings say where fewer suns were kept than asked for."""
    return {"interrupted": {"suns_traced": kept, "of": count}} if kept < count else {}


class Clock:
    """Seconds per stage."""

    def __init__(self):
        self.seconds, self.last = {}, time.perf_counter()

    def lap(self, stage):
        """Note the seconds since the last lap."""
        now = time.perf_counter()
        self.seconds[stage], self.last = now - self.last, now


def look_around(tracing, cells):
    """What all patches see of sky, far ground and each other.

    Parameters
    ----------
    tracing : Tracing
    cells : int
        1, 4 or 16: into how many cells the light of a patch is resolved.

    Returns
    -------
    Hemisphere
    """
    patches, plan = tracing.patches, tracing.plan
    hemisphere = trace_hemisphere(
        tracing.ray_scene,
        patches,
        ~plan.closed & patches.receives,
        sample_count=-(-tracing.request.samples // REPLICATES) * REPLICATES,
        reflections=plan.reflections,
        threads=tracing.threads,
        progress=tracing.progress,
        cells=cells,
    )
    fill_closed_forms(hemisphere, patches, plan)
    if plan.reflections:
        hemisphere.factor = factor_of_cells(tracing, hemisphere)
    hemisphere.far_of_cells = hemisphere.open_share = None  # of no more use, and large
    return hemisphere


def fill_closed_forms(hemisphere, patches, plan):
    """Put in what is known without rays, and take out what the plan leaves out."""
    known = plan.closed & patches.receives
    hemisphere.sky[known] = sky_view_of_tilt(patches.normal[known])[:, None]
    hemisphere.far_ground[known] = ground_view_of_tilt(patches.normal[known])[:, None]
    hemisphere.far_of_cells[known] = hemisphere.far_ground[known, :1] / hemisphere.far_of_cells.shape[1]
    hemisphere.sky_of_cells[known] = hemisphere.sky[known, :1]
    hemisphere.covered[~patches.receives] = True
    if not plan.far_ground:
        hemisphere.far_ground[:] = hemisphere.far_of_cells[:] = 0
