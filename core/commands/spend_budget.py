"""Settings that make the best of `--time-budget`: predicted seconds and errors of suns, rays and points.

    pilot ─► errors of each source, error of each choice of suns ─┐
                                                                  ├─► least error after all rounds that the time allows
    a few patches, timed ─► seconds of rays, points and entries ──┘

Rounds lower the errors of rays and points only, so the suns have to be right at the beginning.
"""

import time
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ..accuracy.foresee_target import measure_suns, trace_square, with_suns
from ..accuracy.pilot import Pilot
from ..accuracy.pilot_run import SUNS
from ..accuracy.predict import USUAL, Knobs, of_sky, of_suns, predict_seconds, price_pilot, terms_of_suns, wall_of
from ..accuracy.sun_sampling import FEWER, name_groups
from ..accuracy.survey import survey_city, work_of_patches
from ..accuracy.time_electricity import time_electricity
from ..accuracy.time_patches import time_patches
from ..accuracy.yield_errors import SAMPLED
from ..light.prepare_scene import build_tree, prepare_scene
from ..request import option_of
from ..sun.choose_suns import choose_suns
from ..sun.spread_suns import spread_suns
from .refine_run import ADAPTIVE, MOMENT, WRITING

CHOICES = {  # what each free setting may be, cheapest first
    "suns": ("days:4", "days:12", "days:24", "days:52"),
    "samples": (64, 256, 1024),
    "shadow_samples": (4, 16, 64),
}

FIRST = 0.9  # of the time left, for the first round at most
FINE = 256, 16  # rays and points from which rounds are adaptive


@dataclass
class Offer:
    """Settings, and what they are predicted to do."""

    settings: dict  # of CHOICES
    seconds: float  # of the first round
    writing: float  # [s] that grows with the suns
    errors: object  # YieldErrors after the first round

    def error_in(self, seconds):
        """Error [%] on 95 % of the eligible area after all rounds that this time allows."""
        fine = all(np.array([self.settings["samples"], self.settings["shadow_samples"]]) >= FINE)
        left = max(seconds - self.writing - self.seconds, 0.0)
        return self.errors.at_share(more=1 + (ADAPTIVE if fine else 1) * left / max(self.seconds, 1e-9))


def spend_budget(inputs, free, log):
    """Choose the free settings for a time budget, and tell.

    Parameters
    ----------
    inputs : tuple of Scene, Weather and Request
        The Request with a time budget.
    free : collection of str
        Of `CHOICES`.
    log : RunLog

    Returns
    -------
    Request
    """
    scene, weather, request = inputs
    if request.estimator == "forward":  # its photons have no prices
        return request
    deadline = log.started + request.time_budget
    if deadline < time.monotonic():
        return take(request, {name: CHOICES[name][0] for name in free}, log, "the time is up: the cheapest settings")
    prepared = build_tree(prepare_scene(scene, request, weather=weather), request)
    offers, finishing = make_offers((scene, prepared, weather, request), free, log.progress)
    left = deadline - time.monotonic() - finishing
    chosen = choose_offer(offers, left, request.target_error)
    error = chosen.error_in(left)
    if chosen.seconds + chosen.writing > left:
        why = f"the cheapest settings, since even these take about {chosen.seconds + chosen.writing:.0f} s of"
        return take(request, {name: chosen.settings[name] for name in free}, log, f"{why} {max(left, 0):.0f} s left")
    why = f"with {chosen.seconds:.1f} s for the first of the rounds in {left:.0f} s"
    why += f", predicted {error:.2f} % on 95 % of the eligible area" if np.isfinite(error) else ""
    return take(request, {name: chosen.settings[name] for name in free}, log, why)


def take(request, settings, log, why):
    """The Request with other settings; one line tells these and why."""
    words = " ".join(f"{option_of(name)} {value}" for name, value in settings.items())
    log.write(f"Chosen for {request.time_budget:g} s: {words}: {why}")
    return replace(request, **settings)


def make_offers(inputs, free, progress):
    """Offers of all combinations of the free settings, and seconds that every run takes after tracing."""
    _, prepared, weather, request = inputs
    choices = {name: CHOICES[name] if name in free else (getattr(request, name),) for name in CHOICES}
    square, transfer = trace_square(inputs, SUNS, progress)
    started = time.monotonic()
    suns, found = measure_suns(inputs, transfer, choices["suns"], progress, FEWER)
    checking = time.monotonic() - started  # a run looks at twice as many patches, under one choice of suns
    names = name_groups(transfer.surfaces)
    known = {
        way: (len(one), with_suns(square.errors, part, names))
        for way, one, part in zip(choices["suns"], suns, found, strict=True)
    }
    prices, offers = price_rounds(inputs, square), []
    for way, rays, points in product(*choices.values()):
        many, one = known[way]
        knobs = Knobs(rays, points, many, way, prepared.plan.max_bounces or 4, request.patch_size)
        settings = {"suns": way, "samples": rays, "shadow_samples": points}
        writing = prices.bytes_per_sun * many / WRITING
        errors = scale_errors(one, rays / square.samples, points / square.shadow_samples)
        offers.append(Offer(settings, predict_seconds(prices, knobs)[0], writing, errors))
    return offers, checking + 2 * time_electricity(transfer, weather, request) + MOMENT


def price_rounds(inputs, square):
    """Prices from patches drawn from the whole city, and from the run of a square."""
    scene, prepared, weather, request = inputs
    suns = spread_suns(choose_suns(SUNS, *weather.axis, request.seed, position=weather.data))
    empty, timed = time_patches((scene, prepared, weather, request, suns), square)
    pilot = Pilot({"A": square}, timed, empty, survey_city(prepared, request), 0.0, None)
    return raise_prices(price_pilot(pilot, 0.0, request.patch_size, len(scene.surfaces)), square)


def raise_prices(prices, square):
    """The prices, where they are too low for the run of a square raised to what that took: Prices.

    Those of few patches are differences of short times, which noise can make too small.
    """
    work = work_of_patches(prices.survey, square.counts, square.samples, square.shadow_samples)
    terms = np.array(terms_of_suns(work, square.bounces, square.suns))
    sky, suns = (
        raise_costs(costs, of_work, max(taken - square.share * overhead, 0.0))
        for costs, of_work, taken, overhead in (
            (prices.sky, np.array([work.patches, work.rays]), of_sky(square), prices.overhead[0]),
            (prices.suns, terms, of_suns(square), prices.overhead[1] * square.suns),
        )
    )
    return replace(prices, sky=sky, suns=suns, wall=max(prices.wall, wall_of([square])))


def raise_costs(costs, terms, seconds):
    """Costs whose sum over some terms is that many seconds at least, shared out as before, or evenly: (k,) float64."""
    found = costs @ terms
    if found >= seconds:
        return costs
    return costs * (seconds / found) if found > 0.5 * seconds else costs + (seconds - found) / len(terms) / terms


def scale_errors(errors, rays, points):
    """YieldErrors with so many times the rays and points."""
    more = {"rays": rays, "shadows": points, "passed_on": rays}
    variance = {
        name: part / more[name] ** USUAL[name] if name in SAMPLED else part for name, part in errors.variance.items()
    }
    return replace(errors, variance=variance)


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

    def merit(one):
        error = one.error_in(left)
        return max(error if np.isfinite(error) else 0.0, target or 0.0), one.seconds

    return min(fitting, key=merit)
