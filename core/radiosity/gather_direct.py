"""The gather estimator for the suns: direct irradiance of surfaces from shadow rays and form factors."""

from dataclasses import dataclass

import numpy as np

from ..effects.receivers import choose_turns, fewer_rays
from ..form_factors.form_factor_products import multiply_elements
from ..rays.random_numbers import mix
from ..settings.progress import CancelledError
from ..transfer.kept_matrix import keep_columns, keep_matrix
from ..transfer.surface_means import average_surfaces
from .add_specular import LightOfSuns, Specular, add_specular_suns
from .direct_errors import SeenSky, deviations_of_spread, spread_of_elements, variance_of_shadow_points
from .light_errors import LightError, ReflectedError, errors_of_surfaces
from .patch_size_errors import estimate_discretisation_error, reflect_cells
from .replicates import propagate_deviations
from .shadow_points import KnownPoints, points_above
from .solve_radiosity import covariance_of_replicates, radiosity_of_elements, reflect_block, variance_of_replicates
from .sun_blocks import SunBlock, SunProgress, block_of_suns, count_kept, cut_into_blocks
from .sun_visibility import sun_visibility


@dataclass
class Annual:
    """Weighted sums over the suns."""

    by_point: np.ndarray  # (p, m) float32, light at each point without reflections
    propagated: np.ndarray  # (p,) float32, as in `iterate_bounces`
    specular: Specular | None = None
    lit_ground: float = 0.0  # radiosity of the far ground
    by_replicate: np.ndarray | None = None  # (p, HEMISPHERE_REPLICATES) float32, what is reflected
    radiosity: np.ndarray | None = None  # (p, cells) float32, of `radiosity_of_elements`
    suns: SunBlock | None = None  # all that are in the sums
    known: KnownPoints | None = None  # of the shadow points; None before the first block


@dataclass
class Direct:
    """Irradiance under each sun, per DNI."""

    visible_share: np.ndarray  # (n, s) float32
    reflected: np.ndarray  # (n, s) float32, without the first bounce off the far ground
    error: LightError  # of the mean weighted with the suns' weights; NaN: a single point gives no variance estimate
    covariance: np.ndarray  # (n,) of the surfaces' own noise in this light and in that of the sky
    points: np.ndarray  # (n,) variance of own noise from shadow points only
    last: float  # share of the last bounce of all light
    ray_count: int
    kept: int  # number of suns; fewer than all after an interruption
    discretisation_error: float = 0.0  # of `estimate_discretisation_error`
    annual: Annual | None = None


def gather_direct(context, hemisphere, suns, by_replicate, folder=None, *, specular=None):
    """Visible share and reflected irradiance of the surfaces for every sun, in blocks of suns.

    If the task is cancelled, the blocks that are finished are kept.

    Parameters
    ----------
    context : GatherContext
    hemisphere : Hemisphere
    suns : Suns
    by_replicate : (p, HEMISPHERE_REPLICATES) float32
        Of `Diffuse`.
    folder : path-like, optional
        As in `keep_matrix`.
    specular : SpecularLight, optional
        Light by way of mirrors, glossy faces and glass.

    Returns
    -------
    Direct

    Raises
    ------
    CancelledError
        Before any usable set of suns was finished.
    """
    merge = context.merge
    found = Direct(
        visible_share=keep_matrix((merge.shape[0], len(suns)), folder),
        reflected=keep_matrix((merge.shape[0], len(suns)), folder),
        error=None,
        covariance=None,
        points=None,
        last=0.0,
        ray_count=0,
        kept=len(suns),
    )
    annual = Annual(
        by_point=np.zeros((len(context.patches), points_above(context.request.shadow_samples)), np.float32),
        propagated=np.zeros(len(context.patches), np.float32),
    )
    annual.specular = specular and Specular(specular.of_suns)
    progress = SunProgress(context.progress, len(suns), context.plan.max_bounces if context.plan.reflections else 0)
    blocks = cut_into_blocks(suns, len(context.patches))
    done = []
    try:
        for block in blocks:
            gather_block(context, hemisphere, suns, block, progress=progress, found=found, annual=annual)
            done.append(block)
            progress.end()
    except CancelledError:
        found.kept = count_kept(suns, done)
        if not found.kept:
            raise
        found.visible_share, found.reflected = (
            keep_columns(matrix, found.kept) for matrix in (found.visible_share, found.reflected)
        )
    last = done[-1].stop if done else 0
    annual.suns = block_of_suns(suns, slice(last))
    errors = error_of_direct(context, hemisphere, annual, annual.suns, by_replicate)
    found.annual = annual
    found.error, found.covariance, found.points, found.discretisation_error = errors
    if annual.specular and done:
        found.error.own = found.error.own + variance_of_replicates(annual.specular.by_replicate.T)
    if found.kept < len(suns):
        whole = annual.suns.weights.sum() or np.nan  # the sums contain only these suns
        found.error, found.covariance = found.error.scaled(1 / whole), found.covariance / whole
        found.points = found.points / whole**2
    return found


