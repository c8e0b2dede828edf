"""Light of the suns on surfaces: visible share by shadow rays, and what patches reflect, in blocks of suns."""

from dataclasses import dataclass, field, replace

import numpy as np

from ..effects.rays import choose_turns
from ..rays.random_numbers import mix
from ..settings.progress import CancelledError
from ..settings.threads import work_in_slices
from ..sun.suns import end_of_days
from .direct_errors import deviations_of_spread, spread_of_elements, variance_of_points
from .form_factor_products import multiply_elements, multiply_visible
from .kept_matrix import average_surfaces, keep_columns, keep_matrix
from .light_errors import (
    LightError,
    ReflectedError,
    errors_of_surfaces,
    estimate_discretisation_error,
    propagate_deviations,
    reflect_elements,
)
from .solve_radiosity import (
    covariance_of_replicates,
    exchange_of,
    iterate_bounces,
    radiosity_factor,
)
from .solve_sky import radiosity_of_elements
from .sun_blocks import FIRST_SUNS, SunBlock, SunProgress, block_of_suns, count_kept, cut_into_blocks
from .sun_visibility import WORD, SunWatch, projection_in_front, sun_visibility
from .transfer import variance_of_mean

CLEAR_AIR, AIR_POWER = np.float32(0.7), 0.678  # direct light by air mass AM: 0.7^(AM^0.678), Meinel & Meinel (1976)
COUNTING, ANNUAL = "number of reflections", "annual light of the suns"  # stages
LOWEST = np.float32(0.02)  # height of a sun whose air mass is not finite


@dataclass
class Annual:
    """Sums over the suns by their weights, for p patches."""

    by_point: np.ndarray  # (p, m) float32, light at each point without reflections
    propagated: np.ndarray  # (p,) float32, as in `iterate_bounces`
    lit_ground: float = 0.0  # radiosity of the far ground
    specular: np.ndarray | float = 0.0  # (r, n) float64, light by way of mirrors, glossy faces and glass
    reflected: np.ndarray | None = None  # (p, HEMISPHERE_REPLICATES) float32; for further rounds
    radiosity: np.ndarray | None = None  # (p, elements) float32; for further rounds
    suns: SunBlock | None = None  # all that are in the sums


@dataclass
class SunLight:
    """Irradiance of n surfaces under each of s suns, per DNI."""

    visible_share: np.ndarray  # (n, s) float32
    reflected: np.ndarray  # (n, s) float32, without the first bounce off the far ground
    kept: int  # number of suns; fewer than all after an interruption
    annual: Annual
    error: LightError | None = None  # of the mean weighted with the suns' weights; NaN: one point gives no variance
    covariance: np.ndarray | None = None  # (n,) of the surfaces' own noise in this light and in that of the sky
    points: np.ndarray | None = None  # (n,) variance of own noise from shadow points only
    last: float = 0.0  # share of the last bounce of all light
    ray_count: int = 0
    discretisation_error: float = 0.0  # of `estimate_discretisation_error`


@dataclass
class SunTask:
    """Suns to trace, and from which points of which patches."""

    suns: object  # sun.Suns
    watch: SunWatch
    blocks: list  # of slice
    progress: SunProgress
    looked: dict = field(default_factory=dict)  # start of a block -> its Shadows, traced but not solved yet
    bits: np.ndarray | None = None  # (p, words, s) uint16, of Shadows for all suns looked at; None: not kept
    known: object = None  # of `edit_light.KnownShadows`; None: all are looked at


