"""Light of an edited city by the change alone.

    rays      of all patches are made again and cut with boxes around the change; where one ends at
              another triangle
              the row of its patch is traced anew, as are rows of new patches and of those that are
              near
    shadows   each patch looks again at the suns before which a changed triangle stands
    light     of the sky and of the suns' sum is solved on these rows; of single suns the first
              reflection of the
              change is exact, and further ones have the pattern that the base's have over the suns

The edited scene traced wholly, with the same keys, gives the same rows, bits and sums. What no
change reaches keeps its numbers.
"""

from dataclasses import fields, is_dataclass, replace

import numpy as np

from ..effects.beyond_scene import sky_of_surfaces
from ..settings.errors import InputError
from ..settings.progress import Clock, silent
from ..settings.threads import map_in_order
from .annual_light import light_unshaded, solve_annual, sum_suns
from .change_modules import change_losses, lay_changed
from .change_rays import find_changed_rows, find_shadowed
from .change_suns import EACH_SUN, Edit, change_suns, with_first_days
from .compact_city import compact_city
from .editable_city import EditableCity, prepare_decided
from .form_factors import LARGEST_KEY, FormFactors, leave_rows
from .match_light import match_light, with_reflections
from .measure_cover import choose_left_out, find_cover, find_cramped, list_clearances
from .packed_bits import pack_bits
from .shadow_points import KnownPoints, find_points
from .solve_radiosity import element_factors
from .solve_suns import SunLight, prepare_suns
from .specular_light import specular_of
from .sun_blocks import block_of_suns
from .sun_visibility import Shadows, see_all, trace_points, weigh_points
from .trace_all import ask_samples, fill_closed_forms, prepare_gather
from .trace_gather import (
    SUNS,
    TracedCity,
    TracedState,
    choose_bounces,
    make_transfer,
    solve_skies,
    trace_statistics,
)
from .trace_hemisphere import trace_rows
from .traced import SKY_DOME, Traced, no_light
from .transfer import variance_of_mean

STAGE = "what the change reaches"


