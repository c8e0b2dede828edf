"""The gather estimator: from rays and matrix to the irradiance of surfaces."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..request import Request
from .patches import Patches
from .plan_effects import EffectPlan
from .ray_scene import RayScene
from .reflect import radiosity_factor, reflect, replicates_of, variance_of_replicates
from .trace_suns import trace_suns, variance_of_cell_pairs

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

    visible_share: np.ndarray  # (n, s) float32
    reflected: np.ndarray  # (n, s) float32, without what the far ground reflects at first bounce
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
        factor = radiosity_factor(tracing.patches, hemisphere.covered_share)
        far_mean = far_first.mean(axis=1, keepdims=True)
        _, gathered, last = reflect(hemisphere.form_factors, factor, first, far_mean, plan.max_bounces)
        by_replicate += far_first + replicates_of(hemisphere.form_factors, gathered)
    return Diffuse(
        mean=merge @ by_replicate.mean(axis=1, dtype=float),
        standard_error=np.sqrt(merge.power(2) @ variance_of_replicates(by_replicate)),
        last=last,
    )


def gather_direct(tracing, hemisphere, suns):
    """Visible share and reflected irradiance of the surfaces for every sun, block by block of suns.

    Parameters
    ----------
    tracing : Tracing
    hemisphere : Hemisphere
    suns : Suns

    Returns
    -------
    Direct
    """
    merge, patches = tracing.merge, tracing.patches
    point_count = square_above(tracing.request.shadow_samples)
    found = Direct(
        visible_share=np.zeros((merge.shape[0], len(suns)), np.float32),
        reflected=np.zeros((merge.shape[0], len(suns)), np.float32),
        standard_error=np.zeros(merge.shape[0]),
        last=0.0,
        ray_count=0,
    )
    annual_by_point = np.zeros((len(patches), point_count), np.float32)
    annual_gathered = np.zeros(len(patches), np.float32)
    step = max(1, int(BYTES_PER_BLOCK / 4 / max(len(patches), 1)))
    for start in range(0, len(suns), step):
        block = slice(start, min(start + step, len(suns)))
        light = look_at_block(tracing, hemisphere, suns, block, found.ray_count)
        found.visible_share[:, block] = merge @ light.visible_share
        found.ray_count += light.ray_count
        annual_by_point += light.by_point
        if tracing.plan.reflections:
            reflected, gathered, last = reflect_block(tracing, hemisphere, light.first, suns.direction[block, 2])
            found.reflected[:, block] = merge @ reflected
            found.last = max(found.last, last)
            annual_gathered += gathered @ suns.weight[block].astype(np.float32)
    variance = variance_of_cell_pairs(annual_by_point)
    variance[~send_shadow_rays(tracing, hemisphere)] = 0  # known exactly, even where one point tells no spread
    if tracing.plan.reflections:
        variance = variance + variance_of_replicates(replicates_of(hemisphere.form_factors, annual_gathered))
    found.standard_error = np.sqrt(merge.power(2) @ variance)
    return found


def send_shadow_rays(tracing, hemisphere):
    """Patches whose visible share of a sun is found by shadow rays: (p,) bool."""
    return ~tracing.plan.closed & tracing.patches.receives & ~hemisphere.enclosed.all(axis=1)


def look_at_block(tracing, hemisphere, suns, block, rays_before):
    """First light of one block of suns.

    Returns
    -------
    SunLight
    """
    patches, plan = tracing.patches, tracing.plan

    def report(share, rays):
        share = (block.start + share * (block.stop - block.start)) / len(suns)
        rays += rays_before
        tracing.progress("suns", rays, rays if share == 1 else rays / share, "rays")

    return trace_suns(
        tracing.ray_scene,
        patches,
        send_shadow_rays(tracing, hemisphere),
        plan.closed & patches.receives,
        hemisphere.enclosed,
        point_count=square_above(tracing.request.shadow_samples),
        suns=(suns.direction[block].astype(np.float32), suns.weight[block].astype(np.float32)),
        behind=plan.suns_behind,
        threads=tracing.threads,
        progress=report,
    )


def reflect_block(tracing, hemisphere, first, horizontal):
    """Reflections of one block of suns, without what the far ground reflects at first bounce.

    Parameters
    ----------
    first : (p, b) float32
    horizontal : (b,) float64
        Cosine of the suns' zenith angles.

    Returns
    -------
    reflected, gathered : (p, b) float32
    last : float
    """
    lit_ground = np.maximum(horizontal, 0) * tracing.request.ground_albedo
    far_first = np.outer(hemisphere.far_ground.mean(axis=1), lit_ground).astype(np.float32)
    factor = radiosity_factor(tracing.patches, hemisphere.covered_share)
    reflected, gathered, last = reflect(hemisphere.form_factors, factor, first, far_first, tracing.plan.max_bounces)
    return np.maximum(reflected - far_first, 0), gathered, last


def square_above(count):
    """The smallest square number not below `count`: points stand in the congruent sub-triangles of a patch."""
    return int(np.ceil(np.sqrt(count))) ** 2
