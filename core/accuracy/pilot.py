"""The pilot: a small real run, which shows what rays and accuracy cost on the user's own scene.

    whole city as obstacles ─► patches of a square in its middle ─► the ordinary tracer with few settings
                                                                    fine    256 rays, 16 shadow points
                                                                    points   64 rays, 16 shadow points
                                                                    coarse   64 rays,  4 shadow points, 1 reflection
                                                                    empty   as fine, of hardly a patch

Light is passed on from neighbour to neighbour, so that errors need whole neighbourhoods: they are those of the surfaces
in the inner half of the square, for what lies around the square sends no light. Seconds of the four runs follow

    t = (fixed + patches + rays) + suns · (fixed + shadow points + products with the matrix of form factors)

whose costs are fitted, and multiplied with the patches, rays, points and suns of the whole city.
"""

import time
from dataclasses import dataclass, replace
from functools import reduce
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls
from threadpoolctl import threadpool_limits

from ..city.scene import Scene
from ..effects.receivers import fewer_points, fewer_rays
from ..energy.compute_energy import compute_energy
from ..energy.pv_system import build_system
from ..light.prepare_scene import PreparedScene, reseed
from ..light.trace_gather import trace_seasons
from ..light.transfer import take_rows
from ..photons.specular_light import trace_hybrid
from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..settings.progress import silent
from ..settings.request import Request
from ..settings.threads import usable_threads
from ..sun.sky_models import choose_sky
from ..sun.sun_sampling import choose_suns
from ..sun.suns import progressive_order
from ..weather.weather import Weather
from .part_of_city import keep_patches, spread_transfer
from .yield_errors import split_errors

MOST, LEAST, SHARE = 4_000, 1_000, 0.25  # patches of the square: a share of those of the city
INNER = 0.5  # of them lie in its inner part
FEW = 64  # patches of the empty run
REPEATED = 2_000  # patches of all repetitions of a run, up to four of a small city: errors of few surfaces scatter
SUNS = "days:12"
RUNS = {  # name -> samples, shadow samples, most reflections (None: as planned)
    "coarse": (64, 4, 1),
    "points": (64, 16, None),
    "fine": (256, 16, None),
}
MERGED = 0.8  # power of its rays with which the matrix entries of a patch grow: rays that meet the same patch are one
PLAN = "plan and tree"  # stage that is measured with the scene, not with the pilot


class CityYear(NamedTuple):
    """What is traced, and the year that weighs it."""

    scene: Scene
    prepared: PreparedScene  # with its tree
    weather: Weather
    request: Request


@dataclass
class PilotRun:
    """One of the runs."""

    samples: int
    shadow_samples: int
    bounces: int
    suns: int
    counts: tuple  # patches that got all rays, and others that got fewer
    seconds: tuple  # [s] of processor time, before the suns and from then on
    alone: float  # share of the processor time that the main thread spent, which no further thread makes shorter
    last_bounce: float  # share of the last reflection of all light
    errors: object = None  # YieldErrors of the surfaces that count; None of a run that is only timed


@dataclass
class Pilot:
    """What the runs showed."""

    runs: dict  # name -> PilotRun
    transfer: object  # of the fine run, with rows for all surfaces: those outside the square are dark
    costs: tuple  # (3,) and (3,) float64 [s] of processor time, of `terms_before_suns` and `terms_of_suns`
    counts: tuple  # patches of the whole city, as of `PilotRun`
    threads: int


