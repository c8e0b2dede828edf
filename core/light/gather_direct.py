"""The gather estimator under the suns: from shadow rays and matrix to the direct irradiance of surfaces."""

from dataclasses import dataclass

import numpy as np

from ..progress import CancelledError
from .direct_errors import variance_of_shadow_points
from .form_factor_products import multiply_cells, multiply_seen
from .gather_diffuse import change_by_even_patches
from .kept_matrix import MatrixOnDisk, keep_matrix
from .reflect import follow_bounces, variance_of_replicates
from .row_slices import work_in_slices
from .shadow_points import points_above
from .sun_blocks import SunsTeller, count_kept, cut_into_blocks, keep_columns
from .surface_means import average_surfaces
from .trace_suns import trace_suns


@dataclass
class Direct:
    """Under each sun, per DNI."""

    visible_share: np.ndarray | MatrixOnDisk  # (n, s) float32
    reflected: np.ndarray | MatrixOnDisk  # (n, s) float32, without what the far ground reflects at first bounce
    standard_error: np.ndarray  # (n,) of the mean weighted with the suns' weights; NaN where one point tells no spread
    last: float  # share of the last bounce in all light
    ray_count: int
    kept: int  # of the suns; fewer than all where somebody interrupted
    evened: float = 0.0  # of `change_by_even_patches`


@dataclass
class Annual:
    """Sums over the suns, by weight."""

    by_point: np.ndarray  # (p, m) float32, what each point receives at first hit
    handed_on: np.ndarray  # (p,) float32, as of `follow_bounces`
    lit_ground: float = 0.0  # radiosity of the far ground
    speakers: np.ndarray | None = None  # (p, cells) uint, the same for every sun; None before the first


def gather_direct(tracing, hemisphere, suns, folder=None):
    """Visible share and reflected irradiance of the surfaces for every sun, block by block of suns.

    Whoever cancels keeps the blocks that are done.

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

    Raises
    ------
    CancelledError
        Before any sun was of use.
    """
    merge = tracing.merge
    found = Direct(
        visible_share=keep_matrix((merge.shape[0], len(suns)), folder),
        reflected=keep_matrix((merge.shape[0], len(suns)), folder),
        standard_error=np.zeros(merge.shape[0]),
        last=0.0,
        ray_count=0,
        kept=len(suns),
    )
    annual = Annual(
        by_point=np.zeros((len(tracing.patches), points_above(tracing.request.shadow_samples)), np.float32),
        handed_on=np.zeros(len(tracing.patches), np.float32),
    )
    teller = SunsTeller(tracing.progress, len(suns), tracing.plan.max_bounces if tracing.plan.reflections else 0)
    blocks = cut_into_blocks(suns, len(tracing.patches))
    done = []
    try:
        for block in blocks:
            gather_block(tracing, hemisphere, (suns, block), teller, found=found, annual=annual)
            done.append(block)
            teller.end()
    except CancelledError:
        found.kept = count_kept(suns, done)
        if not found.kept:
            raise
        found.visible_share, found.reflected = (
            keep_columns(matrix, found.kept) for matrix in (found.visible_share, found.reflected)
        )
    last = done[-1].stop if done else 0
    traced = suns.direction[:last].astype(np.float32), suns.weight[:last].astype(np.float32)
    found.standard_error, found.evened = error_of_direct(tracing, hemisphere, annual, traced)
    if found.kept < len(suns):
        found.standard_error /= traced[1].sum() or np.nan  # the sums hold no more than these
    return found


def gather_block(tracing, hemisphere, lit, teller, *, found, annual):
    """Add one block of suns to what was found.

    Parameters
    ----------
    tracing : Tracing
    hemisphere : Hemisphere
    lit : tuple of Suns and slice
        All suns, and which of them make the block.
    teller : SunsTeller
    found : Direct
        Written.
    annual : Annual
        Written.
    """
    suns, block = lit
    part = suns.direction[block].astype(np.float32), suns.weight[block].astype(np.float32)
    teller.begin(block)
    light = look_at_block(tracing, hemisphere, part, teller.tell_rays)
    if tracing.plan.reflections:
        reflected, handed_on, last = reflect_block(tracing, hemisphere, light, part, teller.tell_bounce)
        # From here on nobody interrupts: the block is kept as a whole.
        keep_block(tracing, found.reflected, block, reflected)
        found.last = max(found.last, last)
        annual.handed_on += handed_on
        if tracing.plan.far_ground:
            annual.lit_ground += tracing.request.ground_albedo * float(part[1] @ np.maximum(part[0][:, 2], 0))
    keep_block(tracing, found.visible_share, block, light.visible_share)
    found.ray_count += light.ray_count
    annual.by_point += light.by_point
    annual.speakers = light.speakers


