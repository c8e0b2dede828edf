"""The gather estimator: from rays and matrix to the irradiance of surfaces."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy import sparse

from ..request import Request
from .form_factors import multiply_cells, multiply_seen
from .kept_matrix import MatrixOnDisk, keep_matrix
from .patches import Patches
from .plan_effects import EffectPlan
from .ray_scene import RayScene
from .reflect import radiosity_factor, reflect, variance_of_replicates
from .surface_means import average_surfaces
from .trace_suns import projection_in_front, trace_suns, variance_of_cell_pairs

BYTES_PER_BLOCK = 100e6  # of one array (patches × suns); some six of them live at a time


@dataclass
class Tracing:
    """What all stages of one run share."""

    ray_scene: RayScene
    patches: Patches
    plan: EffectPlan
    request: Request
    merge: sparse.csr_matrix  # (n, p), averages patches over their surface
    threads: int
    progress: Callable


@dataclass
class Diffuse:
    """Under the isotropic sky, per DHI."""

    mean: np.ndarray  # (n,)
    standard_error: np.ndarray  # (n,)
    last: float  # share of the last bounce in all light


@dataclass
class Direct:
    """Under each sun, per DNI."""

    visible_share: np.ndarray | MatrixOnDisk  # (n, s) float32
    reflected: np.ndarray | MatrixOnDisk  # (n, s) float32, without what the far ground reflects at first bounce
    standard_error: np.ndarray  # (n,) of the mean weighted with the suns' weights; NaN where one point tells no spread
    last: float  # share of the last bounce in all light
    ray_count: int


def gather_diffuse(tracing, hemisphere):
    """Relative irradiance of the surfaces under the isotropic sky.

    Parameters
    ----------
    tracing : Tracing
    hemisphere : Hemisphere

    Returns
    -------
    Diffuse
    """
    plan, merge = tracing.plan, tracing.merge
    first = hemisphere.sky.mean(axis=1, keepdims=True)
    by_replicate = hemisphere.sky.copy()
    last = 0.0
    if plan.reflections:
        far_first = tracing.request.ground_albedo * hemisphere.far_ground
        light = tracing.patches.albedo[:, None] * hemisphere.sky_of_cells
        _, handed_on, last = reflect(
            hemisphere.form_factors,
            radiosity_factor(tracing.patches, hemisphere.covered_share),
            first,
            far_first.mean(axis=1, keepdims=True),
            plan.max_bounces,
            arriving=multiply_cells(hemisphere.form_factors, light, tracing.threads).mean(axis=1, keepdims=True),
            threads=tracing.threads,
        )
        by_replicate += far_first + multiply_cells(hemisphere.form_factors, light + handed_on[:, None], tracing.threads)
    return Diffuse(
        mean=merge @ by_replicate.mean(axis=1, dtype=float),
        standard_error=np.sqrt(merge.power(2) @ variance_of_replicates(by_replicate)),
        last=last,
    )


def gather_direct(tracing, hemisphere, suns, folder=None):
    """Visible share and reflected irradiance of the surfaces for every sun, block by block of suns.

    Parameters
    ----------
    tracing : Tracing
    hemisphere : Hemisphere
    suns : Suns
    folder : path-like, optional
        As of `keep_matrix`.

    Returns
    -------
    Direct
    """
    merge, patches = tracing.merge, tracing.patches
    point_count = points_above(tracing.request.shadow_samples)
    found = Direct(
        visible_share=keep_matrix((merge.shape[0], len(suns)), folder),
        reflected=keep_matrix((merge.shape[0], len(suns)), folder),
        standard_error=np.zeros(merge.shape[0]),
        last=0.0,
        ray_count=0,
    )
    annual_by_point = np.zeros((len(patches), point_count), np.float32)
    annual_handed_on = np.zeros(len(patches), np.float32)
    step = max(1, int(BYTES_PER_BLOCK / 4 / max(len(patches), 1)))
    for start in range(0, len(suns), step):
        block = slice(start, min(start + step, len(suns)))
        part = suns.direction[block].astype(np.float32), suns.weight[block].astype(np.float32)
        report = partial(report_suns, tracing, (start, block.stop, len(suns)), found.ray_count)
        light = look_at_block(tracing, hemisphere, part, report)
        found.visible_share[:, block] = average_surfaces(merge, light.visible_share, tracing.threads)
        found.ray_count += light.ray_count
        annual_by_point += light.by_point
        if tracing.plan.reflections:
            reflected, handed_on, last = reflect_block(tracing, hemisphere, light, part)
            found.reflected[:, block] = average_surfaces(merge, reflected, tracing.threads)
            found.last = max(found.last, last)
            annual_handed_on += handed_on
    variance = variance_of_cell_pairs(annual_by_point)
    variance[~send_shadow_rays(tracing, hemisphere)] = 0  # known exactly, even where one point tells no spread
    if tracing.plan.reflections and len(suns):
        annual_of_cells = np.take_along_axis(annual_by_point, light.speakers, axis=1)
        handed_on = patches.albedo[:, None] * annual_of_cells + annual_handed_on[:, None]
        by_replicate = multiply_cells(hemisphere.form_factors, handed_on, tracing.threads)
        variance = variance + variance_of_replicates(by_replicate)
    found.standard_error = np.sqrt(merge.power(2) @ variance)
    return found


def report_suns(tracing, block, rays_before, share, rays):
    """Tell how far a block of suns, from first to last of all, is done."""
    first, last, count = block
    share, rays = (first + share * (last - first)) / count, rays + rays_before
    tracing.progress("suns", rays, rays if share == 1 else rays / share, "rays")


def send_shadow_rays(tracing, hemisphere):
    """Patches whose visible share of a sun is found by shadow rays: (p,) bool."""
    return ~tracing.plan.closed & tracing.patches.receives & ~hemisphere.enclosed.all(axis=1)


def look_at_block(tracing, hemisphere, suns, report):
    """First light of one block of suns.

    Parameters
    ----------
    suns : tuple of (b, 3) float32 and (b,) float32
        Directions and weights.
    report : callable
        Called with the share done and the rays traced.

    Returns
    -------
    SunLight
    """
    patches, plan = tracing.patches, tracing.plan
    return trace_suns(
        tracing.ray_scene,
        patches,
        send_shadow_rays(tracing, hemisphere),
        plan.closed & patches.receives,
        (hemisphere.covered, hemisphere.enclosed),
        point_count=points_above(tracing.request.shadow_samples),
        suns=suns,
        behind=plan.suns_behind,
        threads=tracing.threads,
        progress=report,
    )


def reflect_block(tracing, hemisphere, light, suns):
    """Reflections of one block of suns, without what the far ground reflects at first bounce.

    Parameters
    ----------
    light : SunLight
        Of the b suns of the block.
    suns : tuple of (b, 3) float32 and (b,) float32
        Directions and weights.

    Returns
    -------
    reflected : (p, b) float32
    handed_on : (p,) float32
        As of `reflect`, with the suns' weights.
    last : float
    """
    directions, weights = suns
    form_factors, threads = hemisphere.form_factors, tracing.threads
    far_first = None
    if tracing.plan.far_ground:
        lit_ground = np.maximum(directions[:, 2], 0) * np.float32(tracing.request.ground_albedo)
        far_first = np.outer(hemisphere.far_ground.mean(axis=1), lit_ground)
    aoi_projection = projection_in_front(tracing.patches.normal, directions)
    arriving = multiply_seen(form_factors, tracing.patches.albedo, aoi_projection, light.seen, threads)
    reflected, handed_on, last = reflect(
        form_factors,
        radiosity_factor(tracing.patches, hemisphere.covered_share),
        light.first,
        far_first,
        tracing.plan.max_bounces,
        arriving=arriving,
        weight=weights,
        threads=threads,
    )
    if far_first is not None:
        reflected -= far_first
        np.maximum(reflected, 0, out=reflected)
    return reflected, handed_on, last


def points_above(count):
    """The smallest number not below `count` of points that stand in cells of cells: 1, 4, 16, 64, 144, 256 …"""
    side = int(np.ceil(np.sqrt(count)))
    return (side if side <= 2 else -(-side // 4) * 4) ** 2
