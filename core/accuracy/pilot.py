"""The pilot: a run of the whole city with few rays and suns, which shows what accuracy costs on the
user's own scene.

Errors are computed for every surface in its own surroundings, since light is passed on from
neighbour to neighbour. Seconds

    t = (patches + rays) + suns · (patches + shadow points + products with the matrix of form
    factors)

have terms in proportions that hardly differ between cities; the run tells how long both
parts of it take.
"""

import time
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from ..effects.rays import fewer_rays
from ..energy.compute_energy import compute_energy
from ..energy.pv_system import build_system
from ..light.solve_suns import COUNTING
from ..light.specular_light import trace_hybrid
from ..light.trace_run import choose_year
from ..light.transfer import Transfer
from ..settings.progress import silent
from ..sky.sky_models import choose_sky
from .yield_errors import YieldErrors, split_errors

LARGE = 32  # rays of a patch of a city that is not small


@dataclass
class PilotRun:
    """A run, or one whose seconds are to be predicted."""

    samples: int
    shadow_samples: int
    bounces: int
    suns: int
    counts: tuple  # patches that get all rays, and others that get fewer
    seconds: tuple = ()  # [s] of processor time, before the suns and of them
    # wall time over processor time: by threads that share the work, and by other work that waits
    pace: float = 1.0
    last_bounce: float = 0.0  # share of the last reflection of all light

    def predict_seconds(self, other):
        """Processor time of tracing another run [s]: float."""
        parts = zip(self.seconds, _work_of_run(other), _work_of_run(self), strict=True)
        return sum(seconds * work / own for seconds, work, own in parts)


@dataclass
class Pilot:
    """What the run showed."""

    run: PilotRun
    transfer: Transfer
    errors: YieldErrors
    electricity: float  # [s] of `compute_energy`


def run_pilot(inputs, progress=silent, *, shadow_points=16):
    """Trace the pilot.

    Parameters
    ----------
    inputs : CityYear
    progress : callable

    Returns
    -------
    Pilot
    """
    # Few suns, and few rays in a large city, as its many patches average out.
    weather, request, traced = inputs.weather, inputs.request, traced_patches(inputs.prepared)
    suns = choose_year(weather, replace(request, suns="days:4"))
    # A run of 64 patches loads compiled code.
    few = traced & (np.cumsum(traced) <= 64)
    # A small city has up to 4,000 patches; a patch of it takes 256 rays, of a larger one 32.
    samples = 256 if traced.sum() <= 4_000 else LARGE

    def tell(*_):
        progress("pilot", 0, 1, "runs")

    # Timing starts after a run on some patches that compiles the code.
    trace_few(inputs, (LARGE, shadow_points), suns, tell, part=few)  # loads compiled code, untimed
    run, transfer = trace_few(inputs, (samples, shadow_points), suns, tell)
    progress("pilot", 1, 1, "runs")
    # From the traced light: hours, their errors, and how long electricity takes.
    started, sky = time.perf_counter(), choose_sky(request, transfer)
    energy = compute_energy(transfer, weather, build_system(request), request.threads, sky=sky)
    return Pilot(
        run, transfer, split_errors(transfer, weather, energy), time.perf_counter() - started
    )


def trace_few(inputs, setting, suns, progress=silent, *, part=None):
    """Trace a city with few rays and suns.

    Parameters
    ----------
    inputs : CityYear
    setting : (int, int)
        Hemisphere rays and shadow points.
    suns : Suns
    progress : callable
    part : (p,) bool, optional
        Patches that are traced; None: all.

    Returns
    -------
    PilotRun
        Samples, counts of patches, processor seconds, and wall time per second of these.
    Transfer
        As traced by gathering, without layouts of modules.
    """
    samples, shadow_samples = setting
    # A run of the same kind with fewer samples, gathered whatever estimator was asked for, perhaps
    # of some patches only.
    request = replace(
        inputs.request, samples=samples, shadow_samples=shadow_samples, estimator="gather"
    )
    ready = replace(inputs.prepared, rules=None)
    if part is not None:
        patches = replace(ready.patches, receives=ready.patches.receives & part)
        ready = replace(ready, patches=patches)
    # Linear algebra gets one thread: more would wait busily, which counts as processor time.
    with threadpool_limits(1, "blas"):
        transfer = trace_hybrid(inputs.scene, suns, request, progress, prepared=ready)
    # Processor time in two parts: what grows with the suns, and the rest without the plan.
    record = transfer.record
    spent, wall = (
        sum(stages.values()) - stages["plan and tree"]
        for stages in (record.processor_seconds, record.seconds)
    )
    of_suns = sum(record.processor_seconds.get(stage, 0.0) for stage in ("suns", COUNTING))
    counts = count_patches(ready.patches, ready.plan, record.hemisphere_rays, samples)
    seconds = spent - of_suns, of_suns
    # Costs and counts, from which costs of other settings are predicted.
    run = PilotRun(
        samples,
        shadow_samples,
        record.max_bounces,
        len(suns),
        counts,
        seconds,
        wall / max(spent, 1e-3),
    )
    run.last_bounce = max(record.last_bounce_share_diffuse, record.last_bounce_share_direct)
    return run, transfer


def traced_patches(prepared):
    """Patches that send rays: (p,) bool."""
    return prepared.patches.receives & ~prepared.plan.unobstructed


def count_patches(patches, plan, rays, samples):
    """Patches that got all rays, and others that got fewer, of a run that sent so many rays: two
    float.

    Some of either turn out to be covered: they send none.
    """
    sends = patches.receives & ~plan.unobstructed
    full = sends if plan.receivers is None else sends & plan.receivers
    counts = np.array([full.sum(), (sends & ~full).sum()], float)
    most = counts @ [samples, fewer_rays(samples)]
    return tuple(counts * rays / max(most, 1))


def _work_of_run(run):
    """What a run takes before its suns and with them, in units of a patch: two float."""
    # Patches, shadow points, and products of the matrix of form factors with light, for each
    # bounce.
    counts, rays = np.array(run.counts), (run.samples, fewer_rays(run.samples))
    patches, points = 1 + counts.sum(), counts.sum() * run.shadow_samples
    # Matrix entries of a patch grow with its rays to the power 0.8: rays that meet the same patch
    # are one.
    products = counts @ np.power(rays, 0.8) * (1 + run.bounces if run.bounces else 0)
    # Work before the suns, and with each of them, in these proportions.
    # Work of a patch and a ray; of a patch, a shadow point and a product with an entry of the
    # matrix, under each sun (benchmarks/results/accuracy_prediction.md).
    (patch, ray), (looking, point, product) = (1.0, 0.004), (1.0, 0.16, 0.0015)
    before = patch * patches + ray * (counts @ rays)
    return before, run.suns * (looking * patches + point * points + product * products)
