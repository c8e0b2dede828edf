"""Further rounds of a run for `--target-error` and `--time-budget`."""

import time

from ..accuracy.cost_curve import seconds_of_writing
from ..accuracy.rounds_to_target import Goal, refine
from ..accuracy.yield_errors import split_errors
from ..settings.progress import TerminalProgress
from .study import compute_energy


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
    # Writing is estimated from the size of the light, and a second is added for the rest.
    written = seconds_of_writing(2 * transfer.visible_share.nbytes)
    finishing = time.monotonic() - started + written + 1.0
    # Without a time budget there is no deadline.
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

    # On a terminal the stages of a round pass by without a line each, which would be many.
    progress.progress = TerminalProgress(log.stream, lasting=False) if log.stream else log.progress
    target = request.target_error
    # A target that no number of rays reaches is told, with the option that would help.
    if target is not None and (words := judge(transfer).say_unreachable(target)):
        log.write(words)

    # Rounds go on until target or deadline.
    return refine(
        run,
        judge,
        Goal.of(request, deadline),
        lambda run, size: run.add_round(size, progress, folder),
        log.write,
    )