def keep_block(tracing, matrix, block, values):
    """Means of patches over their surfaces, (p, b) float32, into columns of a matrix of `keep_matrix`."""
    if isinstance(matrix, np.ndarray):
        average_surfaces(tracing.merge, values, tracing.threads, out=matrix[:, block])
    else:
        matrix[:, block] = average_surfaces(tracing.merge, values, tracing.threads)


def error_of_direct(tracing, hemisphere, annual, suns):
    """How sure the surfaces' direct irradiance is, summed over the suns by weight.

    Parameters
    ----------
    suns : tuple of (s, 3) float32 and (s,) float32
        Directions and weights of those that `annual` holds.

    Returns
    -------
    standard_error : (n,) float64
    evened : float
        Of `change_by_even_patches`.
    """
    patches, evened = tracing.patches, 0.0
    variance = variance_of_shadow_points(annual.by_point, hemisphere.covered, patches.normal, suns, tracing.threads)
    variance[~send_shadow_rays(tracing, hemisphere)] = 0  # known exactly, even where one point tells no spread
    if tracing.plan.reflections and annual.speakers is not None:
        annual_of_cells = np.take_along_axis(annual.by_point, annual.speakers, axis=1)
        first_bounce = multiply_cells(hemisphere.form_factors, patches.albedo, annual_of_cells, tracing.threads)
        by_replicate = multiply_cells(hemisphere.form_factors, annual.handed_on, hemisphere.factor, tracing.threads)
        by_replicate += first_bounce
        by_replicate += annual.lit_ground * hemisphere.far_ground
        variance = variance + variance_of_replicates(by_replicate)
        first, celled = (light.mean(axis=1, keepdims=True) for light in (annual.by_point, first_bounce))
        evened = change_by_even_patches(tracing, hemisphere, first, celled, by_replicate)
    return np.sqrt(tracing.merge.power(2) @ variance), evened


def send_shadow_rays(tracing, hemisphere):
    """Patches whose visible share of a sun is found by shadow rays: (p,) bool."""
    return ~tracing.plan.closed & tracing.patches.receives & ~hemisphere.covered.all(axis=1)


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
        hemisphere.covered,
        point_count=points_above(tracing.request.shadow_samples),
        suns=suns,
        behind=plan.suns_behind,
        threads=tracing.threads,
        progress=report,
    )


def reflect_block(tracing, hemisphere, light, suns, report):
    """Reflections of one block of suns, without what the far ground reflects at first bounce.

    Parameters
    ----------
    light : SunLight
        Of the b suns of the block.
    suns : tuple of (b, 3) float32 and (b,) float32
        Directions and weights.
    report : callable
        Called with the number of bounces done.

    Returns
    -------
    reflected : (p, b) float32
    handed_on : (p,) float32
        As of `follow_bounces`, with the suns' weights.
    last : float
    """
    directions, weights = suns
    form_factors, threads = hemisphere.form_factors, tracing.threads
    far_first = None
    if tracing.plan.far_ground:
        lit_ground = np.maximum(directions[:, 2], 0) * np.float32(tracing.request.ground_albedo)
        far_first = np.outer(hemisphere.far_ground.mean(axis=1), lit_ground)
    lit = directions, light.seen
    arriving = multiply_seen(form_factors, tracing.patches.albedo, tracing.patches.normal, lit, threads)
    reflected, handed_on, last = follow_bounces(
        form_factors,
        hemisphere.factor,
        arriving,
        tracing.plan.max_bounces,
        far_first=far_first,
        first_light=light.by_point.mean(axis=1).sum(dtype=float),
        weight=weights,
        threads=threads,
        progress=report,
    )
    if far_first is not None:
        take_out(reflected, far_first, threads)
    return reflected, handed_on, last


def take_out(reflected, far_first, threads):
    """Take from all reflected light, (p, s), what the far ground adds at first bounce."""

    def subtract(rows):
        reflected[rows] -= far_first[rows]
        np.maximum(reflected[rows], 0, out=reflected[rows])

    work_in_slices(subtract, len(reflected), threads)
