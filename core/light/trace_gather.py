"""From a scene and its suns to the Transfer: the gather estimator."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy import sparse

from ..effects.effect import Measured
from ..patches.read_albedo import materials_of_surfaces
from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..settings.errors import InputError
from ..settings.progress import Clock
from .annual_light import solve_annual
from .form_factor_products import multiply, multiply_elements
from .measure_cover import (
    average_room,
    choose_left_out,
    find_cramped,
    list_clearances,
    share_without_room,
)
from .packed_bits import PackedBits, pack_bits
from .prepare_scene import PreparedScene, check_tracing, prepare_scene
from .shadow_points import WORD
from .solve_light import solve_light
from .solve_radiosity import covariance_of_replicates, find_bounces, radiosity_factor
from .solve_suns import SunLight, SunTask, light_of_first_days, prepare_suns, solve_suns
from .string_shade import lay_traced
from .sun_blocks import check_room
from .taken_parts import find_taken
from .trace_all import GatherContext, prepare_gather, trace_all
from .traced import SKY_DOME, Traced
from .transfer import (
    ErrorParts,
    SourceLight,
    TraceRecord,
    Transfer,
    note_interruption,
    variance_of_mean,
)

SUNS = "suns"  # the name of their light, summed by their weights


@dataclass
class TracedState:
    """What the rays and suns of a run met in one state of its trees, and what follows from it."""

    traced: Traced
    lights: dict  # of the sky, of each source by its name, and of all suns together: Light
    direct: SunLight
    transfer: Transfer

    @property
    def of_surfaces(self):
        """Light under the sky, per DHI, and under all suns by their weights, per DNI: (n, 2)
        float64.
        """
        return np.column_stack([self.lights[name].mean for name in (SKY_DOME, SUNS)])


@dataclass
class TracedCity:
    """What the rays and suns of a run met, and what follows from it."""

    prepared: PreparedScene
    context: GatherContext
    task: SunTask
    states: list  # of TracedState: in leaf and, where trees lose their leaves, bare
    cramped: np.ndarray  # (p, k) uint64, of `find_cramped` at `list_clearances`
    bits: PackedBits | None = None  # of SunTask, where the city can be edited

    @property
    def transfer(self):
        """Transfer in leaf, with the bare state as its `bare`."""
        return join_seasons([state.transfer for state in self.states], self.prepared.plan.foliage)


def trace_gather(scene, suns, request, progress, folder=None, *, prepared=None, specular=None):
    """Trace a scene.

    Parameters
    ----------
    scene : Scene
    suns : Suns
    request : Request
    progress : callable
        See `core.settings.progress`.
    folder : path-like, optional
        Where matrices of surfaces × suns lie that are too large for the memory.
    prepared : PreparedScene, optional
        Of the scene, where it is known already.
    specular : callable, optional
        `specular(context, traced, state)` gives the light by way of mirrors, glossy faces and
        glass: `of_sky` and `of_suns`, see `light.specular_light`. Needed if the plan has such
        light.

    Returns
    -------
    Transfer
        `record` has what was decided, how many rays were traced and how long each stage took. If
        cancelled after some suns (see `core.settings.progress`), `suns` are those that were traced,
        and `record.interrupted` says so.

    Raises
    ------
    CancelledError
        Cancelled before any sun could be used.
    InputError
        If a number, an array or a setting is invalid; raised before any ray is traced.
    """
    check_tracing(scene, suns, request)
    prepared = prepared or prepare_scene(scene, request, suns=suns)
    if prepared.plan["specular"].on and specular is None:
        raise InputError(
            "trace_gather",
            "a material is a mirror, glossy or glass, which gather alone does not follow",
            "use trace_hybrid",
        )
    return trace_light(prepared, suns, request, progress, folder, specular=specular).transfer


def trace_light(prepared, suns, request, progress, folder=None, *, specular=None):
    """Trace a prepared scene under unchecked suns, as `trace_gather` does: TracedCity."""
    clock = Clock()
    # A city that needs more memory than is free is refused. Patches, tree, and where modules have
    # no room.
    check_room(prepared, suns, request)
    context = prepare_gather(prepared, request, progress)
    plan, ray_scene = context.plan, context.ray_scene
    traced_before = ray_scene.thread_seconds  # by earlier rounds with the same tree
    clock.lap("plan and tree")
    cramped = find_cramped(
        ray_scene,
        context.patches,
        prepared.scene,
        clearances=list_clearances(request),
        threads=context.threads,
    )
    context.left_out = choose_left_out(prepared.scene, context.patch_to_surface, request, cramped)
    clock.lap("room for modules")
    # Rays from all patches: what they meet gives sky light and the matrix of form factors.
    traced = trace_all(context)
    clock.lap("sky and reflections")
    # A sun behind the terrain gets no weight, so that errors are about the light that counts; it is
    # still traced where an hour that it represents is in the open.
    task, left = prepare_suns(context, traced, plan.without_hidden(suns)), None
    # A city that can be edited keeps which points see which suns, a bit for each.
    if context.editable:
        words, states = -(-context.points // WORD), ray_scene.states
        task.bits = np.zeros((states, len(context.patches), words, len(task.suns)), np.uint16)
    lay_traced(prepared, context, traced[0], cramped)
    clock.lap("modules")
    # As many reflections as it takes until what is left is small.
    if plan.reflections and not context.bounces:
        context.bounces, left = choose_bounces(prepared, context, traced[0], task)
        clock.lap("number of reflections")
    # Light of sky and of suns with reflections, and by mirrors where there are any.
    hooks = [specular and specular(context, one, state) for state, one in enumerate(traced)]
    lights = [
        solve_skies(context, one, hook, clock) for one, hook in zip(traced, hooks, strict=True)
    ]
    direct = solve_suns(context, traced, task, hooks, folder=folder)
    for one, light, hook, suns_light in zip(traced, lights, hooks, direct, strict=True):
        light[SUNS] = solve_annual(context, one, suns_light.annual)
        if hook:
            light[SUNS].error.own = light[SUNS].error.own + variance_of_mean(suns_light.specular.T)
    clock.lap("suns")
    # What was traced, and with what: statistics, then a Transfer for each state of trees. After an
    # interruption it has the suns that were done.
    traced_city = TracedCity(prepared, context, task, [], cramped)
    common = trace_statistics(
        context, (traced[0].ray_count, direct[0].ray_count), clock, traced_before
    )
    common["interrupted"] = note_interruption(direct[0].kept, len(suns))
    suns = suns if direct[0].kept == len(suns) else suns.first(direct[0].kept)
    for state in map(TracedState, traced, lights, direct, [None] * len(traced)):
        state.transfer = make_transfer(traced_city, state, suns, common, left)
        traced_city.states.append(state)
        if state.traced.form_factors is not None:
            state.traced.form_factors.links = None  # large
        if not context.rounds:
            state.direct.annual = replace(state.direct.annual, elements=None, spread=None)
        common |= {"seconds": {}, "processor_seconds": {}}  # the first state's are of all states
    if task.bits is not None:
        traced_city.bits, task.bits = pack_bits(task.bits), None  # large
    return traced_city


def trace_statistics(context, counts, clock, before):
    """What a run or a round traced in all states of trees: dict, fields of TraceRecord.

    `counts` are rays towards the sky and its sources, a dict, and towards the suns; Embree had
    taken `before` seconds.
    """
    rays, shadow_rays = counts
    return {
        "request": context.request.as_dict(),
        "max_bounces": context.bounces,
        "patches": len(context.patches),
        "threads": context.threads,
        "engine": context.ray_scene.engine,
        "hemisphere_rays": rays[SKY_DOME],
        "source_rays": {source.name: rays[source.name] for source in context.plan.sources},
        "shadow_rays": shadow_rays,
        "seconds": clock.seconds,
        "processor_seconds": clock.processor_seconds,
        "embree_thread_seconds": context.ray_scene.thread_seconds - before,
        "degrees_of_freedom": {
            "diffuse": HEMISPHERE_REPLICATES - 1,
            "direct_reflected": HEMISPHERE_REPLICATES - 1,
        },
    }


def solve_skies(context, traced, hook, clock):
    """Light of the sky and of each source in it, by way of mirrors too: dict of Light."""
    # One source of the sky after the other: the dome, then each traced part.
    lights, factor = {}, radiosity_factor(context.patches, traced.covered_share)
    done, steps = 0, context.bounces + 1

    def report(bounces):
        context.progress(
            "reflections of the sky", done + bounces, steps * len(traced.first), "bounces"
        )

    for name, first in traced.first.items():
        if context.bounces:
            report(0)
        # The far ground reflects the dome's light; traced parts of the sky add none by it.
        ground_albedo = context.ground_albedo if name == SKY_DOME else 0.0
        # A ray towards the sky brings its share of all light; patches in closed form and covered
        # ones sent none.
        sent = (
            (traced.samples > 0) & (context.dark_share(traced) < 1)
            if name == SKY_DOME
            else np.zeros(len(factor), bool)
        )
        look = np.divide(1.0, traced.samples, out=np.zeros(len(factor)), where=sent)
        light = lights[name] = solve_light(
            context, traced, first, ground_albedo, look=look, report=report
        )
        # Light by mirrors is added to it.
        if hook:
            light.add(hook.of_sky(name, factor * light.by_replicate.mean(axis=1)))
        clock.lap("diffuse reflections" if name == SKY_DOME else name)
        done += steps
    if context.bounces:
        report(0)
    if not context.keeps:
        # large
        traced.first[SKY_DOME] = replace(traced.first[SKY_DOME], element=None, deviation=None)
    return lights


def make_transfer(city, state, suns, common, left):
    """Transfer of a TracedState of a TracedCity.

    Parameters
    ----------
    city : TracedCity
    state : TracedState
    suns : Suns
        The suns that were kept.
    common : dict
        Fields of TraceRecord that hold for all states.
    left : float or None
        Share of light that further reflections would bring, where it is known.

    Returns
    -------
    Transfer
    """
    # What was decided and measured, as the record of the run.
    context, traced, direct, scene = city.context, state.traced, state.direct, city.prepared.scene
    brightest = float(city.prepared.patches.albedo.max(initial=0))
    # Without a variance of direct light the record says why its error is unknown.
    unknown = (
        "of direct light: one shadow point per patch gives no variance estimate; ask for "
        "--shadow-samples 2 or more"
    )
    record = TraceRecord(
        **common,
        brightest_albedo=max(brightest, context.ground_albedo),
        effects=context.plan.judge(_measure_outcome(context, traced, state.lights, left)),
        standard_error_unknown=unknown if np.isnan(state.lights[SUNS].error.own).any() else None,
        **shares_of_record(context, state.lights),
    )
    # What is covered or has no room is known already where modules were laid; else it is found now.
    covered_share, no_room, taken_parts = context.taken or find_taken(
        scene, context.patch_to_surface, traced.covered, city.cramped
    )
    # Means over surfaces: of the sky's light, of each sun's, and of the year's.
    return Transfer(
        surfaces=scene.surfaces,
        site=scene.site,
        suns=suns,
        covered_share=covered_share,
        no_room=no_room,
        taken_parts=taken_parts,
        left_out=average_room(
            context.patch_to_surface, share_without_room(context.left_out[:, None], traced.covered)
        )[:, 0],
        clearances=list_clearances(context.request),
        ground_albedo=context.ground_albedo if context.plan.far_ground else 0.0,
        visible_share=direct.visible_share,
        direct_reflected=direct.reflected,
        string_loss=direct.string_loss,
        terrain=context.plan.terrain,
        **light_of_surfaces(context, traced, state.lights, direct.annual),
        record=record,
        **materials_of_surfaces(scene, city.prepared.materials),
    )


def light_of_surfaces(context, traced, lights, annual):
    """What the light of the sky, its sources and the suns' sum is on surfaces, with errors: dict,
    fields of Transfer.

    Parameters
    ----------
    context : GatherContext
    traced : Traced
    lights : dict of Light
        As of `TracedState`.
    annual : Annual
    """
    sky, suns, to_surface = lights[SKY_DOME], lights[SUNS], context.patch_to_surface
    # Means of surfaces; variances go by the squares of the weights.
    squares, sources = to_surface.power(2), {}
    for source in context.plan.sources:
        view, light = traced.first[source.name].light.mean(axis=1, dtype=float), lights[source.name]
        sources[source.name] = SourceLight(
            to_surface @ view, light.mean, np.asarray(light.error.standard_error)
        )
    return {
        "sky_view_factor": to_surface @ traced.sky.mean(axis=1),
        "far_ground_view_factor": to_surface @ traced.far_ground.mean(axis=1),
        "diffuse_relative": sky.mean,
        "diffuse_relative_standard_error": sky.error.standard_error,
        "direct_annual_standard_error": suns.error.standard_error,
        "sources": sources,
        "error_parts": ErrorParts(
            diffuse_passed_on=sky.error.transported,
            direct_passed_on=suns.error.transported,
            diffuse_discretisation=sky.error.discretisation,
            direct_discretisation=suns.error.discretisation,
            covariance=squares @ covariance_of_replicates(suns.by_replicate, sky.by_replicate),
            direct_points=squares @ annual.variance,
        ),
    }


def shares_of_record(context, lights):
    """Shares of the light by the last reflection and by further ones, and by what is uneven on
    patches: dict, fields of TraceRecord."""
    sky, suns = lights[SKY_DOME], lights[SUNS]
    return {
        "last_bounce_share_diffuse": sky.last,
        "last_bounce_share_direct": suns.last,
        "cut_reflections": _bound_cut_light(context, lights),
        "discretisation_error": {
            "diffuse": sky.discretisation_error,
            "direct": suns.discretisation_error,
        },
    }


def _bound_cut_light(context, lights):
    """Share of each light that further reflections add at most: dict as of
    `TraceRecord.cut_reflections`.
    """
    surfaces, area = context.surfaces, context.eligible_area
    names = np.char.add(
        np.char.add(np.asarray(surfaces.kind, str), " "), np.asarray(surfaces.orientation, str)
    )
    groups = {
        name: np.where(names == name, area, 0) for name in np.unique(names[area > 0]).tolist()
    }
    bounds = {}
    for name, weight in (groups | {"all": area if area.any() else surfaces.area}).items():
        counted = weight > 0
        # Light that was cut, and all light, on the group by area.
        sums = {
            key: weight[counted] @ np.stack([light.cut, light.mean])[:, counted].T
            for key, light in lights.items()
        }
        shares = {
            key: float(cut / whole) if whole > 0 else 0.0 for key, (cut, whole) in sums.items()
        }
        bounds[name] = {key: share if np.isfinite(share) else None for key, share in shares.items()}
    return bounds


def choose_bounces(prepared, context, traced, task):
    """How often light is followed from patch to patch, and the share of light that is left then:
    (int, float).

    It is found on two columns, the sky and the sum of the first days' suns, and holds for all
    light.
    """
    factor, sky, threads = traced.factor, traced.first[SKY_DOME], context.threads
    if context.plan["specular"].on:  # what reflects otherwise counts as if it did by Lambert's law
        context = replace(context, patches=prepared.patches)
        whole = radiosity_factor(prepared.patches, traced.covered_share)
        factor = np.repeat(whole[:, None], factor.shape[1], axis=1)
    patches = context.patches
    once = multiply_elements(traced.form_factors, patches.albedo[:, None] * sky.element, threads)
    once += np.float32(context.ground_albedo) * traced.far_ground
    columns = [
        (sky.light.mean(axis=1), once.mean(axis=1)),
        light_of_first_days(context, traced, task),
    ]
    first, light = (np.stack(part, axis=1) for part in zip(*columns, strict=True))
    groups = sparse.csr_matrix(_group_surfaces(context)) @ context.patch_to_surface
    reflect = partial(multiply, traced.form_factors, factor, threads=threads)
    return find_bounces(reflect, light, groups, groups @ first.astype(float))


def _group_surfaces(context):
    """Weights of surfaces in the light of receivers of each kind and orientation, and of all: (g +
    1, n) float64.
    """
    area, surfaces = context.eligible_area, context.surfaces
    names = np.char.add(np.asarray(surfaces.kind, str), np.asarray(surfaces.orientation, str))
    groups = [np.where(names == name, area, 0) for name in np.unique(names[area > 0])]
    return np.stack([*groups, area if area.any() else surfaces.area])


def _measure_outcome(context, traced, lights, left):
    """What a run tells on what it left out: Measured; `left` of reflections is known where their
    number was found.
    """
    groups, area, sky = _group_surfaces(context), context.eligible_area, lights[SKY_DOME]
    noise, light = np.sqrt(variance_of_mean(groups @ sky.error.transported)), groups @ sky.mean
    # What the far ground passes on of the sky, and the noise of what surfaces pass on, as shares of
    # the light.
    far = context.ground_albedo * (
        area @ (context.patch_to_surface @ traced.far_ground.mean(axis=1))
    )
    return Measured(
        last_bounce=max(sky.last, lights[SUNS].last),
        far_ground=float(far / light[-1]) if light[-1] > 0 else 0.0,
        passed_on=float(
            np.divide(noise, light, out=np.zeros(len(light)), where=light > 0)[:-1].max(initial=0)
        ),
        beyond=left,
    )


def join_seasons(transfers, foliage):
    """Transfer in leaf with the bare one as its `bare`, or the one Transfer there is."""
    leaf, *bare = transfers
    return replace(leaf, bare=bare[0], leaf_months=foliage.months) if bare else leaf
