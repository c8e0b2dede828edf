"""The pilot: the whole city with few rays, which shows what rays and accuracy cost on the user's own scene.

    some of its patches ─► the ordinary tracer with more and with fewer rays, points, reflections ─► costs of each
    whole city ─► the same with few rays and suns ─► errors of all surfaces; seconds, to which the costs are scaled

Of a small city all patches are traced, and their last run is that of the whole city.

Errors are those of every surface in its own surroundings, since light is passed on from neighbour to neighbour. Seconds

    t = (patches + rays) + suns · (patches + shadow points + products with the matrix of form factors)

follow from the run of the whole city, of which the others tell only how much each term takes.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls
from threadpoolctl import threadpool_limits

from ..city.scene import Scene
from ..effects.receivers import fewer_points, fewer_rays
from ..energy.compute_energy import compute_energy
from ..energy.pv_system import build_system
from ..light.prepare_scene import PreparedScene
from ..light.solve_suns import COUNTING
from ..light.trace_gather import trace_seasons
from ..photons.specular_light import trace_hybrid
from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..settings.progress import silent
from ..settings.request import Request
from ..sun.sky_models import choose_sky
from ..sun.sun_sampling import choose_suns
from ..sun.suns import progressive_order
from ..weather.weather import Weather
from .part_of_city import keep_patches
from .yield_errors import split_errors

SMALL = 4_000  # patches up to which the part is the whole city
PART = 1_500  # patches of a square in the middle of a larger one: they reflect light onto each other
RUNS = ((64, 4, 1), (64, 64, None), (256, 16, None))  # of the part: rays, points, reflections (None: those of the city)
WHOLE = 32, 16, None  # of a larger city
WAY = "days:4"  # suns
FEW = 64  # patches of a run that loads compiled code
MERGED = 0.8  # power of its rays with which the matrix entries of a patch grow: rays that meet the same patch are one
PLAN, SUNS = "plan and tree", ("suns", COUNTING)  # stages: one of the scene, not of the pilot, and those of the suns


class CityYear(NamedTuple):
    """What is traced, and the year that weighs it."""

    scene: Scene
    prepared: PreparedScene  # with its tree
    weather: Weather
    request: Request


@dataclass
class PilotRun:
    """One of the runs, or one whose seconds are to be predicted."""

    samples: int
    shadow_samples: int
    bounces: int
    suns: int
    counts: tuple  # patches that get all rays, and others that get fewer
    seconds: tuple = ()  # [s] of processor time, before the suns and of them
    pace: float = 1.0  # wall time over processor time: by threads that share the work, and by other work that waits
    last_bounce: float = 0.0  # share of the last reflection of all light


@dataclass
class Pilot:
    """What the runs showed."""

    run: PilotRun  # of the whole city
    transfer: object  # its Transfer
    errors: object  # its YieldErrors
    costs: tuple  # (2,) and (3,) float64 [s] of `terms_before_suns` and `terms_of_suns`, scaled to the whole city

    def predict_seconds(self, run):
        """Wall and processor time of tracing a run [s], a PilotRun without seconds: two float."""
        works = terms_before_suns(run), terms_of_suns(run)
        processor = sum(float(cost @ work) for cost, work in zip(self.costs, works, strict=True))
        return processor * self.run.pace, processor


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
    weather, request, traced = inputs.weather, inputs.request, traced_patches(inputs.prepared)
    scene, patches, runs = inputs.prepared.scene, inputs.prepared.patches, []
    small, suns = traced.sum() <= SMALL, choose_pilot_suns(inputs, WAY)
    part = np.ones(len(traced), bool) if small else choose_square(scene, patches, traced, PART)

    def tell(*_):
        progress("pilot", len(runs), 1 + len(RUNS), "runs")

    few = choose_square(scene, patches, traced, FEW)
    trace_part(inputs, few, RUNS[-1], suns, progress=tell)  # loads compiled code, untimed
    for setting in RUNS:
        run, transfer, _ = trace_part(inputs, part, setting, suns, progress=tell)
        runs.append(run)
    if not small:
        run, transfer, _ = trace_part(inputs, np.ones(len(traced), bool), WHOLE, suns, progress=tell)
    progress("pilot", 1 + len(RUNS), 1 + len(RUNS), "runs")
    costs = tuple(
        fit_costs([terms(one) for one in runs], [one.seconds[stage] for one in runs], terms(run), spent)
        for stage, (terms, spent) in enumerate(zip((terms_before_suns, terms_of_suns), run.seconds, strict=True))
    )
    energy = compute_energy(
        transfer, weather, build_system(request), request.threads, sky=choose_sky(request, transfer)
    )
    return Pilot(run, transfer, split_errors(transfer, weather, energy), costs)


def choose_pilot_suns(inputs, way):
    """Suns of the pilot's runs."""
    weather = inputs.weather
    return progressive_order(choose_suns(way, *weather.axis, position=weather.data))


