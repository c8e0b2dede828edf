"""Trace a scene with photons, to a Transfer: the forward estimator.

Photons start at sun, sky and far ground and are counted where they hit (Bredemeier et al., Eq. 1 to
4). They are reflected at the exact hit point, and summed per surface: there is no assumption of
constant radiosity per patch, so results are noisy but unbiased. Every source is traced through all
reflections; the cost is (suns + 3) · samples · patches photons, of at most 1 + max_bounces rays
each.

The covered share of a surface is geometry, and the same as in gather.
"""

from dataclasses import asdict, dataclass

import numpy as np

from ..effects.effect import Measured
from ..effects.rays import count_surely
from ..patches.read_albedo import brdfs_of_triangles, materials_of_surfaces
from ..settings.progress import SUN_STAGE, CancelledError, Clock
from ..settings.threads import usable_threads
from . import measure_cover, sun_matrix
from .emit_photons import FROM_ABOVE, FROM_BELOW, INWARDS, box_of_scene, make_source
from .follow_photons import Target
from .light_of_photons import Light
from .prepare_scene import check_tracing, prepare_scene
from .sun_visibility import projection_in_front
from .taken_parts import outline_taken
from .trace_sources import PHOTON_REPLICATES, Run, no_light, standard_error, trace_sources
from .transfer import SourceLight, TraceRecord, Transfer, note_interruption


@dataclass
class _Direct:
    """Results for each sun, per DNI."""

    visible_share: np.ndarray  # (n, s) float32
    reflected: np.ndarray  # (n, s) float32, without the first reflection from the far ground
    annual: Light  # sum over suns by their weights
    kept: int  # number of suns; fewer than all if interrupted


