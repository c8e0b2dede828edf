"""From a scene and its suns to the Transfer: the gather estimator."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from ..city.canopy import forget_rays
from ..city.scene import check_scene
from ..effects.effect import Measured, judge_effects
from ..patches.read_albedo import materials_of_surfaces
from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..settings.errors import InputError
from ..settings.progress import CancelledError, Clock
from ..settings.request import check_request
from ..sun.horizon import without_hidden
from ..sun.suns import check_suns, interrupted_suns
from .form_factor_products import multiply_elements
from .kept_matrix import cover_of_surfaces, keep_columns
from .measure_room import average_room, list_clearances, measure_room_of_patches
from .prepare_scene import PreparedScene, prepare_scene
from .rounds import keep_patches, with_patches
from .solve_radiosity import Exchange, find_bounces, radiosity_factor
from .solve_sky import solve_dome, solve_source
from .solve_suns import SunLight, SunTask, annual_light, light_of_first_days, prepare_suns, solve_suns
from .trace_all import GatherContext, prepare_gather, trace_all
from .traced import SKY_DOME, Traced
from .transfer import Emitted, ErrorParts, TraceRecord, Transfer, note_interruption, variance_of_mean

ONE_POINT = "of direct light: one shadow point per patch gives no variance estimate; ask for --shadow-samples 2 or more"


@dataclass
class TracedCity:
    """What the rays and suns of a run met, and what follows from it."""

    prepared: PreparedScene
    context: GatherContext
    traced: Traced
    task: SunTask
    lights: dict  # of the sky, and of each source by its name: SkyLight
    direct: SunLight
    transfer: Transfer
    room: np.ndarray | None = None  # (p, k) float32, of `measure_room_of_patches`; None: not known


def trace_gather(scene, suns, request, progress, folder=None, *, prepared=None, specular=None):
    """Trace a scene.

    Parameters
    ----------
    scene : Scene
    suns : Suns
    request : Request
    progress : callable
        See `core.progress`.
    folder : path-like, optional
        Where matrices of surfaces × suns lie that are too large for the memory.
    prepared : PreparedScene, optional
        Of the scene, where it is known already.
    specular : callable, optional
        `specular(context, hemisphere)` gives the light by way of mirrors, glossy faces and glass: `of_sky`,
        `of_source` and `of_suns`, see `photons.specular_light`. Needed if the plan has such light.

    Returns
    -------
    Transfer
        `record` has what was decided, how many rays were traced and how long each stage took. If cancelled after some
        suns (see `core.progress`), `suns` are those that were traced, and `record.interrupted` says so.

    Raises
    ------
    CancelledError
        Cancelled before any sun could be used.
    InputError
        If a number, an array or a setting is invalid; raised before any ray is traced.
    """
    check_scene(scene)
    check_suns(suns)
    check_request(request)
    prepared = prepared or prepare_scene(scene, request, suns=suns)
    if prepared.plan["specular"].on and specular is None:
        problem = "a material is a mirror, glossy or glass, which gather alone does not follow"
        raise InputError("trace_gather", problem, "use trace_hybrid")
    return trace_light(prepared, suns, request, progress, folder, specular=specular).transfer


def trace_light(prepared, suns, request, progress, folder=None, *, specular=None, known=None):
    """The same for a prepared scene and unchecked suns: TracedCity.

    With `known`, of `edit_light.Known`, only what an edit of the city changes is traced.
    """
    clock, scene = Clock(), prepared.scene
    context = prepare_gather(prepared, request, progress)
    patches, plan, ray_scene = context.patches, context.plan, context.ray_scene
    to_surface = context.patch_to_surface
    traced_before = ray_scene.thread_seconds  # by earlier rounds with the same tree
    clock.lap("plan and tree")

    traced = trace_all(context, known)
    clock.lap("sky and reflections")
    # Every sun is traced, since open hours lie between them; errors are those of the light that counts.
    task, left = prepare_suns(context, traced, without_hidden(suns, plan.terrain), known), None
    if plan.reflections and not context.bounces:
        context.bounces, left = choose_bounces(prepared, context, traced, task)
        clock.lap("number of reflections")
    diffuse = solve_dome(context, traced, traced.first[SKY_DOME])
    light = specular and specular(context, traced)
    if light:
        factor = radiosity_factor(patches, traced.covered_share)
        diffuse.add(light.of_sky(factor * diffuse.by_replicate.mean(axis=1)))
    if not context.editable:
        traced.first[SKY_DOME] = replace(traced.first[SKY_DOME], element=None, deviation=None)  # large
    clock.lap("diffuse reflections")
    sources, lights = {}, {SKY_DOME: diffuse}
    for source in plan.sources:
        lights[source.name], sources[source.name] = solve_source(context, traced, source.name, light)
        clock.lap(source.name)
    if known and known.preview:
        known.preview(diffuse.mean, annual_light(context, traced, task))
        clock.lap("preview")
    direct = solve_suns(context, traced, task, diffuse.by_replicate, folder=folder, specular=light)
    clock.lap("suns")
    lengths = list_clearances(request)
    how = {"clearances": lengths, "threads": context.threads, "known": known and known.room(lengths)}
    room = measure_room_of_patches(ray_scene, patches, scene, traced.covered, **how)
    clock.lap("room for modules")
    transfer = Transfer(
        surfaces=scene.surfaces,
        site=scene.site,
        suns=suns if direct.kept == len(suns) else interrupted_suns(suns, direct.kept),
        covered_share=cover_of_surfaces(to_surface, traced.covered_share),
        no_room=average_room(to_surface, room),
        clearances=lengths,
        sky_view_factor=to_surface @ traced.sky.mean(axis=1),
        far_ground_view_factor=to_surface @ traced.far_ground.mean(axis=1),
        ground_albedo=request.ground_albedo if plan.far_ground else 0.0,
        diffuse_relative=diffuse.mean,
        diffuse_relative_standard_error=diffuse.error.standard_error,
        visible_share=direct.visible_share,
        direct_reflected=direct.reflected,
        direct_annual_standard_error=direct.error.standard_error,
        sources=sources,
        terrain=plan.terrain,
        error_parts=ErrorParts(
            diffuse_passed_on=diffuse.error.transported,
            direct_passed_on=direct.error.transported,
            diffuse_discretisation=diffuse.error.discretisation,
            direct_discretisation=direct.error.discretisation,
            covariance=direct.covariance,
            direct_points=direct.points,
        ),
        record=TraceRecord(
            request=request.as_dict(),
            effects=judge_effects(plan, measure_outcome(context, traced, diffuse, direct, left)),
            max_bounces=context.bounces,
            brightest_albedo=max(float(prepared.patches.albedo.max(initial=0)), request.ground_albedo),
            patches=len(patches),
            threads=context.threads,
            engine=ray_scene.engine,
            hemisphere_rays=traced.ray_count[SKY_DOME],
            source_rays={name: traced.ray_count[name] for name in sources},
            shadow_rays=direct.ray_count,
            seconds=clock.seconds,
            processor_seconds=clock.processor_seconds,
            embree_thread_seconds=ray_scene.thread_seconds - traced_before,
            last_bounce_share_diffuse=diffuse.last,
            last_bounce_share_direct=direct.last,
            discretisation_error={
                "diffuse": diffuse.discretisation_error,
                "direct": direct.discretisation_error,
            },
            degrees_of_freedom={"diffuse": HEMISPHERE_REPLICATES - 1, "direct_reflected": HEMISPHERE_REPLICATES - 1},
            interrupted=note_interruption(direct.kept, len(suns)),
            standard_error_unknown=ONE_POINT if np.isnan(direct.error.own).any() else None,
        ),
        **materials_of_surfaces(scene, prepared.materials),
    )
    task.known = None
    found = TracedCity(prepared, context, traced, task, lights, direct, transfer, room)
    if prepared.round is None or transfer.record.interrupted:
        return found
    annual = direct.annual
    none = np.zeros_like(diffuse.by_replicate) if annual.reflected is None else annual.reflected
    kept = keep_patches(context, task, prepared.round, (diffuse.by_replicate, none), annual.by_point)
    emitted = Emitted(diffuse.radiosity, annual.radiosity, annual.lit_ground)
    kept = replace(kept, emitted=emitted, uneven=(diffuse.error.uneven, direct.error.uneven))
    return replace(found, transfer=with_patches(transfer, kept))


def choose_bounces(prepared, context, traced, task):
    """How often light is followed from patch to patch, and the share of light that is left then: (int, float).

    It is found on two columns, the sky and the sum of the first days' suns, and holds for all light.
    """
    factor, sky, threads = traced.factor, traced.first[SKY_DOME], context.threads
    if context.plan["specular"].on:  # what reflects otherwise counts as if it did by Lambert's law
        context = replace(context, patches=prepared.patches)
        whole = radiosity_factor(prepared.patches, traced.covered_share)
        factor = np.repeat(whole[:, None], factor.shape[1], axis=1)
    patches = context.patches
    once = multiply_elements(traced.form_factors, patches.albedo, sky.element, threads)
    once += np.float32(context.request.ground_albedo) * traced.far_ground
    columns = [(sky.light.mean(axis=1), once.mean(axis=1)), light_of_first_days(context, traced, task)]
    first, light = (np.stack(part, axis=1) for part in zip(*columns, strict=True))
    groups = sparse.csr_matrix(group_surfaces(context)) @ context.patch_to_surface
    return find_bounces(Exchange(traced.form_factors, factor, threads), light, groups, groups @ first.astype(float))


def group_surfaces(context):
    """Weights of surfaces in the light of receivers of each kind and orientation, and of all: (g + 1, n) float64."""
    area, surfaces = context.eligible_area, context.surfaces
    names = np.char.add(np.asarray(surfaces.kind, str), np.asarray(surfaces.orientation, str))
    groups = [np.where(names == name, area, 0) for name in np.unique(names[area > 0])]
    return np.stack([*groups, area if area.any() else surfaces.area])


def measure_outcome(context, traced, diffuse, direct, left):
    """What a run tells on what it left out: Measured; `left` of reflections is known where their number was found."""
    groups, area = group_surfaces(context), context.eligible_area
    noise, light = np.sqrt(variance_of_mean(groups @ diffuse.error.transported)), groups @ diffuse.mean
    far = context.request.ground_albedo * (area @ (context.patch_to_surface @ traced.far_ground.mean(axis=1)))
    return Measured(
        last_bounce=max(diffuse.last, direct.last),
        far_ground=float(far / light[-1]) if light[-1] > 0 else 0.0,
        passed_on=float(np.divide(noise, light, out=np.zeros(len(light)), where=light > 0)[:-1].max(initial=0)),
        unseen=traced.unseen_share,
        beyond=left,
    )


def trace_seasons(trace, scene, suns, request, *, progress, folder, prepared):
    """Transfer of a scene; with deciduous trees that in leaf, with the bare one as its `bare`.

    Parameters
    ----------
    trace : callable
        The estimator.
    scene, suns, request, progress, folder
        As of the estimator.
    prepared : PreparedScene

    Raises
    ------
    CancelledError
        It was cancelled before the suns of the second state: one alone does not stand for the year.
    """
    transfer = trace(scene, suns, request, progress, folder, prepared=prepared)
    foliage = prepared.plan.foliage
    if foliage is None or not foliage.seasonal:
        return transfer
    if transfer.record.interrupted:
        raise CancelledError
    bare = trace(scene, suns, request, progress, folder, prepared=replace(prepared, bare=True))
    forget_rays(foliage.kept)
    if bare.record.interrupted:
        transfer = replace(
            transfer,
            suns=bare.suns,
            visible_share=keep_columns(transfer.visible_share, len(bare.suns)),
            direct_reflected=keep_columns(transfer.direct_reflected, len(bare.suns)),
            record=replace(transfer.record, interrupted=bare.record.interrupted),
        )
    return join_seasons(transfer, bare, prepared.plan)


def join_seasons(transfer, bare, plan):
    """Transfer in leaf with the bare one as its `bare`; where that is None, itself."""
    return transfer if bare is None else replace(transfer, bare=bare, leaf_months=plan.foliage.months)
