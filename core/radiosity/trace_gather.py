"""From a scene and its suns to the Transfer: the gather estimator."""

import numpy as np

from ..city.scene import check_scene
from ..effects.effect import Measured, judge_effects
from ..patches.read_albedo import materials_of_surfaces
from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..settings.errors import InputError
from ..settings.progress import Clock
from ..settings.request import check_request
from ..sun.horizon import without_hidden
from ..sun.suns import check_suns, interrupted_suns
from ..transfer.prepare_scene import prepare_scene
from ..transfer.surface_means import cover_of_surfaces
from ..transfer.trace_record import TraceRecord, note_interruption
from ..transfer.transfer import ErrorParts, Transfer
from .add_specular import add_specular_sky
from .continue_rounds import keep_patches, with_noise
from .gather_context import prepare_gather
from .gather_diffuse import gather_diffuse
from .gather_direct import gather_direct
from .gather_source import gather_source
from .shadow_points import count_elements, points_above
from .solve_radiosity import variance_of_replicates
from .view_hemispheres import view_hemispheres

ONE_POINT = "of direct light: one shadow point per patch gives no variance estimate; ask for --shadow-samples 2 or more"


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
    clock = Clock()
    prepared = prepared or prepare_scene(scene, request, suns=suns)
    if prepared.plan["specular"].on and specular is None:
        problem = "a material is a mirror, glossy or glass, which gather alone does not follow"
        raise InputError("trace_gather", problem, "use trace_hybrid")
    context = prepare_gather(prepared, request, progress)
    patches, plan, merge, ray_scene = context.patches, context.plan, context.merge, context.ray_scene
    traced_before = ray_scene.thread_seconds  # by earlier rounds with the same tree
    clock.lap("plan and tree")

    cells = count_elements(points_above(request.shadow_samples))
    hemisphere, element_sky = view_hemispheres(context, cells)
    clock.lap("sky and reflections")

    diffuse = gather_diffuse(context, hemisphere, element_sky)
    del element_sky  # large
    light = specular and specular(context, hemisphere)
    if light:
        add_specular_sky(context, hemisphere, diffuse, light)
    clock.lap("diffuse reflections")
    sources, source_rays = {}, {}
    for source in plan.sources:
        name = source.name
        sources[name], source_rays[name] = gather_source(context, source, hemisphere, cells, light)
        clock.lap(name)
    # Every sun is traced, since open hours lie between them; errors are those of the light that counts.
    weighed = without_hidden(suns, plan.terrain)
    direct = gather_direct(context, hemisphere, weighed, diffuse.by_replicate, folder, specular=light)
    clock.lap("suns")
    transfer = Transfer(
        surfaces=scene.surfaces,
        site=scene.site,
        suns=suns if direct.kept == len(suns) else interrupted_suns(suns, direct.kept),
        covered_share=cover_of_surfaces(merge, hemisphere.covered_share),
        sky_view_factor=merge @ hemisphere.sky.mean(axis=1),
        far_ground_view_factor=merge @ hemisphere.far_ground.mean(axis=1),
        ground_albedo=request.ground_albedo if plan.far_ground else 0.0,
        diffuse_relative=diffuse.mean,
        diffuse_relative_standard_error=diffuse.error.standard_error,
        visible_share=direct.visible_share,
        direct_reflected=direct.reflected,
        direct_annual_standard_error=direct.error.standard_error,
        sources=sources,
        terrain=plan.terrain,
        error_parts=ErrorParts(
            diffuse_passed_on=diffuse.error.passed_on,
            direct_passed_on=direct.error.passed_on,
            diffuse_discretisation=diffuse.error.discretisation,
            direct_discretisation=direct.error.discretisation,
            covariance=direct.covariance,
            direct_points=direct.points,
        ),
        record=TraceRecord(
            request=request.as_dict(),
            effects=judge_effects(plan, measure_outcome(context, hemisphere, diffuse, direct)),
            max_bounces=plan.max_bounces,
            brightest_albedo=max(float(prepared.patches.albedo.max(initial=0)), request.ground_albedo),
            patches=len(patches),
            threads=context.threads,
            engine=ray_scene.engine,
            hemisphere_rays=hemisphere.ray_count,
            source_rays=source_rays,
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
    if prepared.round is None or transfer.record.interrupted:
        return transfer
    kept = keep_patches(context, hemisphere, diffuse, direct.annual, prepared.round)
    return with_noise(transfer, kept, (diffuse.error.uneven, direct.error.uneven))


def measure_outcome(context, hemisphere, diffuse, direct):
    """What a run tells on what it left out: Measured."""
    area, surfaces = context.eligible_area, context.surfaces
    far = context.merge @ hemisphere.far_ground.mean(axis=1)
    light = float(area @ diffuse.mean)
    names = np.char.add(np.asarray(surfaces.kind, str), np.asarray(surfaces.orientation, str))
    noise = [0.0]
    for name in np.unique(names[area > 0]):
        weight = np.where(names == name, area, 0)
        mean, deviations = float(weight @ diffuse.mean), weight @ diffuse.error.passed_on
        noise.append(float(np.sqrt(variance_of_replicates(deviations[None])[0])) / mean if mean > 0 else 0.0)
    return Measured(
        last_bounce=max(diffuse.last, direct.last),
        far_ground=float(context.request.ground_albedo * (area @ far)) / light if light > 0 else 0.0,
        passed_on=max(noise),
        unseen=hemisphere.unseen_share,
    )
