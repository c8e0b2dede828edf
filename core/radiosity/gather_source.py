"""The gather estimator for a source of light in the sky: rays towards it, its light on surfaces, what they reflect."""

from dataclasses import dataclass

import numpy as np

from ..effects.receivers import fewer_rays
from ..form_factors.form_factor_products import multiply_elements
from ..patches.cover_cells import enclosed_cells
from ..patches.find_covered import lie_in_earth
from ..rays.hemisphere_rays import CELL_DIVISIONS, points_of_patches, shift_replicates
from ..rays.random_numbers import mix
from ..rays.sample_points import DIGITS, HEMISPHERE_REPLICATES, barycentric_of_square, cell_of_point, sobol_digits
from ..settings.threads import map_in_order
from ..sun.horizon import mark_hidden
from ..transfer.transfer import SourceLight
from .light_errors import ReflectedError, errors_of_surfaces
from .patch_size_errors import reflect_cells
from .replicates import STEP, Deviations, propagate_deviations
from .solve_radiosity import iterate_bounces, radiosity_factor, variance_of_replicates
from .trace_hemisphere import (
    DARK,
    FAR_GROUND,
    RAYS_PER_TASK,
    SKY,
    cells_near_cover,
    classify_rays,
    mark_dark,
    stop_at_leaves,
    tally_rays,
)

LEAST = 1e-6  # of a source's light on an unshaded patch, up to which that does not face it


@dataclass
class FirstLight:
    """First light of p patches from a source, in its unit."""

    light: np.ndarray  # (p, HEMISPHERE_REPLICATES) float32
    element: np.ndarray  # (p, cells) float32, of the open part of each cell
    deviations: Deviations  # of `element`
    ray_count: int


def gather_source(context, source, hemisphere, cells, specular=None):
    """Light of a source on the surfaces.

    Parameters
    ----------
    context : GatherContext
    source : HorizonBand
    hemisphere : Hemisphere
    cells : int
        1, 4 or 16: into how many cells the light of a patch is resolved.
    specular : SpecularLight, optional
        Light by way of mirrors, glossy faces and glass.

    Returns
    -------
    light : SourceLight
    ray_count : int
    """
    first = trace_source(context, source, hemisphere.covered, cells)
    merge, reflections, by_replicate = context.merge, None, first.light
    if context.plan.reflections:
        form_factors, threads = hemisphere.form_factors, context.threads
        first_bounce, steps = reflect_cells(context, hemisphere, first.element)
        arriving = first_bounce.mean(axis=1, keepdims=True)
        _, propagated, _ = iterate_bounces(
            form_factors, hemisphere.factor, arriving, context.plan.max_bounces, threads=threads
        )
        reflected = multiply_elements(form_factors, propagated, hemisphere.factor, threads) + first_bounce
        by_replicate = first.light + reflected
        passed_on = propagate_deviations(context, hemisphere, first.deviations, reflected)
        reflections = ReflectedError(merge @ by_replicate.mean(axis=1, dtype=float), passed_on, steps)
    error = errors_of_surfaces(merge, variance_of_replicates(by_replicate), reflections)
    added = np.zeros((2, merge.shape[0]))
    if specular:
        factor = radiosity_factor(context.patches, hemisphere.covered_share)
        added = specular.of_source(source.name, factor * by_replicate.mean(axis=1))
    error.own = error.own + variance_of_replicates(added.T)
    light = SourceLight(
        view_factor=merge @ first.light.mean(axis=1, dtype=float),
        relative=merge @ by_replicate.mean(axis=1, dtype=float) + added.mean(axis=0),
        standard_error=np.asarray(error.standard_error),
    )
    return light, first.ray_count


