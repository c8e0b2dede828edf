"""Settings that make the best of `--time-budget`: predicted seconds and errors of suns, rays and points.

    pilot ─► seconds and errors of each choice ─► least error after all rounds that the time allows

Rounds lower the errors of rays and points only, so the suns have to be right at the beginning.
"""

import time
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ..accuracy.price_list import price_city
from ..accuracy.sun_sampling import CityYear
from ..light.prepare_scene import build_tree, prepare_scene
from ..settings.progress import describe_duration
from ..settings.request import option_of
from .refine_run import MOMENT

CHOICES = {  # what each free setting may be, cheapest first
    "suns": ("days:4", "days:12", "days:24", "days:52"),
    "samples": (64, 256, 1024),
    "shadow_samples": (4, 16, 64),
}

FIRST = 0.9  # of the time left, for the first round at most
PLANNING = 0.5  # of the time left, for planning at most: a pilot that takes longer is given up


@dataclass
class Offer:
    """Settings, and what they are predicted to do."""

    settings: dict  # of CHOICES
    seconds: float  # of the first round
    writing: float  # [s] that grows with the suns
    errors: object  # YieldErrors after the first round

    def error_in(self, seconds):
        """Error [%] on 95 % of the eligible area after all rounds that this time allows."""
        left = max(seconds - self.writing - self.seconds, 0.0)
        return self.errors.at_share(more=1 + left / max(self.seconds, 1e-9))


def spend_budget(scene, weather, request, free, log):
    """Choose the free settings for a time budget, of which this takes its part, and tell.

    Parameters
    ----------
    scene : Scene
    weather : Weather
    request : Request
        With a time budget.
    free : collection of str
        Of `CHOICES`.
    log : RunLog

    Returns
    -------
    Request
    """
    if request.estimator == "forward":  # its photons have no prices
        return request
    deadline, cheapest = log.started + request.time_budget, {name: CHOICES[name][0] for name in free}
    left = deadline - time.monotonic()
    if left < 0:
        return take(request, cheapest, log, "the time is up: the cheapest settings")
    latest = deadline - (1 - PLANNING) * left

    def report(*told):
        if time.monotonic() > latest:
            raise PlanningTooLongError
        log.progress(*told)

    prepared = build_tree(prepare_scene(scene, request, weather=weather), request)
    try:
        offers, finishing = make_offers(CityYear(scene, prepared, weather, request), free, report)
    except PlanningTooLongError:
        return take(request, cheapest, log, "the cheapest settings, since the pilot takes half of the time")
    left = deadline - time.monotonic() - finishing
    chosen = choose_offer(offers, left, request.target_error)
    why = f"with {describe_duration(chosen.seconds)} for the first of the rounds in {describe_duration(left)}"
    if chosen.seconds + chosen.writing > left:
        takes, rest = (describe_duration(max(one, 0)) for one in (chosen.seconds + chosen.writing, left))
        why = f"the cheapest settings, since even these take {takes}, and {rest} is left"
    elif np.isfinite(error := chosen.error_in(left)):
        why += f", predicted {error:.2f} % on 95 % of the eligible area"
    return take(request, {name: chosen.settings[name] for name in free}, log, why)


class PlanningTooLongError(Exception):
    """Planning takes more than its part of the time."""


def take(request, settings, log, why):
    """The Request with other settings; one line tells these and why."""
    words = " ".join(f"{option_of(name)} {value}" for name, value in settings.items())
    log.write(f"Chosen for {request.time_budget:g} s: {words}: {why}")
    return replace(request, **settings)


def make_offers(inputs, free, progress):
    """Offers of all combinations of the free settings, and seconds that every run takes after tracing."""
    choices = {name: CHOICES[name] if name in free else (getattr(inputs.request, name),) for name in CHOICES}
    city = price_city(inputs, choices["suns"], progress)
    offers = []
    for values in product(*choices.values()):
        settings = dict(zip(choices, values, strict=True))
        request = replace(inputs.request, **settings)
        seconds, _, writing = city.predict_seconds(request)
        offers.append(Offer(settings, seconds, writing, city.predict_errors(request)))
    return offers, city.checking + 2 * city.pilot.electricity + MOMENT


def choose_offer(offers, left, target=None):
    """The offer with the least error in the time left, or the fastest that reaches a target; the cheapest if none fits.

    Parameters
    ----------
    offers : list of Offer
    left : float
        [s]
    target : float, optional
        [%]

    Returns
    -------
    Offer
    """
    fitting = [one for one in offers if one.seconds + one.writing <= FIRST * left]
    if not fitting:
        return min(offers, key=lambda one: one.seconds + one.writing)
    return min(
        fitting, key=lambda one: (max(np.nan_to_num(one.error_in(left), posinf=0.0), target or 0.0), one.seconds)
    )
