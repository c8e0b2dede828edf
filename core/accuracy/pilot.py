"""A pilot: a part of the user's own scene traced with three settings, which shows what rays and accuracy cost there.

    whole city as obstacles ─► surfaces of a square in its middle ─► A  256 rays, 16 shadow points
                                                                    B   64 rays, 16 shadow points
                                                                    C   64 rays,  4 shadow points, 1 reflection
    patches drawn from the whole city ─► the same, timed; and rays: how much ground they meet (`survey`)

Errors of A, B and C by source show how fast each falls; light is passed on from neighbour to neighbour, so they need
whole neighbourhoods. Seconds need what is typical of the city: A, B and C on drawn patches give the cost of a ray, a
shadow ray and a reflection, less what a run of hardly a patch takes: arrays of all patches cost the same in a run of
the whole city.
"""

import time
from dataclasses import dataclass, replace

import numpy as np

from ..effects.receivers import fewer_rays
from ..energy.compute_energy import compute_energy
from ..energy.pv_system import build_system
from ..photons.trace_hybrid import trace_hybrid
from ..progress import SUN_STAGE, silent
from ..sky.choose_sky import choose_sky
from ..sun.choose_suns import choose_suns
from ..sun.spread_suns import spread_suns
from .survey import DRAWN, survey_city, whole_replicates
from .yield_errors import find_lit, split_errors

PATCHES = 4_000  # of the square
TIMED, FEW = 3_000, 64  # patches of the timed runs, and of those that load compiled code and tell the city's size
SUNS, FEW_SUNS = "days:12", "days:4"  # the latter of the timed runs
RUNS = {  # name -> samples, shadow samples, most reflections (None: as planned)
    "A": (256, 16, None),
    "B": (64, 16, None),
    "C": (64, 4, 1),
}


@dataclass
class PilotRun:
    """One of the runs."""

    samples: int
    shadow_samples: int
    bounces: int
    suns: int
    counts: tuple  # patches that got all rays, and others that got fewer
    seconds: dict  # stage -> [s] of wall time
    processor_seconds: dict  # stage -> [s], sum over threads
    main_seconds: tuple  # [s] of the main thread, before the suns and from then on
    errors: object  # YieldErrors
    lit: np.ndarray  # (n,) bool, surfaces in these
    last_bounce: float  # share of the last reflection of all light


@dataclass
class Pilot:
    """What the runs showed."""

    runs: dict  # name -> PilotRun, of the square
    timed: list  # of PilotRun, of patches of the whole city
    empty: PilotRun  # the same of hardly a patch
    survey: object  # Survey of the whole city
    surfaces: int  # of the square, with yield
    electricity: float  # [s] for all surfaces
    transfer: object  # Transfer of run A
    lit: np.ndarray  # (n,) bool, surfaces in the errors of run A


class MainClock:
    """A progress report that measures processor time of the main thread, before the suns and from then on."""

    def __init__(self):
        self.started, self.suns = time.thread_time(), None

    def __call__(self, stage, done, total, unit):
        """Note when the suns begin."""
        if stage == SUN_STAGE and self.suns is None:
            self.suns = time.thread_time()

    def split(self):
        """Both times [s] until now."""
        now = time.thread_time()
        middle = now if self.suns is None else self.suns
        return middle - self.started, now - middle


def run_pilot(scene, prepared, weather, request, progress=silent):
    """Trace the pilot.

    Parameters
    ----------
    scene : Scene
    prepared : PreparedScene
        With its tree.
    weather : Weather
    request : Request
    progress : callable

    Returns
    -------
    Pilot
    """
    ways = (SUNS, FEW_SUNS)
    suns, few_suns = (spread_suns(choose_suns(way, *weather.axis, request.seed, position=weather.data)) for way in ways)
    traced = prepared.patches.receives & ~prepared.plan.unobstructed
    near = choose_square(prepared.scene, prepared.patches, traced, PATCHES)
    inputs = scene, prepared, weather, request
    few = draw_patches(prepared, FEW, request.seed)
    _, empty = (trace_part((*inputs, few_suns), few, RUNS["A"])[0] for _ in range(2))  # the first loads compiled code
    runs, transfers, electricity = {}, [], []
    for done, (name, setting) in enumerate(RUNS.items()):
        progress("pilot", done, len(RUNS), "runs")
        runs[name], *others = trace_part((*inputs, suns), near, setting)
        transfers.append(others[0])
        electricity.append(others[1])
    progress("pilot", len(RUNS), len(RUNS), "runs")
    some = draw_patches(prepared, TIMED, request.seed)
    return Pilot(
        runs=runs,
        timed=[trace_part((*inputs, few_suns), some, setting)[0] for setting in RUNS.values()],
        empty=empty,
        survey=survey_city(prepared, request),
        surfaces=len(runs["A"].errors.hours),
        electricity=electricity[0],
        transfer=transfers[0],
        lit=runs["A"].lit,
    )


def draw_patches(prepared, count, seed):
    """Patches drawn from the whole city, and the same share of the generated ground: (p,) bool."""
    own = prepared.scene.triangle_surface >= 0
    traced = prepared.patches.receives & ~prepared.plan.unobstructed
    share = min(count / max(int((traced & own).sum()), 1), 1.0)
    generator, drawn = np.random.default_rng([seed, DRAWN]), np.zeros(len(own), bool)
    for part in (own, ~own):
        places = np.flatnonzero(traced & part)
        drawn[generator.permutation(places)[: round(share * len(places))]] = True
    return drawn


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


def trace_part(inputs, part, setting):
    """Trace some patches with one of the settings: PilotRun, Transfer, and seconds of electricity."""
    scene, prepared, weather, request, suns = inputs
    samples, shadow_samples, most = setting
    bounces = min(prepared.plan.max_bounces, most or prepared.plan.max_bounces)
    request = replace(request, samples=samples, shadow_samples=shadow_samples, estimator="gather")
    patches = replace(prepared.patches, receives=prepared.patches.receives & part)
    plan = with_bounces(prepared.plan, bounces)
    laps = MainClock()
    transfer = trace_hybrid(scene, suns, request, laps, prepared=replace(prepared, patches=patches, plan=plan))
    main_seconds = laps.split()
    started = time.perf_counter()
    energy = compute_energy(
        transfer, weather, build_system(request), request.threads, sky=choose_sky(request, transfer)
    )
    seconds = time.perf_counter() - started
    record = transfer.record
    last = max(record.last_bounce_share_diffuse, record.last_bounce_share_direct)
    run = PilotRun(
        samples=samples,
        shadow_samples=shadow_samples,
        bounces=bounces,
        suns=len(suns),
        counts=count_patches(patches, plan, record.hemisphere_rays, samples),
        seconds=record.seconds,
        processor_seconds=record.processor_seconds,
        main_seconds=main_seconds,
        errors=split_errors(transfer, weather, energy),
        lit=find_lit(energy),
        last_bounce=last,
    )
    return run, transfer, seconds


def count_patches(patches, plan, rays, samples):
    """Patches that got all rays, and others that got fewer, of a run that sent so many rays: two int."""
    traced = patches.receives & ~plan.unobstructed
    if plan.receivers is None:
        return round(rays / whole_replicates(samples)), 0
    full = int((traced & plan.receivers).sum())
    return full, round((rays - full * whole_replicates(samples)) / whole_replicates(fewer_rays(samples)))


def with_bounces(plan, bounces):
    """The plan with another number of reflections."""
    effects = [replace(one, setting=bounces) if one.key == "reflections" else one for one in plan.effects]
    return replace(plan, effects=effects)
