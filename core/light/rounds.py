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
from .merge_transfers import SHARES, add_columns, merge_records
from .shadow_points import points_above
from .solve_light import solve_dome, solve_source
from .solve_radiosity import element_factors
from .solve_suns import look_at_block, prepare_suns
from .sun_blocks import block_of_suns
from .trace_all import STAGE, fill_closed_forms
from .trace_gather import SUNS, light_of_surfaces
from .trace_hemisphere import trace_rows
from .traced import SKY_DOME
from .transfer import Transfer


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
    transfer: Transfer  # of the state, with the light of all rounds, but of its matrices only that of the new points
    lights: dict  # as of TracedCity
    annual: Annual


def look_further(found, part, progress, folder):
    """Append rays to what those of a TracedCity met, look at the suns from further points, and solve: Further."""
    clock, context, foliage = Clock(), replace(found.context, progress=progress), found.prepared.plan.foliage
    context.ray_scene.canopy = foliage and foliage.canopy(found.prepared.bare, both=True)
    traced, total, record = found.traced, found.transfer, found.transfer.record
    before, counted = context.ray_scene.thread_seconds, dict(traced.ray_count)
    taken = np.ones(len(total.surfaces) + 1, bool) if part.counted is None else np.append(part.counted, False)
    more = continue_points(context, record.rounds, part, taken[context.owner])
    append_rays(more, traced, part.size, record.rounds)
    fill_closed_forms(context, traced)
    if context.plan.reflections:
        traced.factor = element_factors(context, traced)
    clock.lap(STAGE)
    lights = {SKY_DOME: solve_dome(context, traced)}
    lights |= {source.name: solve_source(context, traced, source.name) for source in context.plan.sources}
    clock.lap("diffuse reflections")
    annual, visible_share, rays = look_from_further(more, traced, found.task.suns, folder)
    annual = add_points(
        found.direct.annual,
        annual,
        np.where(more.patches.receives, part.size / (record.rounds + part.size), 0),
        keys=context.patches.key,
        before=record.rounds * context.points,
        whole=more.full,
        covered=traced.covered_share,
    )
    lights[SUNS] = solve_annual(context, traced, annual)
    light = light_of_surfaces(context, traced, lights, annual)
    reflected = reflected_by_suns(context, traced, annual, lights[SUNS])
    known = total.direct_reflected @ total.suns.weight.astype(np.float32)
    factor = np.divide(reflected, known, out=np.ones(len(known)), where=known > 0)
    scaled = keep_matrix(total.direct_reflected.shape, folder)
    for rows, values in row_blocks(total.direct_reflected):
        np.multiply(values, np.maximum(factor[rows, None], 0).astype(np.float32), out=scaled[rows])
    clock.lap("suns")
    own = replace(
        record,
        hemisphere_rays=traced.ray_count[SKY_DOME] - counted[SKY_DOME],
        source_rays={name: traced.ray_count[name] - counted[name] for name in record.source_rays},
        shadow_rays=rays,
        rounds=part.size,
        seconds=clock.seconds,
        processor_seconds=clock.processor_seconds,
        embree_thread_seconds=context.ray_scene.thread_seconds - before,
        last_bounce_share_diffuse=lights[SKY_DOME].last,
        last_bounce_share_direct=lights[SUNS].last,
        discretisation_error={
            "diffuse": lights[SKY_DOME].discretisation_error,
            "direct": lights[SUNS].discretisation_error,
        },
    )
    transfer = replace(total, **light, visible_share=visible_share, direct_reflected=scaled, record=own)
    return Further(part, transfer, lights, annual)


def continue_points(context, before, part, taken):
    """GatherContext in which some patches, (p,) bool, go on in their sequences of points after `before` rounds."""
    request, patches, count = context.request, context.patches, len(context.patches)
    rays = points_above(max(-(-request.samples // HEMISPHERE_REPLICATES), RAYS_SHARE))
    patches = replace(
        patches,
        receives=patches.receives & taken,
        rays_before=np.full(count, before * rays, np.uint32),
        points_before=np.full(count, before * context.points, np.uint32),
    )
    request = replace(request, shadow_samples=part.size * context.points)
    return replace(context, patches=patches, request=request)


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


def look_from_further(context, traced, suns, folder):
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
    visible_share = keep_matrix((context.patch_to_surface.shape[0], len(suns)), folder)
    by_point, rays = np.zeros((len(context.patches), context.points), np.float32), 0
    task.progress.bounces = 0
    for block in task.blocks:
        task.progress.begin(block)
        shadows = look_at_block(context, task, block, task.progress.report_rays)
        average_surfaces(context.patch_to_surface, shadows.visible_share, context.threads, out=visible_share[:, block])
        by_point += shadows.light_of_points(context.patches.normal, block_of_suns(task.suns, block), context.threads)
        rays += shadows.ray_count
        task.progress.end()
    return sum_suns(context, traced, task.watch, by_point, block_of_suns(task.suns, slice(None))), visible_share, rays


def reflected_by_suns(context, traced, annual, light):
    """Annual light that surfaces receive by reflections, but the first one off the far ground: (n,) float64."""
    reflected = light.by_replicate.mean(axis=1, dtype=float) - annual.light
    return context.patch_to_surface @ (reflected - annual.lit_ground * traced.far_ground.mean(axis=1))


def with_round(found, more):
    """TracedCity with a round: from here on its matrices of surfaces × suns are overwritten."""
    total, transfer, size = found.transfer, more.transfer, more.part.size
    every = total.record.rounds + size
    counted = np.ones(len(total.surfaces), bool) if more.part.counted is None else more.part.counted
    add_columns(total.visible_share, transfer.visible_share, np.where(counted, size / every, 0))
    shares = {name: getattr(transfer.record, name) for name in SHARES}
    record = merge_records(total.record, transfer.record, size / every)
    record = replace(record, degrees_of_freedom=total.record.degrees_of_freedom, **shares)
    transfer = replace(transfer, visible_share=total.visible_share, record=record)
    direct = replace(found.direct, annual=more.annual)
    return replace(found, transfer=transfer, lights=more.lights, direct=direct)
