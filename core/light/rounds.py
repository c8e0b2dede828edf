"""Further rounds of a run: more rays and points of all patches, or of those of some surfaces.

    first round    ─► Traced ─► light of the sky and of the suns' sum, with errors
                        ▲
    further rounds ─────┘  rays and points are appended, and both are solved anew

Every patch goes on in its own sequence of points (`rays.sample_points.sobol_points`), so k rounds are as even as
one of k times the samples. Single suns are not solved again: what surfaces receive of each by reflections is scaled to
the new sum over all suns.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..settings.progress import Clock
from ..sun.horizon import without_hidden
from ..sun.sky_models import RAYS_SHARE
from .annual_light import Annual, add_points, solve_annual, sum_suns
from .kept_matrix import average_surfaces, keep_matrix, row_blocks
from .merge_transfers import add_columns, merge_records
from .shadow_points import points_above
from .solve_radiosity import element_factors
from .solve_suns import look_at_block, prepare_suns
from .sun_blocks import block_of_suns
from .trace_all import STAGE, fill_closed_forms
from .trace_gather import SUNS, light_of_surfaces, shares_of_record, solve_skies
from .trace_hemisphere import trace_rows
from .traced import SKY_DOME
from .transfer import TraceRecord


class Round(NamedTuple):
    """Which part of a run is traced."""

    size: int = 1  # samples, in units of those of the first round; those before are a multiple of it
    counted: np.ndarray | None = None  # (n,) bool, surfaces whose patches are sampled; None: all


def add_round(states, part, progress, folder=None):
    """Trace a further round of a run.

    Surfaces that are left out of a round can be in no later one, since their samples would not go on.

    Parameters
    ----------
    states : list of TracedCity
        By all rounds so far: in leaf and, with deciduous trees, bare. What their rays met and their matrices of
        surfaces × suns are overwritten.
    part : Round
    progress : callable
        See `core.progress`.
    folder : path-like, optional
        As of `trace_gather`.

    Returns
    -------
    list of TracedCity

    Raises
    ------
    CancelledError
        The matrices are as they were, but `states` can take no further round.
    """
    looked = [look_further(one, part, progress, folder) for one in states]
    return [with_round(*one) for one in zip(states, looked, strict=True)]


@dataclass
class Further:
    """What a round adds to one state of a city."""

    part: Round
    lights: dict  # of all rounds, as of TracedCity
    annual: Annual  # likewise
    visible_share: np.ndarray  # (n, s) float32, by the new points
    reflected: np.ndarray  # (n, s) float32, of all rounds
    record: TraceRecord  # of this round


def look_further(found, part, progress, folder):
    """Append rays to what those of a TracedCity met, look at the suns from further points, and solve: Further."""
    clock, traced, record = Clock(), found.traced, found.transfer.record
    context, more = continue_points(found, part, progress)
    counted, seconds = dict(traced.ray_count), context.ray_scene.thread_seconds
    append_rays(more, traced, part.size, record.rounds)
    fill_closed_forms(context, traced)
    if context.plan.reflections:
        traced.factor = element_factors(context, traced)
    clock.lap(STAGE)
    lights = solve_skies(context, traced, None, clock)
    new, visible_share, shadow_rays = look_at_suns(more, traced, found.task.suns, folder)
    annual = add_points(
        found.direct.annual,
        new,
        np.where(more.patches.receives, part.size / (record.rounds + part.size), 0),
        keys=context.patches.key,
        before=record.rounds * context.points,
        whole=more.full,
        covered=traced.covered_share,
    )
    lights[SUNS] = solve_annual(context, traced, annual)
    reflected = scale_reflected(found, annual, lights[SUNS], folder)
    clock.lap("suns")
    rays = {name: count - counted[name] for name, count in traced.ray_count.items()}
    record = replace(
        record,
        **shares_of_record(lights),
        hemisphere_rays=rays.pop(SKY_DOME),
        source_rays=rays,
        shadow_rays=shadow_rays,
        rounds=part.size,
        seconds=clock.seconds,
        processor_seconds=clock.processor_seconds,
        embree_thread_seconds=context.ray_scene.thread_seconds - seconds,
    )
    return Further(part, lights, annual, visible_share, reflected, record)


def continue_points(found, part, progress):
    """GatherContext of a TracedCity, and the same where the patches of a Round go on in their sequences of points."""
    context, foliage = replace(found.context, progress=progress), found.prepared.plan.foliage
    context.ray_scene.canopy = foliage and foliage.canopy(found.prepared.bare, both=True)
    request, patches, count = context.request, context.patches, len(context.patches)
    taken = np.ones(len(context.surfaces), bool) if part.counted is None else part.counted
    taken = np.append(taken, part.counted is None)[context.owner]  # the last one is for the ground
    before, rays = found.transfer.record.rounds, max(-(-request.samples // HEMISPHERE_REPLICATES), RAYS_SHARE)
    patches = replace(
        patches,
        receives=patches.receives & taken,
        rays_before=np.full(count, before * points_above(rays), np.uint32),
        points_before=np.full(count, before * context.points, np.uint32),
    )
    request = replace(request, shadow_samples=part.size * context.points)
    return context, replace(context, patches=patches, request=request, covered=found.traced.covered)


def append_rays(context, traced, size, before):
    """Append to a Traced what further rays of its patches meet that receive light: `size` rounds after `before`."""
    sends = context.patches.receives & (traced.samples > 0)
    most, done = size * int(traced.samples[sends].sum()) // before, 0
    for samples in np.unique(traced.samples[sends]):
        rows, count = np.flatnonzero(sends & (traced.samples == samples)), int(samples) // before * size
        for part in trace_rows(context, rows, count):
            traced.append(part, count)
            done += count * (len(part.rows) + len(part.dark))
            context.progress(STAGE, done, most, "rays")


def look_at_suns(context, traced, suns, folder):
    """Look at all suns from the next points of patches that receive light.

    Returns
    -------
    Annual
        Of these points.
    visible_share : (n, s) float32
    int
        Number of rays.
    """
    task = prepare_suns(context, traced, without_hidden(suns, context.plan.terrain))
    to_surface, normal, threads = context.patch_to_surface, context.patches.normal, context.threads
    visible_share = keep_matrix((to_surface.shape[0], len(suns)), folder)
    by_point, rays = np.zeros((len(normal), context.points), np.float32), 0
    task.progress.bounces = 0
    for block in task.blocks:
        task.progress.begin(block)
        shadows = look_at_block(context, task, block, task.progress.report_rays)
        average_surfaces(to_surface, shadows.visible_share, threads, out=visible_share[:, block])
        by_point += shadows.light_of_points(normal, block_of_suns(task.suns, block), threads)
        rays += shadows.ray_count
        task.progress.end()
    return sum_suns(context, traced, task.watch, by_point, block_of_suns(task.suns, slice(None))), visible_share, rays


def scale_reflected(found, annual, light, folder):
    """Reflected light of each sun so that the sum over all, but the first reflection off the far ground, is that of
    all rounds: (n, s) float32. `annual` and `light` are the suns' Annual and Light."""
    context, matrix = found.context, found.transfer.direct_reflected
    reflected = light.by_replicate.mean(axis=1, dtype=float) - annual.light
    reflected = context.patch_to_surface @ (reflected - annual.lit_ground * found.traced.far_ground.mean(axis=1))
    known = matrix @ found.transfer.suns.weight.astype(np.float32)
    factor = np.maximum(np.divide(reflected, known, out=np.ones(len(known)), where=known > 0), 0).astype(np.float32)
    scaled = keep_matrix(matrix.shape, folder)
    for rows, values in row_blocks(matrix):
        np.multiply(values, factor[rows, None], out=scaled[rows])
    return scaled


def with_round(found, more):
    """TracedCity with a round; its visible shares are overwritten."""
    total, size, counted = found.transfer, more.part.size, more.part.counted
    weight = size / (total.record.rounds + size)
    everywhere = np.full(len(total.surfaces), weight)
    add_columns(total.visible_share, more.visible_share, everywhere if counted is None else weight * counted)
    record = replace(
        merge_records(total.record, more.record, weight),
        **shares_of_record(more.lights),
        degrees_of_freedom=total.record.degrees_of_freedom,
    )
    light = light_of_surfaces(found.context, found.traced, more.lights, more.annual)
    transfer = replace(total, **light, direct_reflected=more.reflected, record=record)
    return replace(found, transfer=transfer, lights=more.lights, direct=replace(found.direct, annual=more.annual))