def trace_forward(scene, suns, request, progress, folder=None, *, prepared=None, state=0):
    """Trace a scene with photons.

    Parameters
    ----------
    scene : Scene
    suns : Suns
    request : Request
        `samples` is the number of photons per patch from each source: the sky, the far ground and
        every sun.
    progress : callable
        See `core.settings.progress`.
    folder : path-like, optional
        Where matrices of surfaces × suns lie that are too large for the memory.
    prepared : PreparedScene, optional
        Of the scene, where it is known already.
    state : int
        Of the trees: 0 in leaf, 1 bare.

    Returns
    -------
    Transfer
        Shares are clipped at 1. Noise above that is kept, so that sums stay unbiased: it remains in
        `diffuse_relative`, and is added to `direct_reflected`. `record` has what was decided and
        traced, and under `photons` the energy balance of sky, far ground and suns. If cancelled
        after some suns (see `core.settings.progress`), `suns` are those that were traced, and
        `record.interrupted` says so.

    Raises
    ------
    CancelledError
        Cancelled before any sun could be used.
    InputError
        If a number, an array or a setting is invalid; raised before any ray is traced.
    """
    check_tracing(scene, suns, request)
    clock = Clock()
    # Surfaces are averages over their patches; light of patches without room for modules may be
    # left out of them.
    prepared = prepared or prepare_scene(scene, request, suns=suns)
    traced, patches, plan = prepared.scene, prepared.patches, prepared.plan
    ground_albedo = traced.ground_albedo
    patch_to_surface = sun_matrix.area_means(
        traced.triangle_surface, patches.area, len(scene.surfaces)
    )
    # by earlier rounds
    traced_before = prepared.plan.ray_scene.thread_seconds if prepared.plan.ray_scene else 0.0
    run, covered_share = _prepare_run(prepared, request, progress, state)
    target, lengths = run.target, measure_cover.list_clearances(request)
    how = {"clearances": lengths, "threads": run.threads}
    # Cells without room for modules at each clearance; photons on some of them count for no
    # surface.
    cramped = measure_cover.find_cramped(target.ray_scene, patches, prepared.scene, **how)
    target.left_out = measure_cover.choose_left_out(
        prepared.scene, patch_to_surface, request, cramped
    )
    clock.lap("plan, tree and cover")

    # Reflections go on until what is left is lost in noise, by the brightest surface, or as often
    # as the plan says.
    brightest = max(float(patches.albedo.max(initial=0)), ground_albedo if plan.far_ground else 0.0)
    bounces = count_surely(brightest) if plan.max_bounces is None else plan.max_bounces
    # Photons from sky and far ground, then a source for each sun: parallel light that enters the
    # box around the scene through the sides that face it.
    sky, far, parts = _trace_surroundings(run, plan, request.seed, bounces)
    clock.lap("sky and far ground")
    weighed = plan.without_hidden(suns)
    sources = [
        make_source(
            f"sun {k}", run.box, request.seed, np.maximum(INWARDS @ travel, 0), travel=travel
        )
        for k, travel in enumerate(-suns.direction.astype(float))
    ]
    lit = trace_sources(run, sources, bounces, SUN_STAGE)
    how = {"patch_to_surface": patch_to_surface, "folder": folder}
    direct = _trace_direct(run, lit, weighed, far, ground_albedo, **how)
    clock.lap("suns")
    # Diffuse light is what the sky gives directly and what the far ground reflects of it; direct
    # light comes from all suns of the year.
    diffuse = sky.whole + ground_albedo * far.whole
    photons = sky.photon**2 + (ground_albedo * far.photon) ** 2
    covered_share = sun_matrix.cover_of_surfaces(patch_to_surface, covered_share)
    annual = direct.annual
    # What the last reflection brought says how much all later ones would, as a geometric series.
    traced = {"sky": sky, "far ground": far, "suns": annual} | parts
    last = max(sky.last_share, annual.last_share)
    beyond = last * brightest / (1 - brightest) if brightest < 1 else None
    by_ground, whole = ground_albedo * float(far.whole.sum()), float(diffuse.sum())
    measured = Measured(last, by_ground / whole if whole > 0 else 0.0, beyond=beyond)
    left_out = measure_cover.share_without_room(target.left_out[:, None], target.covered)
    # Up to rounding, these surfaces are covered completely.
    unreachable = (covered_share > 1 - 1e-6) | (target.area == 0)
    no_room = measure_cover.average_room(
        patch_to_surface, measure_cover.share_without_room(cramped, target.covered)
    )
    return Transfer(
        surfaces=scene.surfaces,
        site=scene.site,
        suns=suns if direct.kept == len(suns) else suns.first(direct.kept),
        covered_share=covered_share,
        no_room=no_room,
        taken_parts=outline_taken(
            prepared.scene, target.covered, cramped, covered_share[:, None] + no_room
        ),
        clearances=lengths,
        left_out=measure_cover.average_room(patch_to_surface, left_out)[:, 0],
        sky_view_factor=np.minimum(sky.first.mean(axis=0), 1),
        far_ground_view_factor=np.minimum(far.first.mean(axis=0), 1),
        ground_albedo=ground_albedo if plan.far_ground else 0.0,
        diffuse_relative=diffuse.mean(axis=0),
        diffuse_relative_standard_error=standard_error(diffuse, photons, unreachable),
        visible_share=direct.visible_share,
        direct_reflected=direct.reflected,
        terrain=plan.terrain,
        direct_annual_standard_error=standard_error(annual.whole, annual.photon**2, unreachable),
        sources={
            name: SourceLight(
                view_factor=np.minimum(light.first.mean(axis=0), 1),
                relative=light.whole.mean(axis=0),
                standard_error=standard_error(light.whole, light.photon**2, unreachable),
            )
            for name, light in parts.items()
        },
        record=TraceRecord(
            request=request.as_dict(),
            effects=plan.judge(measured),
            max_bounces=bounces,
            brightest_albedo=max(float(patches.albedo.max(initial=0)), ground_albedo),
            patches=len(patches),
            threads=run.threads,
            photons_per_source=run.per_replicate * PHOTON_REPLICATES,
            rays=sum(light.ray_count for light in traced.values()),
            photons={name: asdict(light.tally) for name, light in traced.items()},
            seconds=clock.seconds,
            processor_seconds=clock.processor_seconds,
            embree_thread_seconds=run.target.ray_scene.thread_seconds - traced_before,
            last_bounce_share_diffuse=sky.last_share,
            last_bounce_share_direct=annual.last_share,
            interrupted=note_interruption(direct.kept, len(suns)),
        ),
        **materials_of_surfaces(scene, prepared.materials),
    )


