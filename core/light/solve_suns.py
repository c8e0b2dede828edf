"""Light of each sun on surfaces: visible share by shadow rays, and what patches reflect, in blocks
of suns.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from ..settings.progress import CancelledError
from ..sun.suns import Suns
from .annual_light import Annual, light_unshaded, sum_suns
from .form_factor_products import multiply_visible
from .solve_radiosity import radiosity_factor, reflection_of, sum_reflections
from .string_shade import add_losses, empty_losses, table_of_strings
from .sun_blocks import (
    FIRST_SUNS,
    SunBlock,
    SunProgress,
    block_of_suns,
    count_kept,
    cut_into_blocks,
)
from .sun_matrix import keep_columns, keep_matrix
from .sun_visibility import SunWatch, projection_in_front, sun_visibility

COUNTING = "number of reflections"  # stage


@dataclass
class SunLight:
    """Irradiance of n surfaces under each of s suns, per DNI."""

    visible_share: np.ndarray  # (n, s) float32
    # (n, s) float32, without the first reflection off the far ground; None: not wanted
    reflected: np.ndarray | None
    kept: int  # number of suns; fewer than all after an interruption
    # (n, s) float32, the part of `reflected` of one reflection; None: not wanted
    once: np.ndarray | None = None
    annual: Annual | None = None  # direct light of patches, of all suns
    # (r, n) float64, annual light by way of mirrors, glossy faces and glass
    specular: np.ndarray | float = 0.0
    ray_count: int = 0
    # (n, s, d) uint8, as of `string_shade.add_losses`; None: unknown
    string_loss: np.ndarray | None = None


@dataclass
class SunTask:
    """Suns to trace, and the patches and their points to trace them from."""

    suns: Suns
    watch: SunWatch
    blocks: list  # of slice
    progress: SunProgress
    # start of a block -> list of Shadows, traced but not solved yet
    traced_shadows: dict = field(default_factory=dict)
    # (states, p, words, s) uint16, of Shadows for all suns looked at; None: not wanted, or packed
    bits: np.ndarray | None = None
    # whether what patches reflect of each sun is wanted, and not the first reflection alone
    reflects: bool = True
    whole: bool = False  # whether none are wanted after an interruption, as of a further round


def prepare_suns(context, traced, suns):
    """What the suns are looked at from: SunTask; `traced` as of `trace_all`."""
    patches, plan, (traced, *_) = context.patches, context.plan, traced
    watch = SunWatch(
        context.ray_scene,
        patches,
        ~plan.open_to_suns & patches.receives & ~traced.covered.all(axis=1),
        plan.open_to_suns & patches.receives,
        traced.covered,
        context.points,
        plan.suns_behind,
        context.threads,
        elements=context.elements,
        left_out=context.left_out,
    )
    progress = SunProgress(context.progress, len(suns), int(context.reflections))
    return SunTask(suns, watch, cut_into_blocks(suns, len(patches)), progress)


def _trace_shadows(context, task, block, report):
    """Which points see the suns of a block: list of Shadows, in each state of trees.

    `report(share, rays)` is told of its rays.
    """
    if block.start in task.traced_shadows:
        return task.traced_shadows.pop(block.start)
    part = block_of_suns(task.suns, block)
    # Suns behind terrain are not traced.
    lit = context.plan.lit(part.directions)
    few = SunBlock(part.directions[lit], part.weights[lit])
    shadows = sun_visibility(task.watch, few, report)
    shadows = shadows if lit.all() else [shadow.among(lit) for shadow in shadows]
    if task.bits is not None:
        for bits, one in zip(task.bits, shadows, strict=True):
            bits[:, :, block] = one.bits
    return shadows


def light_of_first_days(context, traced, task):
    """Light of the first days' suns in clear air, which are looked at for all that follows, and of
    no others.

    Trees are in leaf.

    Returns
    -------
    first, reflected : (p,) float32
        Before reflections, and what the first reflection brings.
    """
    # The last sun of whole days among the first ones; where not even one day is whole, the last of
    # the first ones.
    first, reflected = np.zeros((2, len(context.patches)), np.float32)
    ends = task.suns.end_of_days
    last = ends[ends <= FIRST_SUNS].max(initial=0) or min(FIRST_SUNS, len(task.suns))

    def report(share, rays):
        task.progress.rays = task.progress.rays_before + rays
        context.progress(
            COUNTING, block.start + share * (min(block.stop, last) - block.start), last, "suns"
        )

    # Shadows of these suns are kept, as the run needs them again.
    for block in task.blocks:
        if block.start < last:
            task.progress.rays_before = task.progress.rays
            found, *_ = task.traced_shadows[block.start] = _trace_shadows(
                context, task, block, report
            )
            directions, weights = block_of_suns(
                task.suns, slice(block.start, min(block.stop, last))
            )
            found = replace(found, bits=np.ascontiguousarray(found.bits[:, :, : len(weights)]))
            # Direct light in clear air, weaker where the path through it is long: a share to the
            # power of the air mass.
            height = np.maximum(directions[:, 2], 0)
            # Direct light falls with the air mass AM as 0.7^(AM^0.678), Meinel & Meinel (1976); at
            # the horizon the air mass is not finite.
            weights = (
                weights * np.float32(0.7) ** (1 / np.maximum(height, np.float32(0.02))) ** 0.678
            )
            first += (
                found.visible_share * projection_in_front(context.patches.normal, directions)
            ) @ weights
            # The first reflection, by the city and by the ground beyond.
            reflected += _first_reflections(context, traced, found, directions) @ weights
            lit_ground = context.ground_albedo * (weights @ height)
            reflected += np.float32(lit_ground) * traced.far_ground.mean(axis=1)
    return first, reflected


def _first_reflections(context, traced, shadows, directions):
    """Light of suns that patches reflect once: (p, b) float32."""
    albedo, normal = context.patches.albedo, context.patches.normal
    seen_by = albedo, normal, shadows.points.representative_points
    return multiply_visible(
        traced.form_factors, seen_by, (directions, shadows.bits), context.threads
    )


def solve_suns(context, traced, task, hooks, *, folder=None):
    """Visible share and reflected irradiance of the surfaces for every sun, in blocks of suns.

    If the task is cancelled, the blocks that are finished in all states are kept, unless all are
    wanted or none.

    Parameters
    ----------
    context : GatherContext
    traced : list of Traced
        In each state of trees.
    task : SunTask
    hooks : list of SpecularLight
        Light by way of mirrors, glossy faces and glass, likewise, or None.
    folder : path-like, optional
        As in `keep_matrix`.

    Returns
    -------
    list of SunLight
        In each state of trees: visible share and reflected light, (n, s) each, the light of the
        year with its errors, what strings lose where it is known, and how many suns were kept.

    Raises
    ------
    CancelledError
        Before any usable set of suns was finished.
    """
    # Where blocks are collected: matrices of surfaces by suns for each state of the trees, and the
    # light of points summed over suns.
    suns, progress, done = task.suns, task.progress, []
    sums = np.zeros((len(traced), len(context.patches), context.points), np.float32)
    shape = context.patch_to_surface.shape[0], len(suns)
    lights_of_states = [
        SunLight(
            keep_matrix(shape, folder),
            keep_matrix(shape, folder) if task.reflects else None,
            len(suns),
            keep_matrix(shape, folder) if context.rounds else None,
            string_loss=empty_losses(shape) if context.knows_strings else None,
        )
        for _ in traced
    ]
    progress.bounces, strings = len(traced) * context.bounces * task.reflects, None
    # A block of suns at a time: shadows by rays, then reflections by the matrix of form factors.
    try:
        for block in task.blocks:
            progress.begin(block)
            states, added = _trace_shadows(context, task, block, progress.report_rays), []
            # Points, and so what stands for strings, are known once suns are looked at.
            if context.layout is not None and strings is None:
                strings = table_of_strings(context, task.watch)
            for state, shadows in enumerate(states):
                progress.bounces_before = state * context.bounces
                hook, light = hooks[state], lights_of_states[state]
                if strings is not None:
                    add_losses(strings, shadows.bits, light.string_loss[:, block])
                added.append(
                    _solve_block(
                        context, traced[state], shadows, task, block, specular=hook, found=light
                    )
                )
            # Light of the year at each point, by the weights of the suns.
            part = block_of_suns(suns, block)
            sums += [
                shadows.light_of_points(context.patches.normal, part, context.threads)
                for shadows in states
            ]
            for light, weighted in zip(lights_of_states, added, strict=True):
                light.specular = light.specular + weighted
            lights_of_states[0].ray_count += states[0].ray_count
            done.append(block)
            progress.end()
    # Interrupted: the finished suns are spread over the year, so they may stand for it.
    except CancelledError:
        kept = count_kept(suns, done)
        if not kept or task.whole:
            raise
        for light in lights_of_states:
            light.kept = kept
            light.visible_share, light.reflected = (
                keep_columns(matrix, kept) for matrix in (light.visible_share, light.reflected)
            )
            if light.string_loss is not None:
                light.string_loss = light.string_loss[:, :kept]
    # Their weights are scaled to a whole year; then the year's light of each state with its errors.
    directions, weights = block_of_suns(suns, slice(done[-1].stop if done else 0))
    if lights_of_states[0].kept < len(suns):  # the sums contain only these suns
        whole = weights.sum() or np.float32(np.nan)
        sums, weights = sums / whole, weights / whole
        for light in lights_of_states:
            light.specular = light.specular / whole
    part = SunBlock(directions, weights)
    unshaded = light_unshaded(context.patches, part, context.threads)
    for light, one, by_point in zip(lights_of_states, traced, sums, strict=True):
        light.annual = sum_suns(context, one, task.watch, by_point, part, unshaded=unshaded)
    return lights_of_states


def _solve_block(context, traced, shadows, task, block, *, specular, found):
    """Solve one block of suns, a slice, in one state of trees, and write it to its SunLight.

    Returns
    -------
    (r, n) float64 or float
        Weighted sum over these suns of light by way of mirrors, glossy faces and glass.
    """
    part, to_surface, weighted = block_of_suns(task.suns, block), context.patch_to_surface, 0.0
    if context.bounces and (task.reflects or found.once is not None):
        once = _first_reflections(context, traced, shadows, part.directions)
        if found.once is not None:
            found.once[:, block] = to_surface @ once
    if context.bounces and task.reflects:
        height = np.maximum(part.directions[:, 2], 0) * np.float32(context.ground_albedo)
        far_first = np.outer(traced.far_ground.mean(axis=1), height)
        once += far_first
        reflected = sum_reflections(
            reflection_of(context, traced), once, context.bounces, task.progress.report_bounce
        )
        # The first reflection off the far ground is known exactly for every hour.
        reflected = np.maximum(reflected - far_first, 0)
        found.reflected[:, block] = to_surface @ reflected
        if specular:
            radiosity = shadows.visible_share * projection_in_front(
                context.patches.normal, part.directions
            )
            radiosity += reflected + far_first
            radiosity *= radiosity_factor(context.patches, traced.covered_share)[:, None]
            values, weighted = specular.of_suns(part, block.start, radiosity)
            found.reflected[:, block] += values
    found.visible_share[:, block] = to_surface @ shadows.visible_share
    return weighted
