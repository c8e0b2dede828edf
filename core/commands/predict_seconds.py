"""Seconds that a run will take: its own stages on a few patches and suns, scaled to all."""

import time
from dataclasses import dataclass, replace

import numpy as np

from ..effects.receivers import fewer_points, fewer_rays
from ..light.form_factor_products import links_of, multiply_visible, propagate
from ..light.shadow_points import points_above
from ..light.sun_blocks import SunBlock, block_of_suns
from ..light.sun_visibility import SunWatch, sun_visibility
from ..light.trace_all import prepare_gather
from ..light.trace_hemisphere import LEAST, look_at_source, trace_hemisphere
from ..progress import silent
from ..sampling.sample_points import HEMISPHERE_REPLICATES, sobol_digits
from ..threads import usable_threads
from ..trees.kept_rays import forget_rays

PATCHES = 512
SUNS = 48
RUN = 12  # neighbouring suns
WARM_UP = 4  # patches with which the compiled loops are called before they are timed, and again for their fixed cost


@dataclass
class Seconds:
    """Predicted times [s] of the stages of gather, on the threads of the request."""

    sky_rays: float
    shadow_rays: float
    reflections: float  # products of the matrix with the light of sky and suns
    sources: float = 0.0  # rays to the traced sources of the sky, and what is reflected of them


def predict_seconds(prepared, request):
    """Predicted times of a run with the gather estimator.

    Parameters
    ----------
    prepared : PreparedScene
        With suns.
    request : Request

    Returns
    -------
    Seconds
    """
    plan, patches, suns = prepared.plan, prepared.patches, prepared.suns
    # Patches that look at the sky, and at the suns: the same ones unless one of the two is switched off.
    looking, lit = ~plan.unobstructed & patches.receives, ~plan.open_to_suns & patches.receives
    traced = np.flatnonzero(looking | lit)
    if not len(traced) or not len(suns):
        return Seconds(0.0, 0.0, 0.0)
    generator = np.random.default_rng([request.seed, 0x5EC5])
    full = np.ones(len(patches), bool) if plan.receivers is None else plan.receivers
    kinds = [one for one in (traced[full[traced]], traced[~full[traced]]) if len(one)]
    few = [np.sort(generator.choice(one, min(PATCHES // len(kinds), len(one)), replace=False)) for one in kinds]
    points, work = points_above(request.shadow_samples), []
    for one in kinds:
        every = full[one[0]]
        rays = looking[one].sum() * (1.0 if every else fewer_rays(request.samples) / request.samples)
        pairs = lit[one].sum() * (1.0 if every else fewer_points(points) / points)
        # Of those that look at the sky as many send rays to a source as face it.
        facing_sources = np.mean([len(facing(patches, source, one)) for source in plan.sources] or [0]) / len(one)
        work.append([rays, pairs * len(suns), rays * (1 + len(suns)) * (plan.max_bounces or 4), rays * facing_sources])
    seconds = (np.array(work) * time_states(prepared, request, few)).sum(axis=0) / usable_threads(request.threads)
    sky, sun, products, sources = map(float, seconds)
    # What patches receive of a source is reflected as is the light of one more sun.
    return Seconds(sky, sun, products, sources + len(plan.sources) * products / (1 + len(suns)))


def time_states(prepared, request, kinds):
    """Seconds of one thread per patch, as of `time_stages`: (k, 4). Those of trees in leaf and bare are added up.

    Parameters
    ----------
    prepared : PreparedScene
    request : Request
    kinds : list of k (n,) int
        Patches of each kind: ground takes longer than walls, with suns on every side.
    """
    trees, total = prepared.plan["trees"], np.zeros((len(kinds), 4))
    seasonal = trees.on and trees.setting.seasonal
    for bare in (False, True) if seasonal else (False,):  # in this order: the first keeps rays for the second
        context = prepare_gather(replace(prepared, bare=bare), request, silent)
        time_stages(context, kinds[0][:WARM_UP], prepared.suns)
        for row, few in enumerate(kinds):
            fixed, whole = (time_stages(context, some, prepared.suns) for some in (few[:WARM_UP], few))
            # Where noise or few patches hide the growth with their number, all of the time counts.
            total[row] += np.where(whole > fixed, (whole - fixed) / max(len(few) - WARM_UP, 1), whole / len(few))
    if seasonal:
        forget_rays(trees.setting.kept)
    return total


def draw_suns(suns):
    """Some suns of the whole year, in runs of neighbours as they are traced: SunBlock."""
    runs = max(1, min(SUNS, len(suns)) // RUN)
    starts = np.linspace(0, max(len(suns) - RUN, 0), runs).astype(int)
    chosen = np.unique(np.minimum((starts[:, None] + np.arange(RUN)).ravel(), len(suns) - 1))
    every = block_of_suns(suns, slice(len(suns)))
    return SunBlock(np.ascontiguousarray(every.directions[chosen]), every.weights[chosen])


def facing(patches, source, chosen):
    """Those of some patches that send rays to a source."""
    return chosen[source.unshaded(patches.normal[chosen]) > LEAST]


def time_source(context, source, few, covered):
    """Seconds of one thread for rays from some patches to a source."""
    chosen = facing(context.patches, source, few)
    if not len(chosen):
        return 0.0
    started = time.process_time()
    sequence = sobol_digits(-(-context.request.samples // HEMISPHERE_REPLICATES))
    look_at_source(context, source, chosen, covered[chosen], sequence)
    return (time.process_time() - started) * len(few) / len(chosen)


def time_stages(context, few, suns):
    """Seconds of one thread for some patches: of sky rays; per sun; per light source and bounce; of rays to sources."""
    patches, request, plan = context.patches, context.request, context.plan
    points, part = points_above(request.shadow_samples), draw_suns(suns)
    count = len(part.weights)
    chosen = np.zeros(len(patches), bool)
    chosen[few] = True
    laps = [time.process_time()]
    rays = trace_hemisphere(
        context.ray_scene,
        patches,
        chosen,
        sample_count=-(-request.samples // 4) * 4,
        reflections=plan.reflections,
        threads=1,
        progress=silent,
    )
    laps.append(time.process_time())
    looking, none = chosen & ~rays.covered.all(axis=1), np.zeros(len(patches), bool)
    watch = SunWatch(context.ray_scene, patches, looking, none, rays.covered, points, behind=plan.suns_behind)
    light = sun_visibility(watch, part)
    laps.append(time.process_time())
    sources = sum(time_source(context, source, few, rays.covered) for source in context.plan.sources)
    if not plan.reflections:
        return np.append(np.diff([*laps, laps[-1]]) / [1, count, 1], sources)
    weights = part.weights, np.empty(len(patches), np.float32)
    visible = part.directions, light.bits
    factor = np.ones((len(patches), rays.form_factors.cells), np.float32)
    links_of(rays.form_factors, factor)  # once for all reflections of a run
    laps.append(time.process_time())
    arriving = multiply_visible(
        rays.form_factors, (patches.albedo, patches.normal, watch.points.representative_points), visible
    )
    propagate(rays.form_factors, factor, arriving, weights)
    laps.append(time.process_time())
    sky, sun, _, products = np.diff(laps)
    return np.array([sky, sun / count, products / (2 * count), sources])