def gather_block(context, hemisphere, suns, block, *, progress, found, annual):
    """Trace one block of suns and add it to the results.

    Parameters
    ----------
    context : GatherContext
    hemisphere : Hemisphere
    suns : Suns
        All of them.
    block : slice
        Those to trace.
    progress : SunProgress
    found : Direct
        Written.
    annual : Annual
        Written.
    """
    part = block_of_suns(suns, block)
    progress.begin(block)
    light = first_light_of_block(context, hemisphere, part, block.start, progress.report_rays, annual.known)
    if context.plan.reflections:
        reflected, propagated, last = reflect_block(context, hemisphere, light, part, progress.report_bounce)
        # No report from here on, and so no interruption: a block is kept as a whole or not at all.
        keep_block(context, found.reflected, block, reflected)
        found.last = max(found.last, last)
        annual.propagated += propagated
        if annual.specular:
            lights = LightOfSuns(light.visible_share, reflected)
            add_specular_suns(context, hemisphere, part, lights, block, found=found, specular=annual.specular)
        if context.plan.far_ground:
            annual.lit_ground += context.request.ground_albedo * float(
                part.weights @ np.maximum(part.directions[:, 2], 0)
            )
    keep_block(context, found.visible_share, block, light.visible_share)
    found.ray_count += light.ray_count
    annual.by_point += light.by_point
    annual.known = light.known


def keep_block(context, matrix, block, values):
    """Average values of patches, (p, b) float32, over surfaces and write them into columns of a `keep_matrix`."""
    average_surfaces(context.merge, values, context.threads, out=matrix[:, block])


def error_of_direct(context, hemisphere, annual, suns, diffuse):
    """Error of the surfaces' direct irradiance, as weighted sum over the suns.

    Parameters
    ----------
    suns : SunBlock
        Those in `annual`.
    diffuse : (p, HEMISPHERE_REPLICATES) float32
        Light of the sky from the same rays.

    Returns
    -------
    error : LightError
    covariance : (n,) float64
        Of the surfaces' own noise in this light and in that of the sky.
    points : (n,) float64
        Variance from shadow points only.
    discretisation_error : float
        Of `estimate_discretisation_error`.
    """
    patches, merge, threads = context.patches, context.merge, context.threads
    samples = context.request.samples
    rays = np.where(only_pass_on(context), fewer_rays(samples), samples)
    sky = SeenSky(hemisphere.sky.mean(axis=1), rays)
    variance = variance_of_shadow_points(annual.by_point, hemisphere.covered, patches, suns, sky)
    variance[~send_shadow_rays(context, hemisphere)] = 0  # known exactly, even with a single point
    from_points = merge.power(2) @ variance
    if not context.plan.reflections or annual.known is None:
        return errors_of_surfaces(merge, variance), np.zeros(merge.shape[0]), from_points, 0.0
    element_annual = np.take_along_axis(annual.by_point, annual.known.representative_points, axis=1)
    by_replicate = multiply_elements(hemisphere.form_factors, annual.propagated, hemisphere.factor, threads)
    first_bounce, steps = reflect_cells(context, hemisphere, element_annual)
    by_replicate += first_bounce
    by_replicate += annual.lit_ground * hemisphere.far_ground
    if context.rounds:
        annual.by_replicate = by_replicate.copy()
        annual.radiosity = radiosity_of_elements(context, hemisphere, element_annual, annual.propagated)
    share = estimate_discretisation_error(context, steps, by_replicate)
    covariance = merge.power(2) @ covariance_of_replicates(by_replicate, diffuse)
    noise = variance + variance_of_replicates(by_replicate)
    light = merge @ (annual.by_point.mean(axis=1, dtype=float) + by_replicate.mean(axis=1, dtype=float))
    spread = spread_of_elements(annual.by_point, annual.known.representative_points, hemisphere.covered)
    points = deviations_of_spread(spread, patches.key ^ mix(patches.points_before.astype(np.uint64)))
    passed_on = propagate_deviations(context, hemisphere, points, by_replicate)
    errors = errors_of_surfaces(merge, noise, ReflectedError(light, passed_on, steps))
    return errors, covariance, from_points, share


def send_shadow_rays(context, hemisphere):
    """Patches that need shadow rays: (p,) bool."""
    return ~context.plan.open_to_suns & context.patches.receives & ~hemisphere.covered.all(axis=1)


def first_light_of_block(context, hemisphere, suns, first_sun, report, known=None):  # noqa: PLR0917
    """Light of one block of suns before reflections.

    Parameters
    ----------
    suns : SunBlock
    first_sun : int
        Number of suns before the block.
    report : callable
        Called with the share done and the rays traced.
    known : KnownPoints, optional
        From an earlier block.

    Returns
    -------
    SunLight
    """
    patches, plan, points = context.patches, context.plan, points_above(context.request.shadow_samples)
    lit = plan.lit(suns.directions)
    light = sun_visibility(
        context.ray_scene,
        patches,
        send_shadow_rays(context, hemisphere),
        plan.open_to_suns & patches.receives,
        hemisphere.covered,
        point_count=points,
        suns=SunBlock(suns.directions[lit], suns.weights[lit]),
        behind=plan.suns_behind,
        threads=context.threads,
        progress=report,
        turns=choose_turns(plan.receivers, context.owner < 0, hemisphere.seen, points),
        first_sun=first_sun,
        known=known,
    )
    return light if lit.all() else light.among(lit)


def only_pass_on(context):
    """Patches with fewer rays: (p,) bool."""
    plan = context.plan
    return np.zeros(len(context.patches), bool) if plan.receivers is None else ~plan.receivers
