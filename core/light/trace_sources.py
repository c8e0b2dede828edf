"""Trace photons of one source after the other, on several threads, and sum the irradiance of
surfaces.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice

import numpy as np

from ..settings.threads import map_in_order
from .emit_photons import Box
from .follow_photons import Target, follow_photons
from .light_of_photons import Light

# independent sets of photons of each source; their variance gives the standard error
PHOTON_REPLICATES = 16
PHOTONS_PER_TASK = 1 << 16


@dataclass
class Run:
    """Data shared by all sources."""

    target: Target
    box: Box  # through which light enters
    per_replicate: int  # photons
    threads: int
    progress: Callable


def trace_sources(run, sources, max_bounces, stage):
    """Trace sources, each with the same number of photons.

    Parameters
    ----------
    run : Run
    sources : list of Source
    max_bounces : int
        Reflections, with those that the light of a source has behind it already.
    stage : str
        Whose progress is told.

    Yields
    ------
    Light
        Of each source, in order.
    """
    # Photons of each source in portions, all sources in one queue for the threads.
    count = run.per_replicate * PHOTON_REPLICATES
    total, done = len(sources) * count, 0
    if total:
        run.progress(stage, done, total, "photons")
    ranges = [
        range(first, min(first + PHOTONS_PER_TASK, count))
        for first in range(0, count, PHOTONS_PER_TASK)
    ]
    # A source without power sends no photons, and its light is 0.
    tasks = ((source, numbers) for source in sources if source.power.any() for numbers in ranges)
    tallies = map_in_order(
        lambda task: follow_photons(
            run.target, *task, run.per_replicate, max_bounces - task[0].behind
        ),
        tasks,
        run.threads,
    )
    # Portions of a source add up in order.
    for source in sources:
        light = no_light(run.target.surface_count)
        for part in islice(tallies, len(ranges) if source.power.any() else 0):
            light.add(part)
            done += int(part.tally.emitted)
            run.progress(stage, done, total, "photons")
        # Hits per area, relative to the photon density on an unshaded surface facing the source
        # (Eq. 1 to 4).
        area = np.where(run.target.area > 0, run.target.area, np.inf)
        per_photon = source.power.sum() / max(run.per_replicate, 1) / area
        light.first *= per_photon
        light.reflected *= per_photon
        light.photon = per_photon / PHOTON_REPLICATES
        yield light


def no_light(count):
    """Zero irradiance."""
    return Light(*np.zeros((2, PHOTON_REPLICATES, count)), photon=np.zeros(count))


def standard_error(replicates, photons, unreachable):
    """Standard error of the mean of independent replicates.

    With few or no photons their variance is not reliable. The contribution of one more photon is
    added, which gives √(k + 1) instead of √k for k photons.

    Parameters
    ----------
    replicates : (PHOTON_REPLICATES, n) float64
    photons : (n,) float64
        Square of the contribution of one photon.
    unreachable : (n,) bool
        Surfaces that no photon can reach.

    Returns
    -------
    (n,) float64
    """
    return np.sqrt(
        replicates.var(axis=0, ddof=1) / len(replicates) + np.where(unreachable, 0, photons)
    )
