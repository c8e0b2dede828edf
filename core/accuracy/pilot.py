"""A pilot: a part of the user's own scene traced with few settings, which shows what rays and accuracy cost there.

    whole city as obstacles ─► patches of a square in its middle ─► A  256 rays, 16 shadow points, all reflections
                                                                   C   64 rays,  4 shadow points, 1 reflection
    patches drawn from the whole city ─► A, C and, between them, B: 64 rays, 16 shadow points; all of them timed
    rays: how much ground they meet (`survey`)

Errors of A and C by source show how fast each falls. Light is passed on from neighbour to neighbour, so they need whole
neighbourhoods: errors are those of the surfaces in the inner half of the square, for what lies around the square sends
no light, which makes the surfaces at its edge too dark and what they see too uneven. Seconds need what is typical of
the city: blocks of patches drawn from all of it give the cost of a ray, a shadow ray and a reflection, less what their
arrays take whatever is traced. A run has rows of the patches that it traces only (`part_of_city`); what the arrays of
the whole city take is that of runs of hardly a patch in few rows and in many, and grows linearly.
"""

import time
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from ..effects.receivers import fewer_rays
from ..energy.compute_energy import compute_energy
from ..energy.pv_system import build_system
from ..photons.trace_hybrid import trace_hybrid
from ..progress import SUN_STAGE, silent
from ..sky.choose_sky import choose_sky
from ..sun.choose_suns import choose_suns
from ..sun.spread_suns import spread_suns
from ..transfer.take_rows import take_rows
from .part_of_city import spread_transfer, take_part
from .survey import DRAWN, survey_city, whole_replicates
from .time_electricity import time_electricity
from .yield_errors import split_errors

PATCHES, INNER = 4_000, 2_000  # of the square, and of its inner part
FEW, ROWS = 64, 30_000  # patches of the runs that tell what the city's size costs, and rows of the larger arrays
TIMED, SECONDS = (2_000, 6_000), 0.5  # patches of the timed runs, so many that run A takes [s]
BLOCK = 32  # patches drawn together: rays of neighbours go similar ways, and cost less than those of strangers
SUNS = "days:12"
RUNS = {  # name -> samples, shadow samples, most reflections (None: as planned)
    "A": (256, 16, None),
    "B": (64, 16, None),
    "C": (64, 4, 1),
}
SQUARE = ("A", "C")  # of which errors are told


@dataclass
class PilotRun:
    """One of the runs."""

    samples: int
    shadow_samples: int
    bounces: int
    suns: int
    counts: tuple  # patches that got all rays, and others that got fewer
    share: float  # of the city's patches that arrays have rows of
    seconds: dict  # stage -> [s] of wall time
    processor_seconds: dict  # stage -> [s], sum over threads
    main_seconds: tuple  # [s] of the main thread, before the suns and from then on
    errors: object  # YieldErrors; None where no surface was asked for
    last_bounce: float  # share of the last reflection of all light


@dataclass
class Pilot:
    """What the runs showed."""

    runs: dict  # "A" and "C" -> PilotRun, of the square
    timed: list  # of PilotRun, of patches of the whole city
    empty: tuple  # of PilotRun, of hardly a patch: in arrays of few rows, and of many
    survey: object  # Survey of the whole city
    electricity: float  # [s] for all surfaces
    transfer: object  # Transfer of run A


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
    suns = spread_suns(choose_suns(SUNS, *weather.axis, request.seed, position=weather.data))
    inputs = scene, prepared, weather, request, suns
    square, counted = choose_neighbourhood(prepared, PATCHES, INNER)
    runs, transfers = {}, {}
    for done, name in enumerate(SQUARE):  # the first loads compiled code, so that neither is timed
        progress("pilot", done, len(SQUARE), "runs")
        runs[name], transfers[name] = trace_part(inputs, square, RUNS[name], counted)
    progress("pilot", len(SQUARE), len(SQUARE), "runs")
    empty, timed = time_patches(inputs, runs["A"])
    return Pilot(
        runs=runs,
        timed=timed,
        empty=empty,
        survey=survey_city(prepared, request),
        electricity=time_electricity(transfers["A"], weather, request),
        transfer=transfers["A"],
    )


def time_patches(inputs, square):
    """PilotRuns of hardly a patch in arrays of few rows and of many, and those of patches drawn from the whole city.

    What the square took tells how many of these are enough to be timed, and not too many.
    """
    _, prepared, _, request, _ = inputs
    few = draw_patches(prepared, FEW, request.seed)
    before = trace_part(inputs, few, RUNS["A"])[0]
    many = trace_part(inputs, few, RUNS["A"], around=draw_surfaces(prepared, ROWS))[0]
    empty = shorter(before, trace_part(inputs, few, RUNS["A"])[0]), many
    spent, least = (sum(run.processor_seconds.values()) for run in (square, empty[0]))
    each = max(spent - least, 1e-9) / max(sum(square.counts), 1)
    some = draw_patches(prepared, int(np.clip(SECONDS / each, *TIMED)), request.seed)
    return empty, [trace_part(inputs, some, setting)[0] for setting in RUNS.values()]