def trace_change(base, change, request=None, progress=silent, preview=None):
    """Trace an edited city from a traced one.

    Parameters
    ----------
    base : EditableCity
    change : SceneChange
        Of its scene.
    request : Request, optional
        With other materials than the base's.
    progress : callable, optional
        See `core.settings.progress`.
    preview : callable, optional
        `preview(diffuse, direct)` gets the light of the edited city's surfaces per DHI, and per DNI
        as the sum over the suns by their weights, both (k,), before each sun is solved; with
        deciduous trees first in leaf, then bare.

    Returns
    -------
    EditableCity
        Where the city asks for more reflections than the base has, or for another sky, `before` is
        the base with these.

    Raises
    ------
    CancelledError
    InputError
        The base was interrupted, or the city has more patches than what rays met can name.
    """
    # An interrupted base is refused. A sound one may need light of another sky first, so that both
    # can be compared.
    if base.city.transfer.record.interrupted:
        raise InputError("the base", "its run was interrupted", "trace it again, to the end")
    clock, given, request = Clock(), base, request or base.request
    sky = sky_of_surfaces(request, change.scene.surfaces)
    base = match_light(base, sky, base.decisions.bounces, progress)
    old = base.city
    # The edited scene by the base's decisions; rays of rows that the change touches are traced
    # anew.
    prepared = prepare_decided(base.decisions, change.scene, request, progress).build_tree(request)
    prepared = replace(prepared, editable=True, rules=old.prepared.rules)
    context = _continue_gather(prepare_gather(prepared, request, progress), old.context)
    clock.lap("plan and tree")
    progress(STAGE, 0, 3, "steps")
    edit = _trace_rows(old, context, change, prepared.scene, progress)
    clock.lap("sky and reflections")
    # Then suns are looked at again from points that the change may shade.
    _look_again(edit, context.plan.without_hidden(base.suns), change)
    progress(STAGE, 3, 3, "steps")
    clock.lap("shadows")
    # A brighter city may ask for more reflections: the base then gets them too.
    if context.reflections and not context.plan.max_bounces:
        asked, _ = choose_bounces(prepared, context, edit.traced[0], with_first_days(edit.task))
        if asked > context.bounces:
            base = with_reflections(base, asked, progress)
            edit.before, context.bounces = base.city, asked
    # Light of the year in each state of trees; a preview can be shown before suns are solved.
    specular = specular_of(prepared)
    for state, traced in enumerate(edit.traced):
        hook, annual = specular and specular(context, traced, state), _sum_annual(edit, state)
        light = solve_skies(context, traced, hook, clock)
        light[SUNS] = solve_annual(context, traced, annual)
        if preview:
            preview(light[SKY_DOME].mean[change.rows], light[SUNS].mean[change.rows])
        edit.hooks.append(hook)
        edit.lights.append(light)
        edit.direct.append(SunLight(None, None, len(base.suns), annual=annual))
    clock.lap("annual light")
    progress(EACH_SUN, 0, 1, "steps")
    # Reflected light of each sun follows from what changed; rows that are gone are dropped if many.
    drift = change_suns(edit, base.drift)
    progress(EACH_SUN, 3, 4, "steps")
    # Modules and what their strings lose ask for no light, and a preview need not wait for them.
    lay_changed(edit, prepared)
    change_losses(edit)
    progress(EACH_SUN, 4, 4, "steps")
    clock.lap("suns")
    city = _make_city(edit, prepared, base.suns, clock, change)
    edited = EditableCity(base.suns, request, city, change.rows, drift)
    gone = len(context.surfaces) - len(change.rows)
    # When more than a tenth of the surfaces are gone, all get new numbers.
    edited = compact_city(edited) if gone > 0.1 * len(change.rows) else edited
    # Where the base was solved anew, for another sky or more reflections, it is returned along.
    return replace(edited, before=None if base is given else base)


def _make_city(edit, prepared, suns, clock, change):
    """TracedCity with the Transfer of the edited city, where what no change reaches has the numbers
    of before.
    """
    context = edit.context
    bits = pack_bits(edit.task.bits)
    city = TracedCity(prepared, context, replace(edit.task, bits=None), [], edit.cramped, bits)
    counts = edit.traced[0].ray_count, edit.traced_pairs * context.points
    common = trace_statistics(context, counts, clock, 0.0) | {"interrupted": None}
    for state, parts in enumerate(zip(edit.traced, edit.lights, edit.direct, strict=True)):
        made, before = TracedState(*parts, transfer=None), edit.state_before(state)
        if any(edit.hooks):
            error = made.lights[SUNS].error
            error.own = error.own + variance_of_mean(made.direct.specular.T)
        made.transfer = make_transfer(city, made, suns, common, None)
        _keep_numbers(before, made, _unreached(before, made, edit, change))
        if made.traced.form_factors is not None:
            made.traced.form_factors.links = None  # large
        city.states.append(made)
        common |= {"seconds": {}, "processor_seconds": {}}
    return city


def _continue_gather(context, old):
    """The context with the elements by which hits of the city before are named.

    Raises
    ------
    InputError
        Keys have no room for so many patches.
    """
    count, most = len(context.patches), LARGEST_KEY + 1
    if context.reflections and count * old.elements * old.start_elements * 4 > most:
        raise InputError(
            "the edited city",
            f"has {count:,} patches, too many for what the base's rays met",
            "trace it by citypv simulate --editable",
        )
    return replace(context, elements=old.elements, start_elements=old.start_elements)