def _prepare_run(prepared, request, progress, state):
    """What photons fall on in a state of the trees, and the covered share of each patch.

    Returns
    -------
    Run
    covered_share : (p,) float32
    """
    scene, patches, threads = prepared.scene, prepared.patches, usable_threads(request.threads)
    ray_scene = prepared.build_tree(request).plan.ray_scene
    covered = measure_cover.find_cover(ray_scene, patches, patches.receives, threads)
    count = len(scene.surfaces)
    surface = np.where(scene.triangle_surface < 0, count, scene.triangle_surface)
    per_replicate = -(-request.samples * int(patches.receives.sum()) // PHOTON_REPLICATES)
    brdfs = brdfs_of_triangles(scene, request, prepared.materials)
    target = Target(ray_scene, patches, surface, count, covered, brdfs, state)
    box = box_of_scene(scene, ray_scene.canopy)
    return Run(target, box, per_replicate, threads, progress), covered.mean(
        axis=1, dtype=np.float32
    )


def _trace_surroundings(run, plan, seed, bounces):
    """Light of the sky, of the far ground per radiosity, and of parts of the sky that are traced by
    themselves.

    A surface receives of the far ground the share of its hemisphere that misses everything below
    the horizon; that its light arrives already counts as the first reflection. Distant terrain
    between the horizontal and its horizon has the same radiosity. Parts of the sky are in their
    units.

    Returns
    -------
    sky, far : Light
    parts : dict of str to Light
    """
    sources = [make_source("sky", run.box, seed, FROM_ABOVE, terrain=plan.terrain)]
    sources += [
        make_source(source.name, run.box, seed, source.sides, of=source, terrain=plan.terrain)
        for source in plan.sources
    ]
    if plan.far_ground:
        sources.append(make_source("far ground", run.box, seed, FROM_BELOW, rising=True, behind=1))
    if plan.far_ground and plan.terrain is not None:
        sources.append(
            make_source(
                "terrain", run.box, seed, FROM_ABOVE, terrain=plan.terrain, beyond=True, behind=1
            )
        )
    sky, *others = trace_sources(run, sources, bounces, "sky and far ground")
    parts, far = (
        {source.name: others.pop(0) for source in plan.sources},
        no_light(run.target.surface_count),
    )
    # Distant terrain counts as far ground.
    for light in others:
        far.add(light)
    return sky, far, parts


def _trace_direct(run, lit, suns, far, ground_albedo, *, patch_to_surface, folder):
    """Visible share and reflected irradiance of the surfaces for every sun; if cancelled, for those
    that are done.

    Parameters
    ----------
    run : Run
    lit : iterable of Light
        Of each sun, traced as it is asked for.
    suns : Suns
    far : Light
        Of the far ground, which reflects the suns' light.
    ground_albedo : float
    patch_to_surface : (n, p) sparse
        Averages patches over surfaces.
    folder : path-like or None
        As in `keep_matrix`.

    Returns
    -------
    Direct
    """
    # Matrices by surface and sun, and what the far ground brings after its first arrival.
    count, height = run.target.surface_count, np.maximum(suns.direction[:, 2], 0) * ground_albedo
    direct = _Direct(
        *(sun_matrix.keep_matrix((count, len(suns)), folder) for _ in range(2)),
        annual=no_light(count),
        kept=len(suns),
    )
    beyond_first = far.whole.mean(axis=0) - np.minimum(far.first.mean(axis=0), 1)
    done = 0
    try:
        # A sun at a time: direct light as a share of the unshaded, at most 1, and the rest as
        # reflected, with what noise brings above the unshaded.
        for index, light in enumerate(lit):
            towards = suns.direction[index : index + 1].astype(np.float32)
            unshaded = patch_to_surface @ projection_in_front(run.target.patches.normal, towards)[
                :, 0
            ].astype(float)
            first = np.minimum(light.first.mean(axis=0), unshaded)
            column = slice(index, index + 1)
            share = np.divide(first, unshaded, out=np.zeros(len(first)), where=unshaded > 0)
            direct.visible_share[:, column] = share[:, None]
            beyond = height[index] * beyond_first  # of the far ground, after its first arrival
            direct.reflected[:, column] = (light.whole.mean(axis=0) - first + beyond)[:, None]
            light.photon = np.where(unshaded > 0, light.photon, 0)
            direct.annual.add(light, suns.weight[index])
            done = index + 1
    # Interrupted: whole days that are done are kept; before the first one nothing can be used, and
    # the interruption is passed on.
    except CancelledError:
        direct.kept = max((end for end in suns.end_of_days if end <= done), default=0)
        if not direct.kept:
            raise
        direct.visible_share = sun_matrix.keep_columns(direct.visible_share, direct.kept)
        direct.reflected = sun_matrix.keep_columns(direct.reflected, direct.kept)
    # The sums have only the suns that are done; after an interruption they are scaled to a whole
    # year. The far ground's light is added once, by what these suns bring to level ground.
    annual, lit_ground = direct.annual, suns.weight[:done] @ height[:done]
    whole = 1.0 if direct.kept == len(suns) else suns.weight[:done].sum() or np.nan
    annual.first /= whole
    annual.reflected = (annual.reflected + far.whole * lit_ground) / whole
    annual.photon = np.hypot(annual.photon, far.photon * lit_ground) / whole
    return direct
