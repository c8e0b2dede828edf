"""Seconds that a run will take: its own stages on a few patches and suns, scaled to all."""

import time
from dataclasses import dataclass

import numpy as np

from ..effects.receivers import fewer_rays
from ..form_factors.form_factor_products import links_of, multiply_visible, propagate
from ..progress import silent
from ..radiosity.gather_context import prepare_gather
from ..radiosity.gather_source import LEAST, trace_patches
from ..radiosity.hemisphere import empty_tallies
from ..radiosity.shadow_points import count_elements, points_above
from ..radiosity.sun_blocks import block_of_suns
from ..radiosity.sun_visibility import sun_visibility
from ..radiosity.trace_hemisphere import trace_hemisphere
from ..sampling.sample_points import HEMISPHERE_REPLICATES, sobol_digits

PATCHES = 512
SUNS = 48
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
    context = prepare_gather(prepared, request, silent)
    plan, patches, suns = prepared.plan, prepared.patches, prepared.suns
    traced = np.flatnonzero(~plan.unobstructed & patches.receives)
    if not len(traced) or not len(suns):
        return Seconds(0.0, 0.0, 0.0)
    generator = np.random.default_rng([request.seed, 0x5EC5])
    few = np.sort(generator.choice(traced, min(PATCHES, len(traced)), replace=False))
    time_stages(context, few[:WARM_UP], suns)
    fixed, whole = (time_stages(context, some, suns) for some in (few[:WARM_UP], few))
    # Where noise or few patches hide the growth with their number, all of the time counts.
    per_patch = np.where(whole > fixed, (whole - fixed) / max(len(few) - WARM_UP, 1), whole / len(few))
    full = np.ones(len(traced), bool) if plan.receivers is None else plan.receivers[traced]
    rays = full.sum() + (~full).sum() * fewer_rays(request.samples) / request.samples
    towards_sources = np.mean([len(facing(patches, source, traced)) for source in plan.sources] or [0])
    work = np.array([rays, len(traced) * len(suns), rays * (1 + len(suns)) * plan.max_bounces, towards_sources])
    sky, sun, products, sources = (float(seconds) for seconds in work * per_patch / context.threads)
    # What patches receive of a source is reflected as is the light of one more sun.
    return Seconds(sky, sun, products, sources + len(plan.sources) * products / (1 + len(suns)))


def facing(patches, source, chosen):
    """Those of some patches that send rays to a source."""
    return chosen[source.unshaded(patches.normal[chosen]) > LEAST]


def time_source(context, source, few, covered):
    """Seconds of one thread for rays from some patches to a source."""
    chosen = facing(context.patches, source, few)
    if not len(chosen):
        return 0.0
    started = time.perf_counter()
    sequence = sobol_digits(-(-context.request.samples // (context.plan.rays_share * HEMISPHERE_REPLICATES)))
    cells = count_elements(points_above(context.request.shadow_samples))
    trace_patches(context, source, (chosen, covered[chosen]), sequence, cells)
    return (time.perf_counter() - started) * len(few) / len(chosen)


def time_stages(context, few, suns):
    """Seconds of one thread for some patches: of sky rays; per sun; per light source and bounce; of rays to sources."""
    patches, request, plan = context.patches, context.request, context.plan
    points, count = points_above(request.shadow_samples), min(SUNS, len(suns))
    chosen = np.zeros(len(patches), bool)
    chosen[few] = True
    part = block_of_suns(suns, slice(0, count))
    laps = [time.perf_counter()]
    rays = trace_hemisphere(
        context.ray_scene,
        patches,
        chosen,
        sample_count=-(-request.samples // 4) * 4,
        reflections=plan.reflections,
        threads=1,
        progress=silent,
        tallies=empty_tallies(len(patches), count_elements(points)) if plan.reflections else None,
    )
    laps.append(time.perf_counter())
    light = sun_visibility(
        context.ray_scene,
        patches,
        chosen & ~rays.covered.all(axis=1),
        np.zeros(len(patches), bool),
        rays.covered,
        point_count=points,
        suns=part,
        behind=plan.suns_behind,
        threads=1,
        progress=lambda share, done: None,
    )
    laps.append(time.perf_counter())
    sources = sum(time_source(context, source, few, rays.covered) for source in context.plan.sources)
    if not plan.reflections:
        return np.append(np.diff([*laps, laps[-1]]) / [1, count, 1], sources)
    weights = part.weights, np.empty(len(patches), np.float32)
    visible = part.directions, light.visible_elements
    factor = np.ones((len(patches), count_elements(points)), np.float32)
    links_of(rays.form_factors, factor)  # once for all reflections of a run
    laps.append(time.perf_counter())
    arriving = multiply_visible(rays.form_factors, patches.albedo, patches.normal, visible)
    propagate(rays.form_factors, factor, arriving, weights)
    laps.append(time.perf_counter())
    sky, sun, _, products = np.diff(laps)
    return np.array([sky, sun / count, products / (2 * count), sources])
