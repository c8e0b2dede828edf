"""Whether `--target-error` and `--time-budget` can be kept, by a pilot, before the first round is
traced.
"""

import math
import time
from dataclasses import replace

from ..light.prepare_scene import prepare_scene
from ..settings.errors import InputError
from ..settings.progress import describe_duration
from .cost_curve import predict_city
from .rounds_to_target import CELLS
from .sun_sampling import CityYear
from .yield_errors import CERTAIN, SOURCES


def check_goal(scene, weather, request, log):
    """Refuse a target below what the choice of suns leaves, and a time in which not even the first
    round is traced.

    Photons have no prices: with them nothing is refused. With a time budget that suffices, a line
    of the log says how much of it the first round takes.

    Parameters
    ----------
    scene : Scene
    weather : Weather
    request : Request
        With a target, a time budget or both.
    log : RunLog

    Raises
    ------
    InputError
        The target is below what the suns leave, or the first round does not end within the time.
    """
    if request.estimator == "forward":
        return
    # A run with rounds has 16 shadow points at least.
    request = replace(request, shadow_samples=max(request.shadow_samples, CELLS))
    # A pilot with few rays predicts errors and seconds of the run.
    prepared = prepare_scene(scene, request, weather=weather).build_tree(request)
    city = predict_city(CityYear(scene, prepared, weather, request), (request.suns,), log.progress)
    errors = city.predict_errors(request)
    # Rounds lower what rays and points leave, but not what the suns do. That part of the predicted
    # error is an estimate: a target is refused only if it lies below 0.8 of it.
    of_suns = errors.at_share(without=[source for source in SOURCES if source != "suns"])
    if request.target_error is not None and CERTAIN * of_suns > request.target_error:
        cure = "hourly" if request.suns == "days:52" else "days:52"
        raise InputError(
            "--target-error",
            f"{request.target_error:g} % is below the {of_suns:.2f} % that --suns {request.suns} "
            "leaves",
            f"give --suns {cure}, or a target above {of_suns:.2f}",
        )
    # Without a time budget there is nothing more to refuse.
    if request.time_budget is None:
        return
    # The time that is spent so far, the first round, and electricity before and after it must
    # together fit into the budget.
    tracing, _, writing = city.predict_seconds(request)
    # A second for the rest of writing, as in `run.rounds`.
    first = tracing + writing + city.checking + 2 * city.pilot.electricity + 1.0
    spent = time.monotonic() - log.started
    if spent + first > request.time_budget:
        parts = (
            f"the pilot ends after {describe_duration(spent)}, the first round takes "
            f"{describe_duration(first)}"
        )
        # Speeds differ from one run to the next: the budget that is named is a quarter longer.
        least = math.ceil(1.25 * (spent + first))
        cure = f"give --time-budget {least} at least, or --suns with fewer days"
        raise InputError("--time-budget", f"{request.time_budget:g} s are too few: {parts}", cure)
    told = (
        f"{describe_duration(first)} of {describe_duration(request.time_budget - spent)} for the "
        "first round"
    )
    log.write(f"--samples {request.samples} --shadow-samples {request.shadow_samples}: {told}")
