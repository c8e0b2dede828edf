"""One run of a pilot: some patches of a city traced with few settings, all others still in the way of rays."""

import time
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from ..effects.receivers import fewer_rays
from ..energy.compute_energy import compute_energy
from ..energy.pv_system import build_system
from ..light.sun_visibility import POINTS_PER_TASK
from ..light.trace_hemisphere import RAYS_PER_TASK
from ..light.transfer import take_rows
from ..photons.specular_light import trace_hybrid
from ..progress import SUN_STAGE
from ..sky.choose_sky import choose_sky
from .part_of_city import keep_patches, spread_transfer
from .survey import whole_replicates
from .yield_errors import split_errors

SUNS = "days:12"
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
    share: float  # of the city's patches that arrays have rows of
    seconds: dict  # stage -> [s] of wall time
    processor_seconds: dict  # stage -> [s], sum over threads
    main_seconds: tuple  # [s] of the main thread, before the suns and from then on
    errors: object  # YieldErrors; None of a run that is only timed
    last_bounce: float  # share of the last reflection of all light
    shared: tuple = (1.0, 1.0)  # most of the threads that had work, on average: before the suns, and from then on
    threads: int = 1


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


@dataclass
class PilotTask:
    """A run that can be traced, once or again."""

    part: object  # PartOfCity, of which only the patches asked for receive light
    bounces: int
    request: object  # Request
    of_city: int  # number of its patches


def prepare_part(inputs, part, setting, around=False):
    """What a run with one of the settings needs.

    Parameters
    ----------
    inputs : tuple of Scene, PreparedScene, Weather, Request and Suns
    part : (p,) bool
        Patches that are traced.
    setting : tuple
        Of RUNS.
    around : (p,) bool, optional
        Further patches that arrays have rows of; none if not given.

    Returns
    -------
    PilotTask
    """
    scene, prepared, _, request, _ = inputs
    samples, shadow_samples, most = setting
    bounces = prepared.plan.max_bounces or 4
    bounces = min(bounces, most or bounces)
    request = replace(request, samples=samples, shadow_samples=shadow_samples, estimator="gather")
    few = keep_patches(scene, prepared, part | around)
    patches = few.prepared.patches
    receives = patches.receives.copy()
    receives[: len(few.patches)] &= part[few.patches]
    plan = with_bounces(few.prepared.plan, bounces)
    ready = replace(few.prepared, patches=replace(patches, receives=receives), plan=plan)
    return PilotTask(replace(few, prepared=ready), bounces, request, len(prepared.patches))


def trace_task(task, suns):
    """Trace a PilotTask under some Suns: PilotRun without errors, and Transfer of the surfaces of its part."""
    ready, request = task.part.prepared, task.request
    laps = MainClock()
    with threadpool_limits(1, "blas"):  # whose threads wait busily, which would count as processor time
        transfer = trace_hybrid(task.part.scene, suns, request, laps, prepared=ready)
    main_seconds = laps.split()
    record = transfer.record
    run = PilotRun(
        samples=request.samples,
        shadow_samples=request.shadow_samples,
        bounces=task.bounces,
        suns=len(suns),
        counts=count_patches(ready.patches, ready.plan, record.hemisphere_rays, request.samples),
        share=len(ready.patches) / task.of_city,
        seconds=record.seconds,
        processor_seconds=record.processor_seconds,
        main_seconds=main_seconds,
        errors=None,
        last_bounce=max(record.last_bounce_share_diffuse, record.last_bounce_share_direct),
        threads=record.threads,
    )
    return replace(run, shared=share_work(run)), transfer


def share_work(run):
    """Most of the threads that tasks of a PilotRun gave work to, on average: two float, as of `PilotRun`.

    A run of few patches has fewer tasks than threads, or a last task that all others wait for; that of a city has not.
    """
    patches = max(run.counts[0], 1)
    rays = max(RAYS_PER_TASK // run.samples, 1)
    points = max(min(POINTS_PER_TASK // run.shadow_samples, -(-patches // run.threads)), 1)
    tasks = np.array([-(-patches // rays), -(-patches // points)])
    return tuple((tasks / (-(-tasks // run.threads) * run.threads)).tolist())


def trace_part(inputs, part, setting, counted):
    """Trace some patches with one of the settings.

    Parameters
    ----------
    inputs, part, setting
        As of `prepare_part`.
    counted : (n,) bool
        Surfaces whose errors are told.

    Returns
    -------
    PilotRun
    Transfer
        Of all surfaces; those without a patch in the part are dark.
    """
    scene, _, weather, _, suns = inputs
    task = prepare_part(inputs, part, setting)
    run, transfer = trace_task(task, suns)
    run.errors = tell_errors(transfer, weather, task.request, (counted, task.part.surfaces))
    return run, spread_transfer(transfer, task.part, scene.surfaces)


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