def _trace_rows(old, context, change, scene, progress):
    """What the rays of the edited city met, traced anew where the edit changes it and else taken
    from `old`, the TracedCity before: Edit.
    """
    # Patches to trace anew: what is new, near the change, or asks for more or fewer rays than it
    # had.
    patches, first, states = context.patches, change.first, context.ray_scene.states
    before = [old.states[min(state, len(old.states) - 1)].traced for state in range(states)]
    count, sent = len(patches), before[0].samples
    samples = ask_samples(context)
    todo = change.near.copy()
    todo[first:] = True
    todo[:first] |= samples[:first] != sent
    # All others that sent rays are asked whether one of these ends elsewhere now.
    rest = np.flatnonzero(~todo[:first] & (sent > 0) & ~before[0].covered.all(axis=1))
    reached = find_changed_rows(old.context, context.ray_scene, patches, (rest, sent[rest]), change)
    progress(STAGE, 1, 3, "steps")
    todo[reached] = True
    # The room for modules and cover change on these rows only. Where a surface then leaves out
    # other cells, its rows are traced anew as well.
    cramped = _find_cramped(old, context, scene, todo & patches.receives)
    context.left_out = choose_left_out(scene, context.patch_to_surface, context.request, cramped)
    todo[:first] |= context.left_out[:first] != old.context.left_out
    todo &= patches.receives
    progress(STAGE, 1.2, 3, "steps")
    covered = _find_cover(context, before[0].covered, todo)
    progress(STAGE, 1.4, 3, "steps")
    # Rows of patches that are gone become dark; their entries of the matrix fall out, all others
    # are kept.
    dead = np.flatnonzero(~patches.receives)
    lost = todo.copy()
    lost[dead] = True
    traced = []
    for traced_state in before:
        new = Traced.empty(context)
        _copy_rows(new, traced_state, first)
        new.ray_count = dict.fromkeys(new.first, 0)
        if context.reflections:
            kept = [leave_rows(rows, ~lost[rows.chosen]) for rows in traced_state.form_factors.rows]
            kept = [rows for rows in kept if len(rows.chosen)]
            new.form_factors = FormFactors(
                [kept], count, context.elements, np.zeros(count, np.int32), context.start_elements
            )
            new.form_factors.rays[:first] = np.where(
                lost[:first], 0, traced_state.form_factors.rays
            )
        new.samples[todo] = samples[todo]
        for light in new.first.values():
            light.put(dead, no_light(len(dead), context.elements))
        new.far_ground[dead], new.element_far_ground[dead], new.open_share[dead] = 0, 0, 0
        new.covered[dead], new.samples[dead] = True, 0
        traced.append(new)
    # Rows with as many rays as each other are traced together, some at a time: a newer edit may
    # stop it.
    city = replace(context, covered=covered)
    for number in np.unique(samples[todo & (samples > 0)]):
        rows = np.flatnonzero(todo & (samples == number))
        for some in np.array_split(rows, -(-len(rows) // 2048)):
            progress(STAGE, 1.5, 3, "steps")
            for parts in trace_rows(city, some, int(number)):
                for traced_state, part in zip(traced, parts, strict=True):
                    traced_state.put(part)
    # What a closed form gives is filled in, as in any run.
    for traced_state in traced:
        fill_closed_forms(context, traced_state)
        if context.reflections:
            traced_state.factor = element_factors(context, traced_state)
    progress(STAGE, 2, 3, "steps")
    return Edit(old, context, traced, todo, cramped=cramped)


def _find_cover(context, known, todo):
    """Which cells of patches are covered in the edited city: (p, c) bool.

    Patches to be traced anew, `todo`, (p,) bool, are asked. Whether a place is enclosed may follow
    from what rays meet after several faces: where it changes, the rest of the surface is asked too,
    and what changes is added to `todo`.
    """
    patches, owner = context.patches, context.owner
    covered = np.concatenate([known, np.zeros((len(patches) - len(known), known.shape[1]), bool)])
    asked = todo.copy()
    while asked.any():
        covered_anew = find_cover(context.ray_scene, patches, asked, context.threads)
        # Patches whose cover changed; of their surfaces all other patches are asked next.
        turned = asked & (covered_anew != covered).any(axis=1)
        covered[asked] = covered_anew[asked]
        todo |= turned
        old = turned[: len(known)]
        also = np.isin(owner, np.unique(owner[: len(known)][old & (owner[: len(known)] >= 0)]))
        asked = also & patches.receives & ~todo & ~asked
    return covered


def _copy_rows(new, old, count):
    """Copy what is known of the first patches from one Traced, or a part of it, to another."""
    for field in fields(new):
        value, known = getattr(new, field.name), getattr(old, field.name)
        if isinstance(value, np.ndarray) and value.ndim and field.name != "unit":
            value[:count] = known
    if hasattr(new, "first"):
        for name, light in new.first.items():
            if is_dataclass(light):
                _copy_rows(light, old.first[name], count)


def _look_again(edit, suns, change):
    """Find out which points see which suns in the edited city.

    Written to the Edit: `task` with its bits, `touched` (patches whose bits differ from before, or
    do not hold) and `traced_pairs`.
    """
    old, context, traced = edit.before, edit.context, edit.traced
    patches, first = context.patches, change.first
    task = prepare_suns(context, traced, suns)
    watch, known = task.watch, old.task.watch
    # Bits hold no longer where a patch is new, where other cells of it are covered or left out, or
    # where it needs shadow rays now and did not before, or the other way round.
    anew = np.ones(len(patches), bool)
    anew[:first] = (traced[0].covered[:first] != old.states[0].traced.covered).any(axis=1)
    anew[:first] |= context.left_out[:first] != old.context.left_out
    anew[:first] |= (watch.traced[:first] != known.traced) | (
        watch.unobstructed[:first] != known.unobstructed
    )
    # Bits of points that see suns stay as before, but for what is new.
    edit.bits = old.bits.unpack()
    states, (_, _, words, count) = context.ray_scene.states, edit.bits.shape
    bits = np.zeros((states, len(patches), words, count), np.uint16)
    for state in range(states):
        bits[state, :first] = edit.bits_before(state)
    bits[:, anew] = 0
    task.bits = bits
    # Points and what they look at: suns that a changed triangle may shade, and all suns for what is
    # new.
    counts = context.points, context.elements
    watch.points = _extend_points(
        known.points, patches, watch, counts, anew & (watch.traced | watch.unobstructed)
    )
    block = block_of_suns(suns, slice(None))
    lit = context.plan.lit(block.directions)
    asked = np.zeros((len(patches), count), bool)
    rows = np.flatnonzero(watch.traced & ~anew)
    asked[rows] = find_shadowed(watch, rows, block.directions, change)
    context.progress(STAGE, 2.5, 3, "steps")
    asked[watch.traced & anew] = True
    asked &= lit  # suns above the terrain only
    # New points that nothing shades see all suns in front of them, without rays.
    see_all(watch, np.flatnonzero(watch.unobstructed & anew), block.directions, bits)
    # Shadow rays for these pairs of patch and sun only.
    looking = asked.any(axis=1)
    rows = np.flatnonzero(looking)
    tasks = [rows[k : k + 1024] for k in range(0, len(rows), 1024)]
    for _ in map_in_order(
        lambda one: trace_points(watch, one, block, bits, asked[one]), tasks, context.threads
    ):
        context.progress(STAGE, 2.7, 3, "steps")
    # Rows that see suns otherwise now.
    touched = anew.copy()
    rows = np.flatnonzero(looking[:first] & ~anew[:first])
    for state in range(states):
        touched[rows] |= (bits[state, rows] != edit.bits_before(state)[rows]).any(axis=(1, 2))
    edit.task, edit.touched, edit.traced_pairs = task, touched, int(asked.sum())


def _extend_points(known, patches, watch, counts, wanted):
    """Points of the patches before, and of those that are wanted anew: KnownPoints."""
    rows = np.flatnonzero(wanted)
    points_anew = find_points(
        patches, watch.covered, counts, wanted, threads=watch.threads, left_out=watch.left_out
    )
    for new, old in zip(points_anew, known, strict=True):
        kept = np.ones(len(old), bool)
        kept[rows[rows < len(old)]] = False
        new[: len(old)][kept] = old[kept]
    return KnownPoints(*points_anew)


def _sum_annual(edit, state):
    """Annual light of patches of the edited city in one state of trees: Annual."""
    context, task = edit.context, edit.task
    # Of light that is left out the sums of before do not hold what elements pass on.
    watch, rows = task.watch, np.flatnonzero(edit.touched | (context.left_out != 0))
    by_point = np.zeros((len(edit.touched), context.points), np.float32)
    known = edit.state_before(state).direct.annual
    by_point[: len(known.by_point)] = known.by_point
    weight = weigh_points(watch)
    block = block_of_suns(task.suns, slice(None))
    points = KnownPoints(*(part[rows] for part in watch.points))
    shadows = Shadows(task.bits[state][rows], points, weight[rows], 0)
    by_point[rows] = shadows.light_of_points(context.patches.normal[rows], block, context.threads)
    # What stands before a patch changes, not how it faces the suns.
    new = context.patches.take(np.arange(len(known.unshaded), len(by_point)))
    unshaded = np.append(known.unshaded, light_unshaded(new, block, context.threads))
    return sum_suns(context, edit.traced[state], watch, by_point, block, unshaded=unshaded)


def _find_cramped(old, context, scene, asked):
    """Cells of patches without room for modules, (p, k) uint64: as before, but anew for patches
    that are asked.
    """
    how = {"clearances": list_clearances(context.request), "threads": context.threads}
    cramped = find_cramped(context.ray_scene, context.patches, scene, asked=asked, **how)
    kept = np.flatnonzero(~asked[: len(old.cramped)])
    cramped[kept] = np.where(context.patches.receives[kept, None], old.cramped[kept], 0)
    return cramped


def _unreached(before, made, edit, change):
    """Surfaces of the city before whose light no change reaches: (n,) bool."""
    count = len(before.transfer.surfaces)
    unreached = np.zeros(len(made.transfer.surfaces) + 1, bool)
    unreached[change.rows[change.rows < count]] = True
    unreached[edit.context.owner[edit.anew | edit.touched]] = False
    unreached = unreached[:-1]  # the ground's -1 took the last one
    for name, light in made.lights.items():
        old, new = before.lights[name].mean, light.mean[:count]
        # What changes by less than 2⁻²² of itself is the same in single precision.
        unreached[:count] &= np.abs(new - old) <= 2.0**-22 * np.abs(old)
    unreached[:count] &= (
        before.transfer.surfaces.eligible == made.transfer.surfaces.eligible[:count]
    )
    # What an earlier edit guessed of single suns is not kept once they are solved.
    apart = np.abs(made.direct.reflected[:count] - before.direct.reflected).max(axis=1, initial=0)
    unreached[:count] &= apart <= 1e-4 * before.direct.reflected.max(axis=1, initial=0)
    return unreached


def _keep_numbers(before, made, rows):
    """Give surfaces, (n,) bool, the numbers that they had before the edit."""
    rows = np.flatnonzero(rows)
    _keep_fields(before.transfer, made.transfer, rows)
    for part in ("error_parts",):
        _keep_fields(getattr(before.transfer, part), getattr(made.transfer, part), rows)
    for name, light in made.transfer.sources.items():
        _keep_fields(before.transfer.sources[name], light, rows)
    for name, light in made.lights.items():
        light.mean[rows] = before.lights[name].mean[rows]


def _keep_fields(old, new, rows):
    for field in fields(new):
        value = getattr(new, field.name)
        known = getattr(old, field.name)
        if isinstance(value, np.ndarray) and known is not None and field.name != "clearances":
            value[rows] = known[rows]
