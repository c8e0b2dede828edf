"""Rounds to a target for benchmarks/accuracy.py: as of `citypv simulate --target-error`, for the
light of a year.

Their target is the error of this light, as the run itself states it, on 95 % of the area. Time is
that of tracing, of all rounds together. A target that would take longer than MOST_SECONDS ends with
the last round in time.
"""

import time
from dataclasses import replace
from functools import partial

import numpy as np

from citypv.core.accuracy.rounds_to_target import Goal, largest_round, refine
from citypv.core.accuracy.yield_errors import YieldErrors
from citypv.core.energy.standard_errors import join_own
from citypv.core.light.prepare_scene import prepare_scene
from citypv.core.light.trace_run import trace_run
from citypv.core.light.transfer import variance_of_mean

MOST_SECONDS = 300.0  # wall time of each target


def light_errors(transfer, wanted):
    """Stated errors of the light of a year, the mean over the suns plus that of the sky:
    YieldErrors in place of hours.

    Of wanted surfaces, (n,) bool, without those that have less than a tenth of their mean light.
    """
    suns, parts = transfer.suns, transfer.error_parts
    cosine = np.maximum(transfer.surfaces.normal @ suns.direction.T, 0)
    light = (
        cosine * transfer.visible_share + transfer.direct_reflected
    ) @ suns.weight + transfer.diffuse_relative
    own = join_own(1.0, 1.0, transfer.own_direct, transfer.own_diffuse, parts.covariance)
    points = np.minimum(parts.direct_points, own)
    variance = {
        "shadows": points,
        "rays": own - points,
        "passed_on": variance_of_mean(parts.direct_passed_on + parts.diffuse_passed_on),
        "discretisation": (parts.direct_discretisation + parts.diffuse_discretisation) ** 2,
        "suns": np.zeros(len(own)),
    }
    area = np.where(wanted, transfer.surfaces.area, 0.0)
    lit = (area > 0) & (light >= 0.1 * np.average(light, weights=area))
    chosen = {name: part[lit] for name, part in variance.items()}
    return YieldErrors(chosen, light[lit], area[lit], transfer.record.rounds, np.flatnonzero(lit))


def refine_to(targets, scene, suns, request, wanted):
    """Transfer and processor seconds for each target [%], one after the other.

    Parameters
    ----------
    targets : sequence of float
    scene : Scene
    suns : Suns
    request : Request
    wanted : (n,) bool
        Surfaces whose errors count.
    """
    for target in targets:
        before = time.process_time()
        prepared = replace(
            prepare_scene(scene, request, suns=suns).build_tree(request), rounds=True
        )
        first = trace_run(scene, None, request, prepared=prepared)
        seconds = [time.process_time() - before]

        def trace(run, size, seconds=seconds):
            started = time.process_time()
            more = run.add_round(size)
            seconds.append(time.process_time() - started)
            return more

        goal = Goal(target, time.monotonic() + MOST_SECONDS, largest_round(request))
        errors = partial(light_errors, wanted=wanted)
        yield target, refine(first, errors, goal, trace, lambda line: None), sum(seconds)
