"""Further rounds of tracing until a target of accuracy is met or the time is up.

    round 1 ─► Transfer ─► errors ─► within the target, or no time for another round? ─► done
                  ▲                        │ no
                  └── merge ◄── round k ◄──┘

Every round is a complete trace with random numbers of its own, so results after k rounds are the same however it was
decided to stop there.
"""

import time
from dataclasses import dataclass, replace

import numpy as np

from ..progress import CancelledError
from ..transfer.merge_transfers import add_round
from .yield_errors import SAMPLED, SOURCES

CELLS = 16  # shadow points from which patches are resolved into as many elements
MOST_ROUNDS = 10_000
CLOSE = 1.1  # where a target cannot be reached: error, over what no round can lower, at which to stop
SECONDS_PER_LINE = 2.0
NOTHING_COUNTS = "no surface is eligible, so there is no error that rounds could lower"


@dataclass
class Goal:
    """When to stop."""

    target: float | None  # [%] of full load hours, on 95 % of the eligible area
    deadline: float | None  # `time.monotonic()` at which tracing must end [s]


def refine_transfer(transfer, errors, goal, trace_round, tell):
    """Trace and merge rounds until the goal is reached.

    Parameters
    ----------
    transfer : Transfer
        The first round.
    errors : callable
        `errors(transfer)` gives its YieldErrors.
    goal : Goal
    trace_round : callable
        `trace_round(index)` gives the Transfer of a further round, index from 1.
    tell : callable
        Called with a line of text after each round.

    Returns
    -------
    Transfer
        Of all rounds that were finished. Matrices of the given one are overwritten.
    """
    found, lasted, told = errors(transfer), sum(transfer.record.seconds.values()), -SECONDS_PER_LINE
    while True:
        stop = decide_stop(found, goal, lasted)
        started = time.monotonic()
        if stop or started - told >= SECONDS_PER_LINE:
            tell(describe_round(found, goal, lasted, transfer.record, stop))
            told = started
        if stop:
            return transfer
        try:
            more = trace_round(transfer.record.rounds)
        except CancelledError:
            return transfer
        if more.record.interrupted:  # by some suns only: not a whole round
            return transfer
        transfer = add_round(transfer, more)
        found = errors(transfer)
        lasted = time.monotonic() - started


def decide_stop(errors, goal, lasted):
    """Why to stop before the next round, or "".

    Parameters
    ----------
    errors : YieldErrors
    goal : Goal
    lasted : float
        Time of the last round [s].
    """
    if np.isnan(errors.at_share()):
        return NOTHING_COUNTS
    if goal.target is not None:
        now = errors.at_share()
        if now <= goal.target:
            return "target reached"
        least = errors.at_share(without=SAMPLED)
        if least >= goal.target and now < CLOSE * least:
            return "further rounds would not help"
    if goal.deadline is not None and time.monotonic() + lasted > goal.deadline:
        return "no time for another round"
    if errors.rounds >= MOST_ROUNDS:
        return f"{MOST_ROUNDS:,} rounds"
    return ""


def rounds_needed(errors, target):
    """How many times the rounds so far are needed for a target [%]: float, inf if it cannot be reached."""
    if not errors.at_share() > target:
        return 1.0
    if errors.at_share(without=SAMPLED) >= target:
        return np.inf
    least, most = 1.0, 2.0
    while errors.at_share(more=most) > target:
        least, most = most, 2 * most
    for _ in range(30):
        middle = (least + most) / 2
        least, most = (middle, most) if errors.at_share(more=middle) > target else (least, middle)
    return most


def describe_round(errors, goal, lasted, record, stop):
    """Rounds, rays per second, error and what remains, as a line of text."""
    rays = (record.hemisphere_rays or 0) + (record.shadow_rays or 0) + (record.rays or 0)
    speed = rays / max(sum(record.seconds.values()), 1e-9)
    line = f"round {errors.rounds}: "
    if not np.isnan(errors.at_share()):
        line += f"{errors.at_share():.2f} % on 95 % of the eligible area, "
    line += f"{speed / 1e6:.1f} Mrays/s, {sum(record.seconds.values()):.0f} s"
    if stop:
        return f"{line}; {stop}"
    if goal.target is not None:
        needed = rounds_needed(errors, goal.target)
        if np.isfinite(needed):
            more = int(np.ceil(errors.rounds * (needed - 1) - 1e-9))
            line += f"; about {more:,} more for {goal.target:g} %, {more * lasted:.0f} s"
    if goal.deadline is not None:
        line += f"; {max(goal.deadline - time.monotonic(), 0):.0f} s left"
    return line


def unreachable(errors, target, shadow_samples):
    """Why no number of rounds reaches a target [%], and the option that would help: (str, str), or None."""
    left = errors.at_share(without=SAMPLED)
    if not left >= target:
        return None
    fixed = replace(errors, variance={name: errors.variance[name] for name in SOURCES if name not in SAMPLED})
    cure = {
        "suns": "--suns with more days, or hourly",
        "discretisation": "--shadow-samples 16" if shadow_samples < CELLS else "a smaller --patch-size",
    }[fixed.largest()]
    words = f"{SOURCES[fixed.largest()]} alone leaves {left:.2f} % whatever the number of rays"
    return words, f"give {cure}, or a target above {left:.2f}"