def trace_part(inputs, part, setting, suns, *, progress=silent):
    """Trace some patches of a city, all others still in the way of rays.

    Parameters
    ----------
    inputs : CityYear
    part : (p,) bool
        Patches that are traced.
    setting : tuple
        Hemisphere rays, shadow points, reflections (None: as planned).
    suns : Suns
    progress : callable

    Returns
    -------
    PilotRun
    Transfer
        Of the surfaces of the part.
    PartOfCity
    """
    samples, shadow_samples, bounces = setting
    request = replace(inputs.request, samples=samples, shadow_samples=shadow_samples, estimator="gather")
    few = keep_patches(inputs.scene, inputs.prepared, part)
    patches, plan = few.prepared.patches, few.prepared.plan
    receives = patches.receives.copy()
    receives[: len(few.patches)] &= part[few.patches]
    plan = plan if bounces is None or not plan.reflections else replace(plan, max_bounces=bounces)
    ready = replace(few.prepared, patches=replace(patches, receives=receives), plan=plan)
    with threadpool_limits(1, "blas"):  # whose threads wait busily, which would count as processor time
        transfer = trace_seasons(trace_hybrid, few.scene, suns, request, progress=progress, folder=None, prepared=ready)
    records = [one.record for one in (transfer, transfer.bare) if one is not None]
    spent, wall = (
        sum(sum(stages.values()) - stages[PLAN] for stages in found)
        for found in zip(*((one.processor_seconds, one.seconds) for one in records), strict=True)
    )
    of_suns, record = sum(one.processor_seconds.get(stage, 0.0) for one in records for stage in SUNS), records[0]
    run = PilotRun(
        samples,
        shadow_samples,
        record.max_bounces,
        len(suns),
        counts=count_patches(ready.patches, plan, record.hemisphere_rays, samples),
        seconds=(spent - of_suns, of_suns),
        pace=wall / max(spent, 1e-3),
        last_bounce=max(record.last_bounce_share_diffuse, record.last_bounce_share_direct),
    )
    return run, transfer, few


def traced_patches(prepared):
    """Patches that send rays: (p,) bool."""
    return prepared.patches.receives & ~prepared.plan.unobstructed


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
    """Patches that got all rays, and others that got fewer, of a run that sent so many rays: two float.

    Some of either turn out to be covered, and ground to be unseen: they send none.
    """
    sends = patches.receives & ~plan.unobstructed
    full = sends if plan.receivers is None else sends & plan.receivers
    counts = np.array([full.sum(), (sends & ~full).sum()], float)
    most = counts @ [whole_replicates(samples), whole_replicates(fewer_rays(samples))]
    return tuple(counts * rays / max(most, 1))


def terms_before_suns(run):
    """What the costs before the suns are multiplied with: per patch, per ray: (2,) float64."""
    rays = whole_replicates(run.samples), whole_replicates(fewer_rays(run.samples))
    return np.array([1 + sum(run.counts), np.dot(run.counts, rays)])


def terms_of_suns(run):
    """The same of the suns: per patch, per shadow point, per product with an entry of the matrix: (3,) float64."""
    points = run.shadow_samples, fewer_points(run.shadow_samples)
    entries = np.array([run.samples, fewer_rays(run.samples)]) ** MERGED
    products = np.dot(run.counts, entries) * (1 + run.bounces if run.bounces else 0)
    return run.suns * np.array([1 + sum(run.counts), np.dot(run.counts, points), products])


def fit_costs(terms, seconds, whole, spent):
    """Costs in proportions that explain the seconds of some runs, none negative, and which add up to those of another.

    Parameters
    ----------
    terms : list of (k,) float64
    seconds : list of float
        Relative deviations count alike.
    whole : (k,) float64
        Terms of the run of the whole city.
    spent : float
        Its seconds.

    Returns
    -------
    (k,) float64
    """
    terms, seconds = np.array(terms), np.array(seconds)
    scale = np.maximum(seconds, max(0.05 * seconds.max(), 1e-9))
    found = nnls(terms / scale[:, None], seconds / scale)[0]
    told = float(found @ whole)
    return found * spent / told if told > 0 else np.append(spent / whole[0], np.zeros(len(whole) - 1))
