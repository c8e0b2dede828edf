"""Light of a traced city with another number of reflections, or under another sky, as an edit of it
asks for.
"""

from dataclasses import replace

from ..settings.progress import Clock, silent
from ..settings.request import BEST_SKY
from .annual_light import solve_annual
from .change_suns import solve_known_suns
from .editable_city import EditableCity, prepare_decided, trace_editable
from .specular_light import specular_of
from .sun_blocks import SunProgress
from .trace_gather import (
    SUNS,
    TracedCity,
    TracedState,
    make_transfer,
    solve_skies,
    trace_statistics,
)
from .transfer import variance_of_mean


def match_light(base, sky, bounces, progress=silent):
    """Give a city this number of reflections, under this sky: the EditableCity itself if it has
    both.

    Parameters
    ----------
    base : EditableCity
    sky : str
    bounces : int
    progress : callable, optional
        See `core.settings.progress`.
    """
    if sky != base.decisions.plan["sky"]:
        base = _with_sky(base, sky, progress)
    return with_reflections(base, bounces, progress) if bounces != base.decisions.bounces else base


def with_reflections(base, bounces, progress=silent):
    """Solve a city with another number of reflections, by what its rays and suns met: EditableCity.

    Parameters
    ----------
    base : EditableCity
    bounces : int
    progress : callable, optional
        See `core.settings.progress`.
    """
    # Another number of reflections, everything else as traced.
    old, clock = base.city, Clock()
    prepared = replace(old.prepared, bounces=bounces)
    # Without the layout of modules what their strings lose is not computed again.
    context = replace(old.context, bounces=bounces, progress=progress, layout=None)
    suns_progress = SunProgress(progress, len(old.task.suns), int(context.reflections))
    task = replace(old.task, progress=suns_progress, bits=old.bits.unpack())
    # Sky and suns are solved again from what rays met; none is traced.
    traced, specular = [state_traced.traced for state_traced in old.states], specular_of(prepared)
    hooks = [
        specular and specular(context, state_traced, state)
        for state, state_traced in enumerate(traced)
    ]
    lights = [
        solve_skies(context, state_traced, hook, clock)
        for state_traced, hook in zip(traced, hooks, strict=True)
    ]
    direct = solve_known_suns(context, traced, task, hooks)
    for light, state in zip(direct, old.states, strict=True):
        light.string_loss = state.direct.string_loss  # depends on shadows alone
    context.layout = old.context.layout
    clock.lap("suns")
    task, record = replace(task, bits=None), old.transfer.record
    city = TracedCity(prepared, context, task, [], old.cramped, old.bits)
    common = trace_statistics(context, (traced[0].ray_count, record.shadow_rays), clock, 0.0) | {
        "interrupted": None
    }
    # A Transfer for each state of trees, as after tracing.
    for state, hook in zip(
        map(TracedState, traced, lights, direct, [None] * len(traced)), hooks, strict=True
    ):
        state.lights[SUNS] = solve_annual(context, state.traced, state.direct.annual)
        if hook:
            error = state.lights[SUNS].error
            error.own = error.own + variance_of_mean(state.direct.specular.T)
        state.transfer = make_transfer(city, state, base.suns, common, None)
        if state.traced.form_factors is not None:
            state.traced.form_factors.links = None  # large
        city.states.append(state)
        common |= {"seconds": {}, "processor_seconds": {}}
    # All suns were solved, so no guess of earlier edits is left.
    return EditableCity(base.suns, base.request, city, base.rows)


def _with_sky(base, sky, progress):
    """Trace a city wholly under another sky, with the same keys, since Perez's has rays to the
    horizon: EditableCity.
    """
    known = base.decisions
    known = replace(
        known, on=known.on | {BEST_SKY: sky != "isotropic"}, plan=known.plan | {"sky": sky}
    )
    prepared = prepare_decided(known, base.city.prepared.scene, base.request, progress)
    traced_again = trace_editable(prepared, base.suns, base.request, progress)
    return replace(traced_again, rows=base.rows)
