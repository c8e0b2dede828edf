"""A pilot: a part of the user's own scene traced with three settings, which shows what rays and accuracy cost there.

    whole city as obstacles ─► surfaces of a square in its middle ─► A  256 rays, 16 shadow points
                                                                    B   64 rays, 16 shadow points
                                                                    C   64 rays,  4 shadow points, 1 reflection
                                                                    0   hardly a surface: the cost of the city's size
    a few patches of the whole city ──► rays: how much ground they meet, entries of the matrix (`survey`)

Seconds of A, B, C and 0 give the cost of a ray, a shadow ray and a reflection; errors of A, B and C by source show how
fast each falls.
"""

import time
from dataclasses import dataclass, replace

import numpy as np

from ..effects.receivers import fewer_rays
from ..energy.compute_energy import compute_energy
from ..energy.pv_system import build_system
from ..photons.trace_hybrid import trace_hybrid
from ..progress import silent
from ..sky.choose_sky import choose_sky
from ..sun.choose_suns import choose_suns
from ..sun.spread_suns import spread_suns
from .survey import survey_city, whole_replicates
from .yield_errors import find_lit, split_errors

PATCHES = 4_000  # of the square
FEW = 64
SUNS, FEW_SUNS = "days:12", "days:4"  # of run 0 the latter
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
    errors: object  # YieldErrors
    lit: np.ndarray  # (n,) bool, surfaces in these
    last_bounce: float  # share of the last reflection of all light


@dataclass
class Pilot:
    """What the runs showed."""

    runs: dict  # name -> PilotRun
    empty: PilotRun  # without surfaces, but the whole city as obstacles
    survey: object  # Survey of the whole city
    surfaces: int  # of the square, with yield
    electricity: float  # [s] for all surfaces
    transfer: object  # Transfer of run A
    lit: np.ndarray  # (n,) bool, surfaces in the errors of run A


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
    year = weather.data.index, weather.interval, weather.latitude, weather.longitude
    ways = (SUNS, FEW_SUNS)
    suns, few_suns = (spread_suns(choose_suns(way, *year, request.seed, position=weather.data)) for way in ways)
    traced = prepared.patches.receives & ~prepared.plan.unobstructed
    near, few = (choose_square(prepared.scene, prepared.patches, traced, count) for count in (PATCHES, FEW))
    inputs = scene, prepared, weather, request
    trace_part((*inputs, few_suns), few, RUNS["A"])  # loads compiled code
    empty, _, _ = trace_part((*inputs, few_suns), few, RUNS["A"])
    runs, transfers, electricity = {}, [], []
    for done, (name, setting) in enumerate(RUNS.items()):
        progress("pilot", done, len(RUNS), "runs")
        runs[name], *others = trace_part((*inputs, suns), near, setting)
        transfers.append(others[0])
        electricity.append(others[1])
    progress("pilot", len(RUNS), len(RUNS), "runs")
    return Pilot(
        runs=runs,
        empty=empty,
        survey=survey_city(prepared, request),
        surfaces=len(runs["A"].errors.hours),
        electricity=electricity[0],
        transfer=transfers[0],
        lit=runs["A"].lit,
    )


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
    transfer = trace_hybrid(scene, suns, request, silent, prepared=replace(prepared, patches=patches, plan=plan))
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