def shorter(one, other):
    """A run with the shorter time of each stage of two alike: code that is loaded and other work make either longer."""
    stages = {name: min(other.processor_seconds[name], took) for name, took in one.processor_seconds.items()}
    main_seconds = tuple(np.minimum(one.main_seconds, other.main_seconds))
    return replace(one, processor_seconds=stages, main_seconds=main_seconds)


def draw_surfaces(prepared, count):
    """Patches of whole surfaces and of the generated ground, evenly spread, about so many of all: (p,) bool."""
    own = prepared.scene.triangle_surface
    step = max(round(len(own) / count), 1)
    return np.where(own >= 0, own, np.arange(len(own))) % step == 0


def draw_patches(prepared, count, seed):
    """Patches drawn from the whole city, in blocks, and the same share of the generated ground: (p,) bool."""
    own = prepared.scene.triangle_surface >= 0
    traced = prepared.patches.receives & ~prepared.plan.unobstructed
    share = min(count / max(int((traced & own).sum()), 1), 1.0)
    generator, drawn = np.random.default_rng([seed, DRAWN]), np.zeros(len(own), bool)
    for part in (own, ~own):
        places = np.flatnonzero(traced & part)
        firsts = generator.permutation(np.arange(0, len(places), BLOCK))[: -(-round(share * len(places)) // BLOCK)]
        rows = (firsts[:, None] + np.arange(BLOCK)).ravel()
        drawn[places[rows[rows < len(places)]]] = True
    return drawn


def choose_neighbourhood(prepared, patches, inner):
    """Patches of a square in the middle of the city, (p,) bool, and surfaces in its inner part, (n,) bool.

    Both are the whole city where that has no more patches than the square. Where no eligible surface lies in the inner
    part, as where the middle of a city is one large roof, those of the whole square count.
    """
    scene, traced = prepared.scene, prepared.patches.receives & ~prepared.plan.unobstructed
    square = choose_square(scene, prepared.patches, traced, patches)
    within = square if square.all() else choose_square(scene, prepared.patches, traced, inner)
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


def trace_part(inputs, part, setting, counted=None, *, around=False):
    """Trace some patches with one of the settings.

    Parameters
    ----------
    inputs : tuple of Scene, PreparedScene, Weather, Request and Suns
    part : (p,) bool
    setting : tuple
        Of RUNS.
    counted : (n,) bool, optional
        Surfaces whose errors are told; none if not given.
    around : (p,) bool, optional
        Further patches that arrays have rows of; none if not given.

    Returns
    -------
    PilotRun, and Transfer or None
        The Transfer, made if errors are told, has all surfaces; those without a patch in the part are dark.
    """
    scene, prepared, weather, request, suns = inputs
    samples, shadow_samples, most = setting
    bounces = min(prepared.plan.max_bounces, most or prepared.plan.max_bounces)
    request = replace(request, samples=samples, shadow_samples=shadow_samples, estimator="gather")
    few = take_part(scene, prepared, part | around)
    patches = few.prepared.patches
    receives = patches.receives.copy()
    receives[: len(few.patches)] &= part[few.patches]
    patches = replace(patches, receives=receives)
    plan = with_bounces(few.prepared.plan, bounces)
    laps = MainClock()
    with threadpool_limits(1, "blas"):  # whose threads wait busily, which would count as processor time
        ready = replace(few.prepared, patches=patches, plan=plan)
        transfer = trace_hybrid(few.scene, suns, request, laps, prepared=ready)
    main_seconds = laps.split()
    errors = None if counted is None else tell_errors(transfer, weather, request, (counted, few.surfaces))
    record = transfer.record
    run = PilotRun(
        samples=samples,
        shadow_samples=shadow_samples,
        bounces=bounces,
        suns=len(suns),
        counts=count_patches(patches, plan, record.hemisphere_rays, samples),
        share=len(patches) / len(prepared.patches),
        seconds=record.seconds,
        processor_seconds=record.processor_seconds,
        main_seconds=main_seconds,
        errors=errors,
        last_bounce=max(record.last_bounce_share_diffuse, record.last_bounce_share_direct),
    )
    return run, None if counted is None else spread_transfer(transfer, few, scene.surfaces)


def tell_errors(transfer, weather, request, surfaces):
    """YieldErrors of some surfaces, with their rows in the whole city.

    Parameters
    ----------
    transfer : Transfer
        Of a part of the city.
    weather : Weather
    request : Request
    surfaces : tuple of (n,) bool and (k,) int
        Which surfaces of the city are asked for, and those that the Transfer has.
    """
    counted, known = surfaces
    rows = np.flatnonzero(counted[known])
    part = take_rows(transfer, rows)
    energy = compute_energy(part, weather, build_system(request), request.threads, sky=choose_sky(request, transfer))
    errors = split_errors(part, weather, energy)
    return replace(errors, rows=known[rows[errors.rows]])


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
