"""Further rounds of a run for `--target-error` and `--time-budget`."""

import time

from ..accuracy import rounds_to_target
from ..accuracy.cost_curve import WRITING
from ..accuracy.rounds_to_target import Goal
from ..accuracy.yield_errors import split_errors
from ..light.trace_run import trace_round
from ..settings.progress import TerminalProgress
from .study import compute_energy

MOMENT = 1.0  # [s] for the rest of writing


def refine_run(run, log, progress, folder):
    """Trace rounds until the target is met, the time is up, or more would not help or not fit into
    memory.

    Parameters
    ----------
    run : Run
        Of the first round, with its error of sun sampling.
    log : RunLog
    progress : Interruption
    folder : path-like
        As in `trace_scene`.

    Returns
    -------
    Transfer
    """
    # How long the end takes is measured first, as it must fit into the time: energy, and files.
    weather, request, transfer = run.weather, run.request, run.transfer
    started = time.monotonic()
    energy = compute_energy(transfer, weather, request)
    finishing = time.monotonic() - started + 2 * transfer.visible_share.nbytes / WRITING + MOMENT
    deadline = (
        None if request.time_budget is None else log.started + request.time_budget - finishing
    )

    # Errors after a round, by the hours known so far; where they meet the target, hours are
    # computed anew to confirm it.
    def judge(one):
        nonlocal energy
        log.show(one)
        errors = split_errors(one, weather, energy)
        if (
            one is not transfer
            and request.target_error is not None
            and errors.at_share() <= request.target_error
        ):
            energy = compute_energy(one, weather, request)
            errors = split_errors(one, weather, energy)
        return errors

    # The stages of every round would be many lines.
    progress.progress = TerminalProgress(log.stream, lasting=False) if log.stream else log.progress
    target = request.target_error
    # A target that no number of rays reaches is told, with the option that would help.
    if target is not None and (words := judge(transfer).say_unreachable(target)):
        log.write(words)

    # Rounds go on until target or deadline.
    goal = Goal(target, deadline, rounds_to_target.largest_round(request))
    return rounds_to_target.refine(
        run, judge, goal, lambda run, size: trace_round(run, size, progress, folder), log.write
    )
