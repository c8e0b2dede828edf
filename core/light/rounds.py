"""Further rounds of a run: more rays and points of all patches, or of those of some surfaces.

    first round    ─► Traced ─► light of the sky and of the suns' sum, with errors
                        ▲
    further rounds ─────┘  rays and points are appended, and both are solved anew

Every patch goes on in its own sequence of points (`rays.sample_points.sobol_points`), so k rounds are as even as
one of k times the samples. Single suns are not solved again: what surfaces receive of each by reflections is scaled to
the new sum over all suns.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..settings.progress import Clock
from ..sun.horizon import without_hidden
from ..sun.sky_models import RAYS_SHARE
from .annual_light import add_points, solve_annual
from .kept_matrix import keep_matrix, row_blocks
from .merge_transfers import add_columns, merge_records
from .shadow_points import points_above
from .solve_radiosity import element_factors
from .solve_suns import prepare_suns, solve_suns
from .trace_all import STAGE, fill_closed_forms
from .trace_gather import SUNS, light_of_surfaces, shares_of_record, solve_skies, tell_work
from .trace_hemisphere import trace_rows


class Round(NamedTuple):
    """Which part of a run is traced."""

    size: int = 1  # samples, in units of those of the first round; those before are a multiple of it
    counted: np.ndarray | None = None  # (n,) bool, surfaces whose patches are sampled; None: all


def add_round(city, part, progress, folder=None):
    """Trace a further round of a run.

    Surfaces that are left out of a round can be in no later one, since their samples would not go on.

    Parameters
    ----------
    city : TracedCity
        By all rounds so far. What its rays met and its matrices of surfaces × suns are overwritten.
    part : Round
    progress : callable
        See `core.progress`.
    folder : path-like, optional
        As of `trace_gather`.

    Returns
    -------
    TracedCity

    Raises
    ------
    CancelledError
        The matrices are as they were, but `city` can take no further round.
    """
    clock, traced, before = Clock(), [one.traced for one in city.states], city.states[0].transfer.record.rounds
    context, more = continue_points(city, part, before, progress)
    counted, seconds = dict(traced[0].ray_count), context.ray_scene.thread_seconds
    append_rays(more, traced, part.size, before)
    for one in traced:
        fill_closed_forms(context, one)
        if context.plan.reflections:
            one.factor = element_factors(context, one)
    clock.lap(STAGE)
    lights = [solve_skies(context, one, None, clock) for one in traced]
    task = prepare_suns(more, traced, without_hidden(city.task.suns, context.plan.terrain))
    task.reflects, task.whole = False, True
    direct = solve_suns(more, traced, task, [None] * len(traced), folder=folder)
    for state, light, found in zip(city.states, lights, direct, strict=True):
        found.annual = add_points(
            state.direct.annual,
            found.annual,
            np.where(more.patches.receives, part.size / (before + part.size), 0),
            keys=context.patches.key,
            before=before * context.points,
            whole=more.full,
            covered=state.traced.covered_share,
        )
        light[SUNS] = solve_annual(context, state.traced, found.annual)
        found.reflected = scale_reflected(context, state, found.annual, light[SUNS], folder)
    clock.lap("suns")
    rays = {name: count - counted[name] for name, count in traced[0].ray_count.items()}
    work, states = tell_work(context, (rays, direct[0].ray_count), clock, seconds), []
    for state, light, found in zip(city.states, lights, direct, strict=True):
        states.append(with_round(context, state, (light, found), part, work))
        work |= {"seconds": {}, "processor_seconds": {}}
    return replace(city, states=states)


def continue_points(city, part, before, progress):
    """GatherContext of a TracedCity, and the same where the patches of a Round go on in their sequences of points.

    `before` is the number of rounds so far.
    """
    context = replace(city.context, progress=progress)
    request, patches, count = context.request, context.patches, len(context.patches)
    taken = np.ones(len(context.surfaces), bool) if part.counted is None else part.counted
    taken = np.append(taken, part.counted is None)[context.owner]  # the last one is for the ground
    rays = max(-(-request.samples // HEMISPHERE_REPLICATES), RAYS_SHARE)
    patches = replace(
        patches,
        receives=patches.receives & taken,
        rays_before=np.full(count, before * points_above(rays), np.uint32),
        points_before=np.full(count, before * context.points, np.uint32),
    )
    request = replace(request, shadow_samples=part.size * context.points)
    return context, replace(context, patches=patches, request=request, covered=city.states[0].traced.covered)


def append_rays(context, traced, size, before):
    """Append what further rays of patches that receive light meet, `size` rounds after `before`, to each Traced."""
    asked = traced[0].samples
    sends = context.patches.receives & (asked > 0)
    most, done = size * int(asked[sends].sum()) // before, 0
    for one in traced:
        if one.form_factors is not None:
            one.form_factors.rounds.append([])
    for samples in np.unique(asked[sends]):
        rows, count = np.flatnonzero(sends & (asked == samples)), int(samples) // before * size
        for parts in trace_rows(context, rows, count):
            for one, part in zip(traced, parts, strict=True):
                one.append(part, count)
            done += count * (len(parts[0].rows) + len(parts[0].dark))
            context.progress(STAGE, done, most, "rays")


def scale_reflected(context, state, annual, light, folder):
    """Reflected light of each sun so that the sum over all, but the first reflection off the far ground, is that of
    all rounds: (n, s) float32. `annual` and `light` are the suns' Annual and Light."""
    matrix = state.transfer.direct_reflected
    reflected = light.by_replicate.mean(axis=1, dtype=float) - annual.light
    reflected = context.patch_to_surface @ (reflected - annual.lit_ground * state.traced.far_ground.mean(axis=1))
    known = matrix @ state.transfer.suns.weight.astype(np.float32)
    factor = np.maximum(np.divide(reflected, known, out=np.ones(len(known)), where=known > 0), 0).astype(np.float32)
    scaled = keep_matrix(matrix.shape, folder)
    for rows, values in row_blocks(matrix):
        np.multiply(values, factor[rows, None], out=scaled[rows])
    return scaled


def with_round(context, state, more, part, work):
    """TracedState with a Round, whose rays and seconds are `work`, fields of TraceRecord.

    `more` are the lights of all rounds, as of TracedState, and the suns' SunLight: its visible share is by the new
    points, all else of it by all. Visible shares of the state are overwritten.
    """
    total, (lights, suns) = state.transfer, more
    record, weight = replace(total.record, rounds=part.size, **work), part.size / (total.record.rounds + part.size)
    everywhere = np.full(len(total.surfaces), weight)
    add_columns(total.visible_share, suns.visible_share, everywhere if part.counted is None else weight * part.counted)
    record = replace(
        merge_records(total.record, record, weight),
        **shares_of_record(lights),
        degrees_of_freedom=total.record.degrees_of_freedom,
    )
    light = light_of_surfaces(context, state.traced, lights, suns.annual)
    transfer = replace(total, **light, direct_reflected=suns.reflected, record=record)
    return replace(state, lights=lights, direct=replace(state.direct, annual=suns.annual), transfer=transfer)