def prepare_suns(context, traced, suns, known=None):
    """What the suns are looked at from: SunTask; `known` as of `trace_all`."""
    patches, plan = context.patches, context.plan
    watch = SunWatch(
        context.ray_scene,
        patches,
        ~plan.open_to_suns & patches.receives & ~traced.covered.all(axis=1),
        plan.open_to_suns & patches.receives,
        traced.covered,
        context.points,
        choose_turns(plan.receivers, context.owner < 0, traced.filled, context.points),
        plan.suns_behind,
        context.threads,
    )
    progress = SunProgress(context.progress, len(suns), int(context.reflections))
    task = SunTask(suns, watch, cut_into_blocks(suns, len(patches)), progress)
    if context.editable:
        task.bits = np.zeros((len(patches), -(-context.points // WORD), len(suns)), np.uint16)
    task.known = known and known.shadows(watch)
    return task


def look_at_block(context, task, block, report):
    """Which points see the suns of a block: Shadows; `report(share, rays)` is told of its rays."""
    if block.start in task.looked:
        return task.looked.pop(block.start)
    part = block_of_suns(task.suns, block)
    lit = context.plan.lit(part.directions)
    few = SunBlock(part.directions[lit], part.weights[lit])
    known = task.known and task.known.of_suns(np.flatnonzero(lit) + block.start, few.directions)
    found = sun_visibility(task.watch, few, block.start, report, known=known)
    found = found if lit.all() else found.among(lit)
    if task.bits is not None:
        task.bits[:, :, block] = found.bits
    return found


def light_of_first_days(context, traced, task):
    """Light of the first days' suns in clear air, which are looked at for all that follows, and of no others.

    Returns
    -------
    first, reflected : (p,) float32
        Before reflections, and what the first reflection brings.
    """
    first, reflected = np.zeros((2, len(context.patches)), np.float32)
    ends = end_of_days(task.suns)
    last = ends[ends <= FIRST_SUNS].max(initial=0) or min(FIRST_SUNS, len(task.suns))

    def report(share, rays):
        task.progress.rays = task.progress.rays_before + rays
        context.progress(COUNTING, block.start + share * (min(block.stop, last) - block.start), last, "suns")

    for block in task.blocks:
        if block.start < last:
            task.progress.rays_before = task.progress.rays
            found = task.looked[block.start] = look_at_block(context, task, block, report)
            directions, weights = block_of_suns(task.suns, slice(block.start, min(block.stop, last)))
            found = replace(found, bits=np.ascontiguousarray(found.bits[:, :, : len(weights)]))
            height = np.maximum(directions[:, 2], 0)
            weights = weights * CLEAR_AIR ** (1 / np.maximum(height, LOWEST)) ** AIR_POWER
            first += (found.visible_share * projection_in_front(context.patches.normal, directions)) @ weights
            reflected += first_reflections(context, traced, found, directions) @ weights
            lit_ground = context.request.ground_albedo * (weights @ height)
            reflected += np.float32(lit_ground) * traced.far_ground.mean(axis=1)
    return first, reflected


def annual_light(context, traced, task):
    """Light of surfaces under all suns by their weights, reflections included: (n,) float64 [per DNI].

    Suns are looked at, for all that follows, but their sum is solved as one light.
    """
    patches, by_point = context.patches, np.zeros((len(context.patches), context.points), np.float32)
    for block in task.blocks:
        context.progress(ANNUAL, block.start, len(task.suns), "suns")
        found = task.looked[block.start] = look_at_block(context, task, block, lambda share, rays: None)
        by_point += found.light_of_points(patches.normal, block_of_suns(task.suns, block), context.threads)
    light = by_point.mean(axis=1, dtype=float)
    if context.bounces:
        places = task.watch.points.representative_points.astype(np.intp)
        elements, suns = np.take_along_axis(by_point, places, axis=1), block_of_suns(task.suns, slice(None))
        lit_ground = suns.weights @ np.maximum(suns.directions[:, 2], 0) * np.float32(context.request.ground_albedo)
        first = multiply_elements(traced.form_factors, patches.albedo, elements, context.threads)
        first += lit_ground * traced.far_ground
        arriving = first.mean(axis=1, keepdims=True)
        light += iterate_bounces(exchange_of(context, traced), arriving, context.bounces)[0][:, 0]
    return context.patch_to_surface @ light


def first_reflections(context, traced, shadows, directions):
    """Light of suns that patches reflect once: (p, b) float32."""
    albedo, normal = context.patches.albedo * shadows.turns.astype(np.float32), context.patches.normal
    seen_by = albedo, normal, shadows.points.representative_points
    return multiply_visible(traced.form_factors, seen_by, (directions, shadows.bits), context.threads)


def solve_suns(context, traced, task, sky, *, folder=None, specular=None):
    """Visible share and reflected irradiance of the surfaces for every sun, in blocks of suns.

    If the task is cancelled, the blocks that are finished are kept.

    Parameters
    ----------
    context : GatherContext
    traced : Traced
    task : SunTask
    sky : (p, HEMISPHERE_REPLICATES) float32
        `by_replicate` of the sky's light.
    folder : path-like, optional
        As in `keep_matrix`.
    specular : SpecularLight, optional
        Light by way of mirrors, glossy faces and glass.

    Returns
    -------
    SunLight

    Raises
    ------
    CancelledError
        Before any usable set of suns was finished.
    """
    suns, count = task.suns, len(context.patches)
    shape = context.patch_to_surface.shape[0], len(suns)
    annual = Annual(np.zeros((count, context.points), np.float32), np.zeros(count, np.float32))
    found = SunLight(keep_matrix(shape, folder), keep_matrix(shape, folder), len(suns), annual)
    task.progress.bounces, done = context.bounces, []
    try:
        for block in task.blocks:
            solve_block(context, traced, task, block, found=found, specular=specular)
            done.append(block)
            task.progress.end()
    except CancelledError:
        found.kept = count_kept(suns, done)
        if not found.kept or task.known:  # an edit is traced to its end or not at all
            raise
        found.visible_share, found.reflected = (
            keep_columns(matrix, found.kept) for matrix in (found.visible_share, found.reflected)
        )
    annual.suns = block_of_suns(suns, slice(done[-1].stop if done else 0))
    add_errors(context, traced, task.watch, found, sky)
    if specular and done:
        found.error.own = found.error.own + variance_of_mean(annual.specular.T)
    if found.kept < len(suns):
        whole = annual.suns.weights.sum() or np.nan  # the sums contain only these suns
        found.error, found.covariance = found.error.scaled(1 / whole), found.covariance / whole
        found.points = found.points / whole**2
    return found


def solve_block(context, traced, task, block, *, found, specular):
    """Trace one block of suns, a slice, and add it to SunLight."""
    annual, part = found.annual, block_of_suns(task.suns, block)
    task.progress.begin(block)
    shadows = look_at_block(context, task, block, task.progress.report_rays)
    height = np.maximum(part.directions[:, 2], 0) * np.float32(context.request.ground_albedo)
    far_first = np.outer(traced.far_ground.mean(axis=1), height) if context.plan.far_ground else None
    visible_share, to_surface, threads = shadows.visible_share, context.patch_to_surface, context.threads
    by_point = shadows.light_of_points(context.patches.normal, part, threads)
    if context.bounces:
        reflected, propagated, last = iterate_bounces(
            exchange_of(context, traced),
            first_reflections(context, traced, shadows, part.directions),
            context.bounces,
            far_first=far_first,
            first_light=by_point.mean(axis=1).sum(dtype=float),
            weight=part.weights,
            progress=task.progress.report_bounce,
        )
        # No report from here on, and so no interruption: a block is kept as a whole or not at all.
        annual.propagated += propagated
        found.last = max(found.last, last)
        if far_first is not None:  # its first bounce is known exactly for every hour
            annual.lit_ground += float(part.weights @ height)

            def subtract(rows):
                reflected[rows] = np.maximum(reflected[rows] - far_first[rows], 0)

            work_in_slices(subtract, len(reflected), threads)
        average_surfaces(to_surface, reflected, threads, out=found.reflected[:, block])
        if specular:
            radiosity = reflected + visible_share * projection_in_front(context.patches.normal, part.directions)
            radiosity += 0 if far_first is None else far_first
            radiosity *= radiosity_factor(context.patches, traced.covered_share)[:, None]
            values, weighted = specular.of_suns(part, block.start, radiosity)
            found.reflected[:, block] += values
            annual.specular = annual.specular + weighted
    average_surfaces(to_surface, visible_share, threads, out=found.visible_share[:, block])
    found.ray_count += shadows.ray_count
    annual.by_point += by_point


def add_errors(context, traced, watch, found, sky):
    """Write the errors of the surfaces' direct irradiance, as weighted sum over the suns, to SunLight.

    Parameters
    ----------
    watch : SunWatch
    sky : (p, HEMISPHERE_REPLICATES) float32
        Light of the sky from the same rays.
    """
    patches, to_surface, annual = context.patches, context.patch_to_surface, found.annual
    squares = to_surface.power(2)
    unshaded = projection_in_front(patches.normal, annual.suns.directions) @ annual.suns.weights
    variance = variance_of_points([annual.by_point], watch.covered.mean(axis=1), unshaded)
    variance = np.where(watch.traced, variance, 0)  # else known exactly
    found.points = squares @ variance
    if not context.bounces or watch.points is None:
        found.error, found.covariance = errors_of_surfaces(to_surface, variance), np.zeros(to_surface.shape[0])
        return
    elements = np.take_along_axis(annual.by_point, watch.points.representative_points.astype(np.intp), axis=1)
    first_bounce, steps = reflect_elements(context, traced, elements)
    by_replicate = multiply_elements(traced.form_factors, annual.propagated, traced.factor, context.threads)
    by_replicate += first_bounce + annual.lit_ground * traced.far_ground
    if context.rounds or context.editable:
        annual.reflected = by_replicate.copy()
    if context.rounds:
        annual.radiosity = radiosity_of_elements(context, traced, elements, annual.propagated)
    found.discretisation_error = estimate_discretisation_error(context, steps, by_replicate)
    found.covariance = squares @ covariance_of_replicates(by_replicate, sky)
    noise = variance + variance_of_mean(by_replicate)
    light = to_surface @ (annual.by_point.mean(axis=1, dtype=float) + by_replicate.mean(axis=1, dtype=float))
    spread = spread_of_elements(annual.by_point, watch.points.representative_points, traced.covered)
    deviations = deviations_of_spread(spread, patches.key ^ mix(patches.points_before.astype(np.uint64)))
    transported = propagate_deviations(context, traced, deviations, by_replicate)
    found.error = errors_of_surfaces(to_surface, noise, ReflectedError(light, transported, steps))
