"""Further rounds of a run: more rays and points of all patches.

    first round    ─► Traced ─► light of the sky and of the suns' sum, with errors
                        ▲
    further rounds ─────┘  rays and points are appended, and both are solved anew

Every patch goes on in its own sequence of points (`rays.sample_points.sobol_points`), so k rounds
are as even as one of k times the samples; and a round of size k is k of them, solved once. Of
single suns only the first reflection is found again, by the new rays and points, and averaged;
further ones stay as in the first round. What surfaces receive of each sun is then scaled to the new
sum over all suns, which is known better.
"""

from dataclasses import replace

import numpy as np

from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..settings.progress import Clock
from ..sky.sky_models import RAYS_SHARE
from .annual_light import add_points, solve_annual
from .form_factors import leave_rows
from .merge_transfers import add_columns, merge_records
from .shadow_points import points_above
from .solve_radiosity import element_factors
from .solve_suns import prepare_suns, solve_suns
from .sun_matrix import keep_matrix, row_blocks
from .trace_all import STAGE, fill_closed_forms
from .trace_gather import SUNS, light_of_surfaces, shares_of_record, solve_skies, trace_statistics
from .trace_hemisphere import trace_rows


def add_round(city, size, progress, folder=None):
    """Trace a further round of a run.

    Parameters
    ----------
    city : TracedCity
        By all rounds so far. What its rays met and its matrices of surfaces × suns are overwritten.
    size : int
        Samples, in units of the first round's; the number before is a multiple of it.
    progress : callable
        See `core.settings.progress`.
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
    # The tree stays, points follow in the sequences; rays of this round go into the matrix.
    clock, traced, before = (
        Clock(),
        [one.traced for one in city.states],
        city.states[0].transfer.record.rounds,
    )
    context = replace(city.context, progress=progress, covered=traced[0].covered)
    counted, seconds = dict(traced[0].ray_count), context.ray_scene.thread_seconds
    _append_rays(context, traced, size, before)
    # Closed forms and open shares follow from all rays so far.
    for one in traced:
        fill_closed_forms(context, one)
        if context.plan.reflections:
            one.factor = element_factors(context, one)
    clock.lap(STAGE)
    # Light of the sky is solved from all of them, and so is the year's light of the suns. Each
    # sun's first reflection is averaged over rounds, and all that is reflected of it is scaled so
    # that its sum over the suns is as by all rounds.
    lights = [solve_skies(context, one, None, clock) for one in traced]
    direct = _trace_suns(context, city, size, before, folder)
    for state, light, found in zip(city.states, lights, direct, strict=True):
        light[SUNS] = solve_annual(context, state.traced, found.annual)
        if context.bounces:
            _add_first_reflections(state.direct, found.once, size / (before + size))
        found.reflected = _scale_reflected(context, state, found.annual, light[SUNS], folder)
    clock.lap("suns")
    # What this round took is added to the record.
    rays = {name: count - counted[name] for name, count in traced[0].ray_count.items()}
    work, states = trace_statistics(context, (rays, direct[0].ray_count), clock, seconds), []
    for state, light, found in zip(city.states, lights, direct, strict=True):
        states.append(_with_round(context, state, (light, found), size, work))
        work |= {"seconds": {}, "processor_seconds": {}}
    return replace(city, states=states)


def _continue_points(context, before):
    """A GatherContext whose patches go on in their sequences of points, after so many rounds of
    size 1.
    """
    patches, count = context.patches, len(context.patches)
    rays = max(-(-context.request.samples // HEMISPHERE_REPLICATES), RAYS_SHARE)
    patches = replace(
        patches,
        rays_before=np.full(count, before * points_above(rays), np.uint32),
        points_before=np.full(count, before * context.points, np.uint32),
    )
    return replace(context, patches=patches)


def _append_rays(context, traced, size, before):
    """Append what further rays of patches that receive light meet, `size` rounds after `before`, to
    each Traced.
    """
    asked = traced[0].samples // before
    sends = context.patches.receives & (asked > 0)
    most, done = size * int(asked[sends].sum()), 0
    for after in range(before, before + size):
        # The next points of the sequences, for as many rays as each patch had in the first round.
        more = _continue_points(context, after)
        for state in traced:
            if state.form_factors is not None:
                state.form_factors.rounds.append([])
        for samples in np.unique(asked[sends]).tolist():
            for parts in trace_rows(more, np.flatnonzero(sends & (asked == samples)), samples):
                for state, part in zip(traced, parts, strict=True):
                    state.append(part, samples)
                done += samples * (len(parts[0].rows) + len(parts[0].enclosed_rows))
                context.progress(STAGE, done, most, "rays")


def _trace_suns(context, city, size, before, folder):
    """Light of the suns by further points, `size` times as many as in the first round: list of
    SunLight.

    Visible share and first reflection are by these points alone, the annual light by all. Each sun
    is seen from other points of an element each time, and so its first reflection is by all of them
    too.
    """
    traced, suns, total = (
        [one.traced for one in city.states],
        context.plan.without_hidden(city.task.suns),
        [],
    )
    # One set of points after the other, each as large as the first round's.
    annual = [one.direct.annual for one in city.states]
    for done in range(size):
        more = _continue_points(context, before + done)
        # All suns again, seen from the next points; reflections by these points' own rays.
        task = prepare_suns(more, traced, suns)
        task.reflects, task.whole = False, True
        alone = [_with_rays_of(more, one, done - size) for one in traced]
        direct = solve_suns(more, alone, task, [None] * len(traced), folder=folder)
        total = total or direct
        # The year's light is averaged over all points so far; visible shares over this round's.
        for state, (found, new) in enumerate(zip(total, direct, strict=True)):
            annual[state] = add_points(
                annual[state],
                new.annual,
                np.where(context.patches.receives, 1 / (before + done + 1), 0),
                keys=context.patches.key,
                before=(before + done) * context.points,
                whole=context.full,
                covered=context.dark_share(traced[state]),
            )
            # The first set holds its own values already; each further one joins the mean.
            if new is not found:
                for name in ("visible_share", "once"):
                    add_columns(getattr(found, name), getattr(new, name), 1 / (done + 1))
                found.ray_count += new.ray_count
    return [replace(found, annual=own) for found, own in zip(total, annual, strict=True)]


def _with_rays_of(context, traced, index):
    """A Traced whose matrix of form factors has only the rays of one round, from patches of
    surfaces.
    """
    if traced.form_factors is None:
        return traced
    reported = np.diff(context.patch_to_surface.tocsc().indptr) > 0
    rays, alone = np.zeros_like(traced.form_factors.rays), []
    for rows in traced.form_factors.rounds[index]:
        rays[rows.chosen] = rows.rays
        alone.append(leave_rows(rows, reported[rows.chosen]))
    return replace(
        traced, form_factors=replace(traced.form_factors, rounds=[alone], rays=rays, links=None)
    )


def _add_first_reflections(direct, once, share):
    """Average the first reflection of each sun, in a SunLight, with the one by a round, `once`, a
    share of all.
    """
    for rows, values in row_blocks(once):
        change = np.float32(share) * (values - direct.once[rows])
        direct.once[rows] += change
        direct.reflected[rows] += change


def _scale_reflected(context, state, annual, light, folder):
    """Reflected light of each sun, (n, s) float32, scaled so that the sum over all, but the first
    reflection off the far ground, agrees with all rounds. `annual` and `light` are the suns' Annual
    and Light."""
    matrix = state.direct.reflected
    reflected = light.by_replicate.mean(axis=1, dtype=float) - annual.light
    # Reflected light of the year by all rays, without the far ground, over what the matrix of this
    # sum gives.
    reflected = context.patch_to_surface @ (
        reflected - annual.lit_ground * state.traced.far_ground.mean(axis=1)
    )
    known = matrix @ state.transfer.suns.weight.astype(np.float32)
    factor = np.maximum(
        np.divide(reflected, known, out=np.ones(len(known)), where=known > 0), 0
    ).astype(np.float32)
    scaled = keep_matrix(matrix.shape, folder)
    for rows, values in row_blocks(matrix):
        np.multiply(values, factor[rows, None], out=scaled[rows])
    return scaled


def _with_round(context, state, more, size, work):
    """TracedState with a round of this size, whose rays and seconds are `work`, fields of
    TraceRecord.

    `more` are the lights of all rounds, as of TracedState, and the suns' SunLight: its visible
    share is by the new points, all else of it by all. Visible shares of the state are overwritten.
    """
    total, (lights, suns) = state.transfer, more
    record, weight = replace(total.record, rounds=size, **work), size / (total.record.rounds + size)
    add_columns(total.visible_share, suns.visible_share, weight)
    record = replace(
        merge_records(total.record, record, weight),
        **shares_of_record(context, lights),
        degrees_of_freedom=total.record.degrees_of_freedom,
    )
    light = light_of_surfaces(context, state.traced, lights, suns.annual)
    transfer = replace(total, **light, direct_reflected=suns.reflected, record=record)
    return replace(
        state, lights=lights, direct=replace(state.direct, annual=suns.annual), transfer=transfer
    )
