"""Rounds of gather that continue one net of points: more rays and points of all patches, or of some alone.

    round of all      hemisphere and shadow rays of every patch go on, and the radiosity equation is solved again
    round of some     hemisphere rays ─► sky, far ground, and the radiosity of what they hit, as the last round of all
                      left it (final gathering); shadow rays ─► visible share of each sun

Every patch goes on in its own sequence of points (`rays.sample_points.sobol_points`), so k rounds are as even as
one of k times the samples. Their noise is told from the light of all rounds at the points of each patch, and by each
replicate of its rays, as if they were one. Hits of further rays are not kept: only the light that they find.
"""

from dataclasses import replace

import numpy as np

from ..rays.hemisphere_rays import merge_nets
from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..settings.progress import Clock
from ..sun.horizon import without_hidden
from ..sun.sky_models import RAYS_SHARE
from .direct_errors import variance_of_points
from .form_factor_products import multiply_elements
from .kept_matrix import average_surfaces, keep_matrix, row_blocks
from .light_errors import patch_size_error
from .merge_transfers import blend, blend_variance, check_same, merge_light, merge_records, whole_error
from .shadow_points import shift_points
from .solve_radiosity import covariance_of_replicates
from .solve_suns import look_at_block, prepare_suns
from .sun_blocks import block_of_suns
from .sun_visibility import projection_in_front
from .trace_all import prepare_gather, trace_all
from .traced import SKY_DOME, count_starts
from .transfer import Emitted, Net, PatchLight, SourceLight, Uneven, own_diffuse, own_direct, variance_of_mean

MOST_POINTS = 1024  # of a net; larger ones stay apart


