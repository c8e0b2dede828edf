"""A run by either estimator, and further rounds of it.

gather      what rays met is kept, and rounds go on from it
forward     photons, and gather where mirrors add some: rounds are runs of their own, and are merged
"""

from dataclasses import dataclass, replace

import numpy as np

from ..city.scene import Scene
from ..settings.progress import CancelledError, silent
from ..settings.request import Request
from ..sun.sun_sampling import choose_suns, weigh_by_year
from ..weather.weather import Weather
from .merge_transfers import merge_rounds, seed_of_round
from .prepare_scene import PreparedScene, check_tracing, prepare_scene
from .rounds import add_round
from .specular_light import specular_of
from .sun_matrix import keep_columns
from .trace_forward import trace_forward
from .trace_gather import TracedCity, join_seasons, trace_light
from .transfer import Transfer


@dataclass
class _Run:
    """A run to which rounds can be added."""

    scene: Scene
    weather: Weather
    request: Request
    prepared: PreparedScene
    transfer: Transfer
    city: TracedCity | None  # what its rays met; without, rounds are runs of their own

    def has_room(self, size):
        """Whether what the rays of all rounds and of one more, of some size, meet is small enough
        to be kept.
        """
        kept = sum(state.traced.nbytes for state in self.city.states) if self.city else 0
        # What the rays of several rounds met may take 4 GB.
        return kept * (1 + size / self.transfer.record.rounds) <= 4e9

    def add_round(self, size, progress=silent, folder=None):
        """Trace a further round of a run: the same scene and suns, at the next points of its
        sequences.

        Rounds of forward, and with mirrors, are runs with random numbers of their own.

        Parameters
        ----------
        size : int
            Samples, in units of the first round's: a power of two that divides the number of
            earlier ones.
        progress, folder
            As of `study.trace_scene`.

        Returns
        -------
        Run

        Raises
        ------
        CancelledError
            It was cancelled; the Transfer of `self` is as it was, but it can take no further round.
        """
        request, record = self.request, self.transfer.record
        # What rays met is kept: the round goes on in the same sequences of points.
        if self.city:
            city = add_round(self.city, size, progress, folder)
            transfer = city.transfer
            transfer = replace(
                transfer, record=replace(transfer.record, sun_sampling=record.sun_sampling)
            )
            return replace(self, transfer=transfer, city=city)
        # Otherwise a run with random numbers of its own, of so many samples, is merged by its
        # weight.
        seed = seed_of_round(request.seed, record.rounds)
        samples, points = size * request.samples, size * request.shadow_samples
        request = replace(request, seed=seed, samples=samples, shadow_samples=points)
        prepared = replace(
            self.prepared.reseed(seed), bounces=record.max_bounces, suns=self.transfer.suns
        )
        other = trace_run(
            self.scene, self.weather, request, progress, folder, prepared=prepared
        ).transfer
        if other.record.interrupted:  # by some suns only: not a whole round
            raise CancelledError
        other = replace(other, record=replace(other.record, rounds=size))
        return replace(self, transfer=merge_rounds(self.transfer, other))


def choose_year(weather, request):
    """Sun positions to trace for the year of a weather: Suns."""
    return choose_suns(request.suns, *weather.axis, position=weather.data).progressive_order()


def trace_run(scene, weather, request, progress=silent, folder=None, *, prepared=None):
    """Trace a scene for the suns of a year: Run. Parameters and errors as of `study.trace_scene`.

    `_Run.add_round` goes on with what its rays met where `prepared.rounds` says so.
    """
    # The suns of the year, and the scene prepared for its rays.
    suns = (
        choose_year(weather, request)
        if prepared is None or prepared.suns is None
        else prepared.suns
    )
    check_tracing(scene, suns, request)
    prepared = prepared or prepare_scene(scene, request, weather=weather, progress=progress)
    # Photons keep nothing to go on from; gathered light does, unless mirrors add photons to it.
    if request.estimator == "forward":
        transfer, city = (
            _trace_photons(scene, suns, request, progress, folder, prepared=prepared),
            None,
        )
    else:
        specular = specular_of(prepared)
        city = trace_light(prepared, suns, request, progress, folder, specular=specular)
        transfer = city.transfer
        city = city if prepared.rounds and not specular else None
    # Where some suns are missing the others stand for the year.
    if transfer.record.interrupted:
        transfer = weigh_kept_suns(transfer, weather.axis)
    return _Run(scene, weather, request, prepared, transfer, city)


def _trace_photons(scene, suns, request, progress, folder, *, prepared):
    """Transfer by photons, in each state of the trees; parameters as of `trace_forward`.

    Raises
    ------
    CancelledError
        It was cancelled before the suns of the second state: one alone does not stand for the year.
    """
    # In leaf, then bare, under the suns that both had: an interruption leaves the second with
    # fewer.
    leaf = trace_forward(scene, suns, request, progress, folder, prepared=prepared)
    if prepared.states == 1:
        return leaf
    if leaf.record.interrupted:
        raise CancelledError
    bare = trace_forward(scene, suns, request, progress, folder, prepared=prepared, state=1)
    if bare.record.interrupted:
        columns = {
            name: keep_columns(getattr(leaf, name), len(bare.suns))
            for name in ("visible_share", "direct_reflected")
        }
        record = replace(leaf.record, interrupted=bare.record.interrupted)
        leaf = replace(leaf, suns=bare.suns, record=record, **columns)
    return join_seasons([leaf, bare], prepared.plan.foliage)


def weigh_kept_suns(transfer, axis):
    """Let the suns that were traced until an interruption stand for the whole year.

    The error of the direct part holds for weights in proportion to the earlier ones. Other weights
    can make it larger: independent errors of the suns by √(Σ w²), errors that they share not at
    all.

    Parameters
    ----------
    transfer : Transfer
    axis : TimeAxis
        Of the year.

    Returns
    -------
    Transfer
    """
    # growth  of the standard deviation by unequal weights, at most: √(Σ w²) new over old.
    suns = weigh_by_year(transfer.suns, *axis)
    growth = max(1.0, np.sqrt((suns.weight**2).sum() / (transfer.suns.weight**2).sum()))
    parts = transfer.error_parts and transfer.error_parts.scale_direct(growth)
    error = transfer.direct_annual_standard_error * growth
    bare = transfer.bare and weigh_kept_suns(transfer.bare, axis)
    return replace(
        transfer, suns=suns, direct_annual_standard_error=error, error_parts=parts, bare=bare
    )
