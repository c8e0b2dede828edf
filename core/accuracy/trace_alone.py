"""A further round for some surfaces alone: their own rays and points, under the light of all others as it is known.

    hemisphere rays ─► sky, far ground, and the radiosity of what they hit, from an earlier round
    shadow rays     ─► visible share of each sun

Nothing is reflected anew, which takes most of the time of a round. What others pass on keeps its error. Reflected light
of single suns is scaled to the new annual sum.
"""

from dataclasses import replace

import numpy as np

from ..form_factors.form_factor_products import multiply_elements
from ..radiosity.continue_rounds import ROWS, keep_patches
from ..radiosity.gather_context import prepare_gather
from ..radiosity.gather_diffuse import Diffuse
from ..radiosity.gather_direct import Annual, first_light_of_block, keep_block
from ..radiosity.gather_source import trace_source
from ..radiosity.hemisphere import empty_tallies
from ..radiosity.shadow_points import points_above
from ..radiosity.solve_radiosity import variance_of_replicates
from ..radiosity.sun_blocks import SunProgress, block_of_suns, cut_into_blocks
from ..radiosity.view_hemispheres import fill_closed_forms, trace_in_turn
from ..settings.progress import Clock
from ..sun.horizon import without_hidden
from ..transfer.kept_matrix import keep_matrix
from ..transfer.transfer import SourceLight


def trace_alone(total, request, progress, folder=None, *, prepared):
    """Trace the surfaces that a round is for.

    Parameters
    ----------
    total : Transfer
        Of all rounds before, with `patch_light`.
    request : Request
        Of this round.
    progress, folder
        As of `trace_gather`.
    prepared : PreparedScene
        Of this round: `transfer.prepare_scene.continue_sampling`.

    Returns
    -------
    Transfer
        To be merged by `continue_rounds.add_continued`. Only its surfaces that the round is for count.

    Raises
    ------
    CancelledError
    """
    clock, context = Clock(), prepare_gather(prepared, request, progress)
    patches, plan, kept = context.patches, context.plan, total.patch_light
    context.patches = patches = replace(patches, receives=patches.receives & plan.receivers)
    before = context.ray_scene.thread_seconds
    clock.lap("plan and tree")
    cells = 1 if kept.emitted.sky is None else kept.emitted.sky.shape[1]
    rays = trace_in_turn(context, empty_tallies(len(patches), cells) if plan.reflections else None)
    fill_closed_forms(rays, patches, plan)
    clock.lap("sky and reflections")
    diffuse = Diffuse(None, None, rays.sky + reflect(context, rays, kept.emitted.sky, request.ground_albedo), 0.0)
    sources, source_rays = {}, {}
    for source in plan.sources:
        name = source.name
        sources[name], source_rays[name] = view_source(context, source, rays, cells, total.sources[name])
        clock.lap(name)
    suns = without_hidden(total.suns, plan.terrain)
    visible_share, annual, shadow_rays = see_suns(context, rays, suns, folder)
    annual.by_replicate = reflect(context, rays, kept.emitted.suns, kept.emitted.far_ground)
    annual.lit_ground = kept.emitted.far_ground
    clock.lap("suns")
    light = keep_patches(context, rays, diffuse, annual, prepared.round)
    far = context.merge @ rays.far_ground.mean(axis=1)
    reflected = gain(context, kept, light, "reflected")
    reflected -= kept.emitted.far_ground * (far - total.far_ground_view_factor)
    return replace(
        total,
        sky_view_factor=context.merge @ rays.sky.mean(axis=1),
        far_ground_view_factor=far,
        diffuse_relative=total.diffuse_relative + gain(context, kept, light, "diffuse"),
        visible_share=visible_share,
        direct_reflected=scale_reflected(total, reflected, folder),
        sources=sources,
        patch_light=light,
        bare=None,
        record=replace(
            total.record,
            hemisphere_rays=rays.ray_count,
            source_rays=source_rays,
            shadow_rays=shadow_rays,
            seconds=clock.seconds,
            processor_seconds=clock.processor_seconds,
            embree_thread_seconds=context.ray_scene.thread_seconds - before,
        ),
    )


def reflect(context, rays, radiosity, far_ground):
    """Light of patches and of the far ground that rays meet: (p, HEMISPHERE_REPLICATES) float32."""
    if radiosity is None:
        return np.zeros_like(rays.sky)
    all_of_it = np.ones(len(radiosity), np.float32)
    return multiply_elements(rays.form_factors, all_of_it, radiosity, context.threads) + far_ground * rays.far_ground


def gain(context, before, now, light):
    """What surfaces receive more by the rays of a round than by those before it: (n,)."""
    more = getattr(now, light).mean(axis=1, dtype=float)
    place = np.searchsorted(before.rows, now.rows)
    more -= getattr(before, light)[place].mean(axis=1, dtype=float)
    return context.merge[:, now.rows] @ more


def scale_reflected(total, more, folder):
    """Reflected light of each sun, with `more`, (n,), in its annual mean: (n, s) float32."""
    annual = total.direct_reflected @ total.suns.weight.astype(np.float32)
    factor = 1 + np.divide(more, annual, out=np.zeros(len(annual)), where=annual > 0)
    factor, scaled = np.maximum(factor, 0).astype(np.float32), keep_matrix(total.direct_reflected.shape, folder)
    for first in range(0, len(factor), ROWS):
        rows = slice(first, first + ROWS)
        np.multiply(total.direct_reflected[rows], factor[rows, None], out=scaled[rows])
    return scaled


def see_suns(context, rays, suns, folder):
    """Visible share of surfaces for every sun, (n, s) float32; Annual; and the number of shadow rays."""
    count, points = len(context.patches), points_above(context.request.shadow_samples)
    visible_share = keep_matrix((context.merge.shape[0], len(suns)), folder)
    annual = Annual(by_point=np.zeros((count, points), np.float32), propagated=None)
    annual.suns = block_of_suns(suns, slice(len(suns)))
    progress, ray_count = SunProgress(context.progress, len(suns), 0), 0
    for block in cut_into_blocks(suns, count):
        progress.begin(block)
        part = block_of_suns(suns, block)
        light = first_light_of_block(context, rays, part, block.start, progress.report_rays, annual.known)
        keep_block(context, visible_share, block, light.visible_share)
        annual.by_point += light.by_point
        annual.known = light.known
        ray_count += light.ray_count
        progress.end()
    return visible_share, annual, ray_count


def view_source(context, source, rays, cells, before):
    """SourceLight with the first light of this round in place of that of those before, and the number of rays."""
    first = trace_source(context, source, rays.covered, cells)
    view = context.merge @ first.light.mean(axis=1, dtype=float)
    error = np.sqrt(context.merge.power(2) @ variance_of_replicates(first.light))
    return SourceLight(view, before.relative + view - before.view_factor, error), first.ray_count