def run_pilot(inputs, progress=silent):
    """Trace the pilot.

    Parameters
    ----------
    inputs : CityYear
    progress : callable

    Returns
    -------
    Pilot
    """
    prepared, suns = inputs.prepared, choose_pilot_suns(inputs)
    size = int(np.clip(SHARE * traced_patches(prepared).sum(), LEAST, MOST))
    square, counted = choose_neighbourhood(prepared, size)
    few = np.zeros(len(square), bool)
    few[np.flatnonzero(square & traced_patches(prepared))[:FEW]] = True
    trace_part(inputs, few, RUNS["fine"], suns)  # loads compiled code, so that none of the others does
    empty, _, _ = trace_part(inputs, few, RUNS["fine"], suns)
    runs = {}
    times = int(np.clip(REPEATED // max((square & traced_patches(prepared)).sum(), 1), 1, 4))
    for done, (name, setting) in enumerate(RUNS.items()):
        progress("pilot", done, len(RUNS), "runs")
        found, errors = [], []
        for seed in range(inputs.request.seed, inputs.request.seed + times):
            seeded = inputs._replace(prepared=reseed(prepared, seed))
            run, transfer, part = trace_part(seeded, square, setting, suns)
            found.append(run)
            if name != "points":
                errors.append(tell_errors(transfer, inputs, counted, part.surfaces))
        seconds = tuple(min(run.seconds[stage] for run in found) for stage in (0, 1))
        runs[name] = replace(run, seconds=seconds, errors=average_errors(errors) if errors else None)
    progress("pilot", len(RUNS), len(RUNS), "runs")
    rows = np.intersect1d(runs["coarse"].errors.rows, runs["fine"].errors.rows)
    for name in ("coarse", "fine"):
        runs[name].errors = runs[name].errors.take(np.isin(runs[name].errors.rows, rows))
    timed = [empty, *runs.values()]
    costs = tuple(
        fit_costs(np.array([terms(run) for run in timed]), np.array([run.seconds[stage] for run in timed]))
        for stage, terms in enumerate((terms_before_suns, terms_of_suns))
    )
    counts = count_city(prepared, square, runs["fine"].counts)
    whole = spread_transfer(transfer, part, inputs.scene.surfaces)
    return Pilot(runs | {"empty": empty}, whole, costs, counts, usable_threads(inputs.request.threads))


def choose_pilot_suns(inputs):
    """Suns of the pilot's runs."""
    weather = inputs.weather
    return progressive_order(choose_suns(SUNS, *weather.axis, position=weather.data))


def trace_part(inputs, part, setting, suns):
    """Trace some patches of a city, all others still in the way of rays.

    Parameters
    ----------
    inputs : CityYear
    part : (p,) bool
        Patches that are traced.
    setting : tuple
        Of RUNS.
    suns : Suns

    Returns
    -------
    PilotRun
        Without errors.
    Transfer
        Of the surfaces of the part.
    PartOfCity
    """
    samples, shadow_samples, most = setting
    request = replace(inputs.request, samples=samples, shadow_samples=shadow_samples, estimator="gather")
    few = keep_patches(inputs.scene, inputs.prepared, part)
    patches, plan = few.prepared.patches, few.prepared.plan
    receives = patches.receives.copy()
    receives[: len(few.patches)] &= part[few.patches]
    if most is not None and (plan.max_bounces is None or plan.max_bounces > most):
        plan = replace(plan, max_bounces=most)
    ready = replace(few.prepared, patches=replace(patches, receives=receives), plan=plan)
    started = time.thread_time()
    with threadpool_limits(1, "blas"):  # whose threads wait busily, which would count as processor time
        transfer = trace_seasons(trace_hybrid, few.scene, suns, request, progress=silent, folder=None, prepared=ready)
    alone = time.thread_time() - started
    records = [one.record for one in (transfer, transfer.bare) if one is not None]
    of_suns = sum(record.processor_seconds["suns"] for record in records)
    spent = sum(sum(record.processor_seconds.values()) - record.processor_seconds[PLAN] for record in records)
    record = records[0]
    run = PilotRun(
        samples=samples,
        shadow_samples=shadow_samples,
        bounces=record.max_bounces,
        suns=len(suns),
        counts=count_patches(ready.patches, plan, record.hemisphere_rays, samples),
        seconds=(spent - of_suns, of_suns),
        alone=float(np.clip(alone / max(spent, 1e-9), 0, 1)),
        last_bounce=max(record.last_bounce_share_diffuse, record.last_bounce_share_direct),
    )
    return run, transfer, few


def tell_errors(transfer, inputs, counted, known):
    """YieldErrors of some surfaces, with their rows in the whole city.

    Parameters
    ----------
    transfer : Transfer
        Of a part of the city.
    inputs : CityYear
    counted : (n,) bool
        Surfaces of the city that are asked for.
    known : (k,) int
        Those that the Transfer has.
    """
    rows, weather, request = np.flatnonzero(counted[known]), inputs.weather, inputs.request
    part = take_rows(transfer, rows)
    energy = compute_energy(part, weather, build_system(request), request.threads, sky=choose_sky(request, transfer))
    errors = split_errors(part, weather, energy)
    return replace(errors, rows=known[rows[errors.rows]])


def average_errors(found):
    """YieldErrors of the surfaces that several have, with their mean variances, of which each has few samples."""
    rows = reduce(np.intersect1d, (one.rows for one in found))
    found = [one.take(np.isin(one.rows, rows)) for one in found]
    variance = {name: np.mean([one.variance[name] for one in found], axis=0) for name in found[0].variance}
    return replace(found[0], variance=variance)


def traced_patches(prepared):
    """Patches that send rays: (p,) bool."""
    return prepared.patches.receives & ~prepared.plan.unobstructed


def choose_neighbourhood(prepared, count):
    """So many patches of a square in the middle of the city, (p,) bool, and surfaces of its inner part, (n,) bool.

    Both are the whole city where that has no more patches than the square. Where no eligible surface lies in the inner
    part, as where the middle of a city is one large roof, those of the whole square count.
    """
    scene, traced = prepared.scene, traced_patches(prepared)
    square = choose_square(scene, prepared.patches, traced, count)
    within = square if square.all() else choose_square(scene, prepared.patches, traced, int(INNER * count))
    counted = surfaces_of(scene, within)
    return square, counted if (counted & scene.surfaces.eligible).any() else surfaces_of(scene, square)


def surfaces_of(scene, patches):
    """Surfaces of some patches: (n,) bool."""
    found, own = np.zeros(len(scene.surfaces), bool), scene.triangle_surface
    found[own[patches & (own >= 0)]] = True
    return found


def choose_square(scene, patches, traced, count):
    """Patches of surfaces and ground in a square that has about so many traced ones: (p,) bool.

    Its middle is the median of the eligible patches.
    """
    own = scene.triangle_surface
    corners = np.asarray(scene.vertices, float)[scene.triangles].mean(axis=1)[:, :2]
    eligible = np.append(scene.surfaces.eligible, False)[own]
    middle = np.median(corners[eligible if eligible.any() else traced], axis=0) if traced.any() else corners[:1].mean(0)
    away = np.abs(corners - middle).max(axis=1)
    # A surface lies where its patches do on average, and is taken as a whole.
    surfaces = len(scene.surfaces)
    area = np.bincount(own[own >= 0], patches.area[own >= 0], surfaces)
    mean = np.bincount(own[own >= 0], (patches.area * away)[own >= 0], surfaces) / np.maximum(area, 1e-12)
    distance = np.where(own >= 0, np.append(mean, 0)[own], away)
    if traced.sum() <= count:
        return np.ones(len(own), bool)
    return distance <= np.sort(distance[traced])[count - 1]


def whole_replicates(rays):
    """Rays of a patch, a whole number for each replicate."""
    return -(-rays // HEMISPHERE_REPLICATES) * HEMISPHERE_REPLICATES


def count_patches(patches, plan, rays, samples):
    """Patches that got all rays, and others that got fewer, of a run that sent so many rays: two int."""
    if plan.receivers is None:
        return round(rays / whole_replicates(samples)), 0
    full = int((patches.receives & ~plan.unobstructed & plan.receivers).sum())
    return full, round((rays - full * whole_replicates(samples)) / whole_replicates(fewer_rays(samples)))


def count_city(prepared, square, counts):
    """Patches of the whole city that get all rays, and fewer: two float.

    Of the generated ground, of which only what a ray meets is traced, the same share as in the square.
    """
    traced, plan = traced_patches(prepared), prepared.plan
    full = traced if plan.receivers is None else traced & plan.receivers
    ground = traced & ~full & plan.optional if plan.reflectors else np.zeros(len(traced), bool)
    others = traced & ~full & ~ground
    met = (counts[1] - (others & square).sum()) / max((ground & square).sum(), 1)
    return float(full.sum()), float(others.sum() + np.clip(met, 0, 1) * ground.sum())


def terms_before_suns(run):
    """What the costs before the suns are multiplied with: once, per patch, per ray: (3,) float64."""
    rays = whole_replicates(run.samples), whole_replicates(fewer_rays(run.samples))
    return np.array([1.0, sum(run.counts), np.dot(run.counts, rays)])


def terms_of_suns(run):
    """The same of the suns: per sun, per shadow point, per product with an entry of the matrix: (3,) float64."""
    points = run.shadow_samples, fewer_points(run.shadow_samples)
    entries = np.array([run.samples, fewer_rays(run.samples)]) ** MERGED
    products = np.dot(run.counts, entries) * (1 + run.bounces if run.bounces else 0)
    return run.suns * np.array([1.0, np.dot(run.counts, points), products])


def fit_costs(terms, seconds):
    """Costs that are not negative and explain the seconds of some runs; relative deviations count alike."""
    scale = np.maximum(seconds, 0.05 * max(seconds.max(), 1e-6))
    return nnls(terms / scale[:, None], seconds / scale)[0]
