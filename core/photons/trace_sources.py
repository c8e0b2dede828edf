"""Trace photons of one source after the other, on several threads, and sum the irradiance of surfaces."""

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import islice

import numpy as np

from ..settings.threads import map_in_order
from .emit_photons import Box
from .follow_photons import Tally, Target, follow_photons

PHOTON_REPLICATES = 16  # independent sets of photons of each source; their variance gives the standard error
PHOTONS_PER_TASK = 1 << 16


@dataclass
class Run:
    """Data shared by all sources."""

    target: Target
    box: Box  # through which light enters
    per_replicate: int  # photons
    threads: int
    progress: Callable
    stage: str = "sky and far ground"
    total: int = 0  # photons of all sources of the stage
    done: int = 0

    def begin(self, stage, sources):
        """Start a stage with a number of sources."""
        self.stage, self.total, self.done = stage, sources * self.per_replicate * PHOTON_REPLICATES, 0
        if self.total:
            self.progress(self.stage, 0, self.total, "photons")


@dataclass
class Light:
    """Irradiance of n surfaces from one source."""

    first: np.ndarray  # (PHOTON_REPLICATES, n) float64
    reflected: np.ndarray  # (PHOTON_REPLICATES, n) float64
    photon: np.ndarray  # (n,) float64, contribution of a single photon
    last: float = 0.0  # share of the last bounce in the total
    ray_count: int = 0
    tally: Tally = field(default_factory=Tally)

    def add(self, other):
        """Add the light of an independent source."""
        self.first, self.reflected = self.first + other.first, self.reflected + other.reflected
        self.photon = np.hypot(self.photon, other.photon)
        self.ray_count += other.ray_count
        self.tally.add(other.tally)

    @property
    def whole(self):
        """Sum of first hits and reflections: (PHOTON_REPLICATES, n) float64."""
        return self.first + self.reflected


def trace_sources(run, sources, max_bounces):
    """Trace sources, each with the same number of photons.

    Parameters
    ----------
    run : Run
    sources : list of Source
    max_bounces : int

    Yields
    ------
    Light
        Of each source, in order.
    """
    count = run.per_replicate * PHOTON_REPLICATES
    ranges = [range(first, min(first + PHOTONS_PER_TASK, count)) for first in range(0, count, PHOTONS_PER_TASK)]
    tasks = ((source, numbers) for source in sources if source.power.any() for numbers in ranges)

    def follow(task):
        return follow_photons(run.target, *task, run.per_replicate, max_bounces)

    found = map_in_order(follow, tasks, run.threads)
    for source in sources:
        yield add_deposits(run, source, islice(found, len(ranges) if source.power.any() else 0), max_bounces)


def no_light(count):
    """Zero irradiance."""
    return Light(*np.zeros((2, PHOTON_REPLICATES, count)), np.zeros(count))


def add_deposits(run, source, found, max_bounces):
    """Irradiance from one source, from the deposits of its photons.

    Parameters
    ----------
    run : Run
    source : Source
    found : iterable of Deposits
    max_bounces : int

    Returns
    -------
    Light
    """
    light = no_light(run.target.surface_count)
    arrived = last = 0.0
    for part in found:
        rows = slice(part.first_replicate, part.first_replicate + len(part.first))
        light.first[rows] += part.first
        light.reflected[rows] += part.reflected
        light.ray_count += part.ray_count
        light.tally.add(part.tally)
        arrived += part.arrived
        last += part.last
        run.done += int(part.tally.emitted)
        run.progress(run.stage, run.done, run.total, "photons")
    light.last = last / arrived if max_bounces and arrived else 0.0
    # Hits per area, relative to the photon density on an unshaded surface facing the source (Eq. 1 to 4).
    per_photon = source.power.sum() / max(run.per_replicate, 1) / np.where(run.target.area > 0, run.target.area, np.inf)
    light.first *= per_photon
    light.reflected *= per_photon
    light.photon = per_photon / PHOTON_REPLICATES
    return light


def standard_error(replicates, photons, unreachable):
    """Standard error of the mean of independent replicates.

    With few or no photons their variance is not reliable. The contribution of one more photon is added, which gives
    √(k + 1) instead of √k for k photons.

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
    return np.sqrt(replicates.var(axis=0, ddof=1) / len(replicates) + np.where(unreachable, 0, photons))
