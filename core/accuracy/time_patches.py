"""What rays, shadow points and reflections cost in a city: timed runs of patches drawn from it, and of hardly any.

Blocks of patches drawn from the whole city give the cost of a ray, a shadow point and a reflection, less what their
arrays take whatever is traced. A run has rows of the patches that it traces only (`part_of_city`); what the arrays of
the whole city take is that of runs of hardly a patch in few rows and in many, and grows linearly. A run takes some
tenths of a second, which other work on the machine can double: each is timed twice, and not one right after the other.
"""

from dataclasses import replace

import numpy as np

from .pilot_run import RUNS, prepare_part, trace_task
from .survey import DRAWN

FEW, ROWS = 64, 30_000  # patches of the runs that tell what the city's size costs, and rows of the larger arrays
TIMED, SECONDS = (2_000, 6_000), 0.5  # patches of the timed runs, so many that run A takes [s]
BLOCK = 32  # patches drawn together: rays of neighbours go similar ways, and cost less than those of strangers
TIMES = 2  # that each run is timed


def time_patches(inputs, square):
    """Time runs of patches of a city.

    Parameters
    ----------
    inputs : tuple of Scene, PreparedScene, Weather, Request and Suns
    square : PilotRun
        What it took tells how many patches are enough to be timed, and not too many.

    Returns
    -------
    tuple of two PilotRun
        Of hardly a patch, in arrays of few rows and of many.
    list of PilotRun
        Of RUNS, of patches drawn from the whole city.
    """
    _, prepared, _, request, suns = inputs
    few = draw_patches(prepared, FEW, request.seed)
    empty = time_tasks(
        [
            prepare_part(inputs, few, RUNS["A"]),
            prepare_part(inputs, few, RUNS["A"], around=draw_surfaces(prepared, ROWS)),
        ],
        suns,
    )
    spent, least = (sum(run.processor_seconds.values()) for run in (square, empty[0]))
    each = max(spent - least, 1e-9) / max(sum(square.counts), 1)
    some = draw_patches(prepared, int(np.clip(SECONDS / each, *TIMED)), request.seed)
    return tuple(empty), time_tasks([prepare_part(inputs, some, setting) for setting in RUNS.values()], suns)


def time_tasks(tasks, suns):
    """PilotRuns with the shortest of the times that PilotTasks take, in turns: list."""
    runs = [trace_task(task, suns)[0] for task in tasks]
    for _ in range(TIMES - 1):
        runs = [shorter(run, trace_task(task, suns)[0]) for run, task in zip(runs, tasks, strict=True)]
    return runs


def shorter(one, other):
    """A run with the shorter time of each stage of two alike: code that is loaded and other work make either longer."""

    def stages(name):
        return {stage: min(getattr(other, name)[stage], took) for stage, took in getattr(one, name).items()}

    main_seconds = tuple(np.minimum(one.main_seconds, other.main_seconds))
    return replace(
        one, seconds=stages("seconds"), processor_seconds=stages("processor_seconds"), main_seconds=main_seconds
    )


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
