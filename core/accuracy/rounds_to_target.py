"""Further rounds of tracing until a target of accuracy is met or the time is up.

    round 1 ─► Transfer ─► errors ─► within the target, or no time for another round? ─► done
                  ▲                        │ no
                  └────── round k ◄────────┘

Rounds double: 1, 1, 2, 4 … times the samples of the first, up to `largest_round`, so that what
every round costs beside its rays counts little. Each goes on where the one before it stopped in the
sequences of random points.
"""

import time
from dataclasses import dataclass

import numpy as np
from scipy.optimize import bisect

from ..settings.progress import CancelledError, describe_duration
from .yield_errors import SAMPLED

# shadow points from which patches are resolved into as many elements: the fewest of a run with
# rounds
CELLS = 16


@dataclass
class Goal:
    """When to stop."""

    target: float | None  # [%] of full load hours, on 95 % of the area with modules
    deadline: float | None  # `time.monotonic()` at which tracing must end [s]
    largest: int = 1  # round, in units of the first

    @staticmethod
    def of(request, deadline):
        """Goal of a request whose tracing must end by a deadline, or None."""
        return Goal(request.target_error, deadline, largest_round(request))


def largest_round(request):
    """Size of the largest round of a run, in units of the first: int, a power of two."""
    # The memory grows with the rays and points of one round: 1,024 and 64 at most.
    times = min(1024 // request.samples, 64 // request.shadow_samples)
    return 1 << max(times, 1).bit_length() - 1


def refine(run, errors, goal, trace_round, tell, *, seconds_per_line=2.0):
    """Trace rounds until the goal is reached.

    Parameters
    ----------
    run : Run
        Of the first round.
    errors : callable
        `errors(transfer)` gives its YieldErrors.
    goal : Goal
    trace_round : callable
        `trace_round(run, size)` gives the Run with a further round.
    tell : callable
        Called with a line of text after a round, if the last line is `seconds_per_line` old, and
        when tracing stops.

    Returns
    -------
    Transfer
        Of all rounds that were finished, also where the goal is out of reach: time or memory ended,
        or tracing was cancelled. Matrices of the given one are overwritten.
    """
    # Seconds of a round follow from the one before; the first round is given.
    errors_now, told = errors(run.transfer), -seconds_per_line
    each = sum(run.transfer.record.seconds.values())  # [s] of a round of size 1
    while True:
        # The size of the next round follows from the errors, the goal and the seconds of the last.
        # Stop if the goal is reached or cannot be reached by rounds, or if time or memory does not
        # allow this round.
        stop = decide_stop(errors_now, goal)
        if not stop:
            size = size_of_round(errors_now, goal, each)
            stop = (
                "no time for another round"
                if not size
                else ""
                if run.has_room(size)
                else "no memory for what the rays of another round meet"
            )
        started = time.monotonic()
        if stop or started - told >= seconds_per_line:
            tell(
                _describe_round(errors_now, goal, 0.0 if stop else each, run.transfer.record, stop)
            )
            told = started
        if stop:
            return run.transfer
        # A round that is interrupted leaves the run as it was before.
        try:
            run = trace_round(run, size)
        except CancelledError:
            return run.transfer
        errors_now = errors(run.transfer)
        each = (time.monotonic() - started) / size


def size_of_round(errors, goal, each):
    """Size of the next round: the samples so far are a multiple of it; 0 if the time does not allow
    one.

    Parameters
    ----------
    errors : YieldErrors
    goal : Goal
    each : float
        Time of a round of size 1 [s], as of the last one.
    """
    # Rounds double at most: the largest power of two that divides the samples so far.
    size = min(errors.rounds & -errors.rounds, goal.largest)
    # Half as many while these suffice for the target,
    if goal.target is not None:
        wanted = errors.rounds * (rounds_needed(errors, goal.target) - 1)
        while size > 1 and size / 2 >= wanted:
            size //= 2
    # and while the time left is not enough for more.
    if goal.deadline is not None:
        left = goal.deadline - time.monotonic()
        while size and size * each > left:
            size //= 2
    return size


def decide_stop(errors, goal, *, most_rounds=10_000):
    """Why to stop before the next round, or "".

    Parameters
    ----------
    errors : YieldErrors
    goal : Goal
    """
    if np.isnan(errors.at_share()):
        return "no surface carries modules, so there is no error that rounds could lower"
    # Reached; or nearly all of the error that is left is one that no round lowers.
    if goal.target is not None:
        now = errors.at_share()
        if now <= goal.target:
            return "target reached"
        least = errors.at_share(without=SAMPLED)
        # Within a tenth of what no round can lower, a target that cannot be reached ends the
        # rounds.
        if least >= goal.target and now < 1.1 * least:
            return "further rounds would not help"
    if errors.rounds >= most_rounds:
        return f"{most_rounds:,} times the samples of the first round"
    return ""


def rounds_needed(errors, target):
    """How many times the samples so far are needed for a target [%]: float, inf if it cannot be
    reached.
    """
    # Met already, or out of reach whatever the samples.
    if not errors.at_share() > target:
        return 1.0
    if errors.at_share(without=SAMPLED) >= target:
        return np.inf
    # The error falls with the samples: doubled until below the target, then bisected.
    most = 2.0
    while errors.at_share(more=most) > target:
        most *= 2
    return bisect(lambda more: errors.at_share(more=more) - target, most / 2, most)


def _describe_round(errors, goal, each, record, stop):
    """Samples, rays per second, error and what remains, as a line of text."""
    # What was reached and how fast; then why it stops, or what is still needed.
    rays = (record.hemisphere_rays or 0) + (record.shadow_rays or 0) + (record.rays or 0)
    speed = rays / max(sum(record.seconds.values()), 1e-9)
    line = f"samples × {errors.rounds}: "
    if not np.isnan(errors.at_share()):
        line += f"{errors.at_share():.2f} % on 95 % of the area with modules, "
    line += f"{speed / 1e6:.1f} Mrays/s, {describe_duration(sum(record.seconds.values()))}"
    if stop:
        return f"{line}; {stop}"
    if goal.target is not None:
        needed = rounds_needed(errors, goal.target)
        if np.isfinite(needed):
            more = errors.rounds * (needed - 1)
            line += f"; {describe_duration(max(more * each, each))} more for {goal.target:g} %"
    if goal.deadline is not None:
        line += f"; {describe_duration(max(goal.deadline - time.monotonic(), 0))} left"
    return line