def continue_sampling(prepared, request, total, part):
    """The scene for a further round, in which the patches go on in their sequences of points: PreparedScene.

    Parameters
    ----------
    prepared : PreparedScene
        Of the first round.
    request : Request
        Of the first round.
    total : Transfer
        Of all rounds before; their samples are a multiple of those of this one.
    part : Round
    """
    before, bounces = total.record.rounds, max(one.record.max_bounces for one in (total, total.bare or total))
    patches, owner, count = prepared.patches, prepared.scene.triangle_surface, len(prepared.patches)
    rays = max(-(-request.samples // HEMISPHERE_REPLICATES), RAYS_SHARE)
    rays, points = (1 << (number - 1).bit_length() for number in (rays, request.shadow_samples))
    receives = patches.receives
    if part.counted is not None:
        full = prepared.plan.receivers
        receives = receives & np.append(part.counted, False)[owner] & (True if full is None else full)
    patches = replace(
        patches,
        receives=receives,
        rays_before=np.full(count, before * rays, np.uint32),
        points_before=np.full(count, before * points, np.uint32),
    )
    return replace(prepared, patches=patches, round=part, bounces=bounces)


def keep_patches(context, task, part, by_replicate, by_point):
    """Light of the patches of a round: PatchLight, without what only a round of all has.

    Parameters
    ----------
    context : GatherContext
    task : SunTask
    part : Round
    by_replicate : tuple of two (p, HEMISPHERE_REPLICATES) float32
        All light of the sky, and annual reflected light of the suns.
    by_point : (p, m) float32
        Annual light of the suns at each point.
    """
    patches, count = context.patches, len(context.surfaces)
    rows = np.flatnonzero(context.full)
    took = np.ones(count + 1, bool) if part.counted is None else np.append(part.counted, False)
    net = Net(int(patches.points_before.max(initial=0)), by_point[rows])
    directions, weights = block_of_suns(task.suns, slice(len(task.suns)))
    covered, unshaded = task.watch.covered.mean(axis=1), projection_in_front(patches.normal, directions) @ weights
    return PatchLight(
        size=part.size * took.astype(int),
        owner=context.owner,
        key=patches.key,
        sent=task.watch.traced,
        squares=context.patch_to_surface.power(2),
        diffuse=by_replicate[0],
        reflected=by_replicate[1],
        rows=rows,
        nets=[net],
        covered=covered,
        unshaded=unshaded,
        points=np.where(task.watch.traced, variance_of_points([by_point], covered, unshaded), 0),
        emitted=Emitted(None, None, 0.0),
    )


def with_patches(transfer, kept):
    """A round's Transfer with the light of its patches, and what of its errors this does not explain."""
    told, whole = tell_noise(kept), (own_diffuse(transfer), own_direct(transfer))
    rest = tuple(np.maximum(every - part, 0) for every, part in zip(whole, told, strict=False))
    return replace(transfer, patch_light=replace(kept, rest=rest))


def tell_noise(kept):
    """Variance of surfaces' light of sky and suns from the light of their patches, their covariance, and the part of
    shadow points: four (n,)."""
    squares, points = kept.squares, kept.squares @ kept.points
    return (
        squares @ variance_of_mean(kept.diffuse),
        points + squares @ variance_of_mean(kept.reflected),
        squares @ covariance_of_replicates(kept.reflected, kept.diffuse),
        points,
    )


def trace_alone(total, request, progress, folder=None, *, prepared):
    """Trace the surfaces that a round is for, under the light of all others as it is known.

    What others pass on keeps its error. Reflected light of single suns is scaled to the new annual sum.

    Parameters
    ----------
    total : Transfer
        Of all rounds before, with `patch_light`.
    request : Request
        Of this round.
    progress, folder
        As of `trace_gather`.
    prepared : PreparedScene
        Of this round: `continue_sampling`.

    Returns
    -------
    Transfer
        To be merged by `add_continued`. Only its surfaces that the round is for count.

    Raises
    ------
    CancelledError
    """
    clock, context, kept = Clock(), prepare_gather(prepared, request, progress), total.patch_light
    before, emitted = context.ray_scene.thread_seconds, kept.emitted
    if emitted.sky is not None:  # as fine as what they look at
        context.elements = emitted.sky.shape[1]
        context.starts = count_starts(len(context.patches), context.elements, request.samples)
    clock.lap("plan and tree")
    traced = trace_all(context)
    clock.lap("sky and reflections")
    sky = traced.sky + receive(context, traced, emitted.sky, request.ground_albedo)
    reflected = receive(context, traced, emitted.suns, emitted.far_ground)
    task = prepare_suns(context, traced, without_hidden(total.suns, prepared.plan.terrain))
    visible_share = keep_matrix(total.visible_share.shape, folder)
    annual, shadow_rays = np.zeros((len(context.patches), context.points), np.float32), 0
    task.progress.bounces = 0
    for block in task.blocks:
        task.progress.begin(block)
        shadows = look_at_block(context, task, block, task.progress.report_rays)
        average_surfaces(context.patch_to_surface, shadows.visible_share, context.threads, visible_share[:, block])
        annual += shadows.light_of_points(context.patches.normal, block_of_suns(task.suns, block), context.threads)
        shadow_rays += shadows.ray_count
        task.progress.end()
    clock.lap("suns")
    light = keep_patches(context, task, prepared.round, (sky, reflected), annual)

    def gain(now, then):
        more = np.where(context.full, (now - then).mean(axis=1, dtype=float), 0)
        return context.patch_to_surface @ more

    to_surface, sources = context.patch_to_surface, {}
    for name, known in total.sources.items():
        first = traced.first[name].light
        view, error = to_surface @ first.mean(axis=1, dtype=float), to_surface.power(2) @ variance_of_mean(first)
        sources[name] = SourceLight(view, known.relative + view - known.view_factor, np.sqrt(error))
    far = to_surface @ traced.far_ground.mean(axis=1)
    more = gain(reflected, kept.reflected) - emitted.far_ground * (far - total.far_ground_view_factor)
    annual = total.direct_reflected @ total.suns.weight.astype(np.float32)
    factor = np.maximum(1 + np.divide(more, annual, out=np.zeros(len(annual)), where=annual > 0), 0).astype(np.float32)
    scaled = keep_matrix(total.direct_reflected.shape, folder)
    for rows, values in row_blocks(total.direct_reflected):
        np.multiply(values, factor[rows, None], out=scaled[rows])
    return replace(
        total,
        sky_view_factor=to_surface @ traced.sky.mean(axis=1),
        far_ground_view_factor=far,
        diffuse_relative=total.diffuse_relative + gain(sky, kept.diffuse),
        visible_share=visible_share,
        direct_reflected=scaled,
        sources=sources,
        patch_light=light,
        bare=None,
        record=replace(
            total.record,
            hemisphere_rays=traced.ray_count.pop(SKY_DOME),
            source_rays=traced.ray_count,
            shadow_rays=shadow_rays,
            seconds=clock.seconds,
            processor_seconds=clock.processor_seconds,
            embree_thread_seconds=context.ray_scene.thread_seconds - before,
        ),
    )


def receive(context, traced, radiosity, far_ground):
    """Light of patches and of the far ground that rays meet: (p, HEMISPHERE_REPLICATES) float32."""
    if radiosity is None:
        return np.zeros_like(traced.sky)
    every = np.ones(len(radiosity), np.float32)
    found = multiply_elements(traced.form_factors, every, radiosity, context.threads)
    return found + np.float32(far_ground) * traced.far_ground


def add_continued(total, other):
    """Merge a further round into a Transfer, whose matrices of surfaces × suns are overwritten.

    Parameters
    ----------
    total : Transfer
        Of all rounds before, with `patch_light`.
    other : Transfer
        Of a round that continues them. Surfaces that it is not for stay as they are.

    Returns
    -------
    Transfer

    Raises
    ------
    InputError
        They are of different scenes or suns.
    """
    check_same(total, other)
    one, new, parts = total.patch_light, other.patch_light, {}
    share = new.size / np.maximum(one.size + new.size, 1)
    kept, weight = merge_patches(one, new, share), share[:-1]
    *own, parts["covariance"], parts["direct_points"] = tell_noise(kept)
    errors = []
    for name, variance, rest, uneven in zip(("diffuse", "direct"), own, kept.rest, kept.uneven, strict=True):
        moved = (getattr(one.error_parts, f"{name}_passed_on") for one in (total, other))
        transported = parts[f"{name}_passed_on"] = blend(*moved, weight)
        left = getattr(total.error_parts, f"{name}_discretisation")
        # Told from the light of all rounds: errors by patch size of single rounds would cancel in their mean.
        left = parts[f"{name}_discretisation"] = left if uneven is None else patch_size_error(uneven, transported)
        errors.append(whole_error(variance + rest, transported, left))
    size = int(new.size.max(initial=0))
    record = merge_records(total.record, other.record, size / (total.record.rounds + size))
    return replace(
        total,
        **merge_light(total, other, weight),
        diffuse_relative_standard_error=errors[0],
        direct_annual_standard_error=errors[1],
        error_parts=replace(total.error_parts, **parts),
        bare=total.bare and add_continued(total.bare, other.bare),
        record=replace(record, degrees_of_freedom=total.record.degrees_of_freedom),
        patch_light=kept,
    )


def merge_patches(one, new, share):
    """PatchLight of all rounds, with the last one's share in the light of each surface and, last, of the ground."""
    of_patch, weight, merged = share[one.owner], share[:-1], {}
    rows = np.intersect1d(one.rows, new.rows)
    nets = [Net(net.before, net.light[np.searchsorted(kept.rows, rows)]) for kept in (one, new) for net in kept.nets]
    nets = join_nets(one.key[rows], nets)
    variance = variance_of_points([net.light for net in nets], one.covered[rows], one.unshaded[rows])
    points = blend_variance(one.points, new.points, of_patch)
    points[rows] = np.where(one.sent[rows], variance, 0)
    if new.rest is not None:  # a round of all
        pairs = zip(one.uneven, new.uneven, strict=True)
        merged = {
            "emitted": new.emitted,
            "rest": tuple(blend_variance(a, b, weight) for a, b in zip(one.rest, new.rest, strict=True)),
            "uneven": tuple(
                mine
                and Uneven(
                    blend(mine.received, others.received, weight),
                    blend_variance(mine.variance, others.variance, weight),
                    blend(mine.light, others.light, weight),
                )
                for mine, others in pairs
            ),
        }
    return replace(
        one,
        size=one.size + new.size,
        diffuse=blend(one.diffuse, new.diffuse, of_patch),
        reflected=blend(one.reflected, new.reflected, of_patch),
        rows=rows,
        nets=nets,
        points=points,
        **merged,
    )


def join_nets(keys, nets):
    """Nets of which none continues the one before it: list of Net."""
    joined = []
    for net in nets:
        joined.append(net)
        while len(joined) > 1:
            one, other = joined[-2:]
            count = one.light.shape[1]
            halves = count == other.light.shape[1] and other.before == one.before + count
            if not halves or one.before % (2 * count) or 2 * count > MOST_POINTS:
                break
            shifts = tuple(shift_points(keys, np.full(len(keys), half.before)) for half in (one, other))
            joined[-2:] = [Net(one.before, merge_nets(shifts, (one.light, other.light)))]
    return joined
