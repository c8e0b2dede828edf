"""From a scene and its suns to the Transfer: the gather estimator."""

import time
from dataclasses import asdict

import numpy as np
from scipy import sparse

from .closed_form import ground_view_of_tilt, sky_view_of_tilt
from .patches import patches_of_scene
from .plan_effects import plan_effects
from .ray_scene import RayScene, usable_threads
from .read_albedo import albedo_of_triangles
from .reflect import radiosity_factor, reflect, replicates_of, variance_of_replicates
from .sample_points import REPLICATES
from .trace_hemisphere import trace_hemisphere
from .trace_suns import trace_suns, variance_of_cell_pairs
from .transfer import Transfer

BYTES_PER_BLOCK = 100e6  # of one array (patches × suns); some six of them live at a time


def trace_transfer(scene, suns, request, progress):
    """Trace a scene.

    Parameters
    ----------
    scene : Scene
    suns : Suns
    request : Request
    progress : callable
        See `core.progress`.

    Returns
    -------
    Transfer
        Its `settings` say what was decided, how many rays were traced and how long each stage took.
    """
    clock = Clock()
    threads = usable_threads(request.threads)
    patches = patches_of_scene(scene, albedo_of_triangles(scene, request), request.seed)
    plan = plan_effects(scene, patches, request)
    ray_scene = RayScene(scene.vertices, scene.triangles)
    clock.lap("plan and tree")

    samples = -(-request.samples // REPLICATES) * REPLICATES
    traced = ~plan.closed & patches.receives
    hemisphere = trace_hemisphere(ray_scene, patches, traced, samples, plan.reflections, threads, progress)
    fill_closed_forms(hemisphere, patches, plan)
    clock.lap("sky and reflections")

    merge = area_means(scene.triangle_surface, patches.area, len(scene.surfaces))
    diffuse = gather_diffuse(hemisphere, patches, plan, request.ground_albedo, merge)
    direct = gather_direct(ray_scene, hemisphere, patches, plan, suns, request, merge, threads, progress)
    clock.lap("suns")
    return Transfer(
        surfaces=scene.surfaces,
        site=scene.site,
        suns=suns,
        covered_share=merge @ hemisphere.covered_share,
        sky_view_factor=merge @ hemisphere.sky.mean(axis=1),
        far_ground_view_factor=merge @ hemisphere.far_ground.mean(axis=1),
        ground_albedo=request.ground_albedo if plan.far_ground else 0.0,
        diffuse_relative=diffuse["mean"],
        diffuse_relative_standard_error=diffuse["standard_error"],
        visible_share=direct["visible_share"],
        direct_reflected=direct["reflected"],
        direct_annual_standard_error=direct["standard_error"],
        settings={
            "request": request.as_dict(),
            "effects": [asdict(effect) for effect in plan.effects],
            "max_bounces": plan.max_bounces,
            "brightest_albedo": max(float(patches.albedo.max(initial=0)), request.ground_albedo),
            "patches": len(patches),
            "threads": threads,
            "hemisphere_rays": hemisphere.ray_count,
            "shadow_rays": direct["ray_count"],
            "seconds": clock.seconds,
            "last_bounce_share_diffuse": diffuse["last"],
            "last_bounce_share_direct": direct["last"],
        },
    )


class Clock:
    """Seconds per stage."""

    def __init__(self):
        self.seconds, self.last = {}, time.perf_counter()

    def lap(self, stage):
        """Note the seconds since the last lap."""
        now = time.perf_counter()
        self.seconds[stage], self.last = now - self.last, now


def fill_closed_forms(hemisphere, patches, plan):
    """Put in what is known without rays, and take out what the plan leaves out."""
    known = plan.closed & patches.receives
    hemisphere.sky[known] = sky_view_of_tilt(patches.normal[known])[:, None]
    hemisphere.far_ground[known] = ground_view_of_tilt(patches.normal[known])[:, None]
    if not plan.far_ground:
        hemisphere.far_ground[:] = 0


def area_means(triangle_surface, area, count):
    """Matrix that averages patches over their surface: (count, p) sparse float64."""
    own = np.flatnonzero(triangle_surface >= 0)
    surface = triangle_surface[own]
    whole = np.bincount(surface, weights=area[own], minlength=count)
    return sparse.csr_matrix((area[own] / whole[surface], (surface, own)), shape=(count, len(area)))


def gather_diffuse(hemisphere, patches, plan, ground_albedo, merge):
    """Relative diffuse irradiance of the surfaces under the isotropic sky."""
    first = hemisphere.sky.mean(axis=1, keepdims=True)
    by_replicate = hemisphere.sky.copy()
    last = 0.0
    if plan.reflections:
        far_first = ground_albedo * hemisphere.far_ground
        factor = radiosity_factor(patches, hemisphere.covered_share)
        _, gathered, last = reflect(
            hemisphere.form_factors, factor, first, far_first.mean(axis=1, keepdims=True), plan.max_bounces
        )
        by_replicate += far_first + replicates_of(hemisphere.form_factors, gathered)
    return {
        "mean": merge @ by_replicate.mean(axis=1, dtype=float),
        "standard_error": np.sqrt(merge.power(2) @ variance_of_replicates(by_replicate)),
        "last": last,
    }


def gather_direct(ray_scene, hemisphere, patches, plan, suns, request, merge, threads, progress):
    """Visible share and reflected irradiance of the surfaces for every sun, block by block of suns."""
    factor = radiosity_factor(patches, hemisphere.covered_share)
    far_view = hemisphere.far_ground.mean(axis=1)
    surface_far_view = merge @ far_view
    closed = plan.closed & patches.receives
    traced = ~plan.closed & patches.receives & ~hemisphere.enclosed.all(axis=1)
    point_count = square_above(request.shadow_samples)
    visible_share = np.zeros((merge.shape[0], len(suns)), np.float32)
    reflected = np.zeros_like(visible_share)
    annual_by_point = np.zeros((len(patches), point_count), np.float32)
    annual_gathered = np.zeros(len(patches), np.float32)
    ray_count, last = 0, 0.0
    step = max(1, int(BYTES_PER_BLOCK / 4 / max(len(patches), 1)))
    for start in range(0, len(suns), step):
        block = slice(start, min(start + step, len(suns)))
        directions, weights = suns.direction[block].astype(np.float32), suns.weight[block].astype(np.float32)

        def report(share, rays, block=block, before=ray_count):
            share = (block.start + share * (block.stop - block.start)) / len(suns)
            progress("suns", before + rays, (before + rays) / share, "rays")

        light = trace_suns(
            ray_scene,
            patches,
            traced,
            closed,
            hemisphere.enclosed,
            point_count,
            (directions, weights),
            plan.suns_behind,
            threads,
            report,
        )
        visible_share[:, block] = merge @ light.visible_share
        annual_by_point += light.by_point
        ray_count += light.ray_count
        if plan.reflections:
            horizontal = np.maximum(suns.direction[block, 2], 0) * request.ground_albedo
            far_first = np.outer(far_view, horizontal).astype(np.float32)
            indirect, gathered, share = reflect(
                hemisphere.form_factors, factor, light.first, far_first, plan.max_bounces
            )
            reflected[:, block] = merge @ indirect - np.outer(surface_far_view, horizontal)
            annual_gathered += gathered @ weights
            last = max(last, share)
    variance = variance_of_cell_pairs(annual_by_point)
    if plan.reflections:
        variance = variance + variance_of_replicates(replicates_of(hemisphere.form_factors, annual_gathered))
    return {
        "visible_share": visible_share,
        "reflected": np.maximum(reflected, 0),  # rounding
        "standard_error": np.sqrt(merge.power(2) @ variance),
        "ray_count": ray_count,
        "last": last,
    }


def square_above(count):
    """The smallest square number not below `count`: points stand in the congruent sub-triangles of a patch."""
    return int(np.ceil(np.sqrt(count))) ** 2