def trace_source(context, source, covered, cells):
    """First light of all patches from a source.

    Parameters
    ----------
    context : GatherContext
    source : HorizonBand
    covered : (p, CELL_DIVISIONS²) bool
        Cells that lie inside or under something.
    cells : int
        1, 4 or 16: into how many cells the light of a patch is resolved.

    Returns
    -------
    FirstLight
    """
    patches, plan = context.patches, context.plan
    unshaded = source.unshaded(patches.normal).astype(np.float32)
    known = plan.unobstructed & patches.receives
    traced = patches.receives & ~known & (unshaded > LEAST) & ~covered.all(axis=1)
    full = np.ones(len(patches), bool) if plan.receivers is None else plan.receivers
    samples = context.request.samples
    share = np.where(known, source.seen(np.where(known[:, None], patches.normal, [[0, 0, 1]]), plan.terrain), 0)
    share = share.astype(np.float32)[:, None]
    counts = (traced & full, samples), (traced & ~full, fewer_rays(samples))
    tasks = [task for chosen, count in counts for task in cut_rows(chosen, count, plan.rays_share)]
    found = FirstLight(
        light=np.repeat(share, HEMISPHERE_REPLICATES, axis=1),
        element=np.repeat(share, cells, axis=1),
        deviations=Deviations(np.zeros((len(patches), cells, HEMISPHERE_REPLICATES), np.int16), STEP * unshaded),
        ray_count=sum(len(chosen) * len(sequence) for chosen, sequence in tasks) * HEMISPHERE_REPLICATES,
    )

    def trace_rows(task):
        chosen, sequence = task
        return trace_patches(context, source, (chosen, covered[chosen]), sequence, cells)

    done = 0
    for (chosen, sequence), part in zip(tasks, map_in_order(trace_rows, tasks, context.threads), strict=True):
        found.light[chosen], found.element[chosen], found.deviations.values[chosen] = part
        done += len(chosen) * len(sequence) * HEMISPHERE_REPLICATES
        context.progress(source.name, done, found.ray_count, "rays")
    found.light *= unshaded[:, None]
    found.element *= unshaded[:, None]
    return found


def cut_rows(traced, samples, share):
    """Patches, (p,) bool, in parts of some rays, and the points of each replicate of these: list of tuple."""
    sequence, rows = sobol_digits(-(-samples // (share * HEMISPHERE_REPLICATES))), np.flatnonzero(traced)
    step = max(1, RAYS_PER_TASK // (len(sequence) * HEMISPHERE_REPLICATES))
    return [(rows[start : start + step], sequence) for start in range(0, len(rows), step)]


def trace_patches(context, source, some, sequence, cells):
    """Share of a source's light that some patches see: of replicates and of cells, and deviations of the replicates.

    Parameters
    ----------
    context : GatherContext
    source : HorizonBand
    some : tuple of (c,) int and (c, CELL_DIVISIONS²) bool
        The patches, and their covered cells.
    sequence : (r, 4) uint32
        Points of each replicate.
    cells : int
        As in `trace_source`.

    Returns
    -------
    light : (c, HEMISPHERE_REPLICATES) float32
    element : (c, cells) float32
    deviation : (c, cells, HEMISPHERE_REPLICATES) int16
    """
    (chosen, covered), patches, ray_scene = some, context.patches, context.ray_scene
    origins, directions, start_cells = source_rays(patches, source, chosen, sequence, share=context.plan.rays_share)
    hits = ray_scene.trace_places(origins.reshape(-1, 3), directions.reshape(-1, 3))
    fate = np.empty(start_cells.shape, np.uint8)
    upwards = np.ascontiguousarray(np.moveaxis(directions, -1, 0))
    classify_rays(hits.triangle.reshape(fate.shape), upwards, patches.facing, fate)
    fate[fate == FAR_GROUND] = SKY  # at the very horizon
    if context.plan.terrain is not None:
        mark_hidden(fate, upwards, np.sin(np.radians(context.plan.terrain.elevation)), SKY, FAR_GROUND)
    # As of the hemisphere rays: dark inside of what is covered, judged ray by ray along its edge.
    within = np.flatnonzero(covered.any(axis=1))
    mark_dark(fate, within, start_cells, covered[within], enclosed_cells(covered[within]))
    fate[within] = np.where(lie_in_earth(ray_scene, patches, origins[within]), DARK, fate[within])
    if ray_scene.canopy is not None:
        stop_at_leaves(ray_scene, patches, (origins, directions), hits, fate)
    tally = tally_rays(fate, start_cells, cells_near_cover(covered, within), cells)
    return tally.sky, tally.element_sky, tally.deviation


def source_rays(patches, source, chosen, sequence, *, share):
    """Rays from random points of patches towards a source, as `hemisphere_rays` are made, one for `share` of these.

    Returns
    -------
    origins, directions : (c, rays, 3) float32
    cells : (c, rays) uint8
        Of CELL_DIVISIONS², in which each ray starts.
    """
    keys = mix(patches.key[chosen] ^ source.stream)
    digits = sequence[None, None] ^ shift_replicates(keys, patches.rays_before[chosen] // share)[:, :, None]
    numbers = (digits.reshape(len(chosen), -1, 4) * np.float32(2.0**-DIGITS)).astype(np.float32)
    b1, b2 = barycentric_of_square(numbers[..., 0], numbers[..., 1])
    directions = source.sample(patches.normal[chosen], numbers[..., 2], numbers[..., 3])
    return points_of_patches(patches, chosen, b1, b2), directions, cell_of_point(b1, b2, CELL_DIVISIONS)
