"""Price list of a scene: predicted seconds and errors of presets and of each setting, from a pilot."""

import time
from dataclasses import dataclass, replace

import numpy as np

from ..light.prepare_scene import build_tree, prepare_scene
from ..presets import PRESETS
from ..progress import silent
from ..sun.choose_suns import choose_suns
from .fill_untraced import fill_untraced
from .pilot import run_pilot
from .predict import Knobs, left_by_bounces, predict_errors, predict_seconds, price_pilot
from .sun_sampling import FEWER, TracedYear, measure_ways, name_groups, shares_of_names
from .yield_errors import SOURCES

WAYS = ("days:12", "days:24", "days:52", "typical-days:12", "sky-grid:1654", "hourly")
SAMPLES = (64, 256, 1024, 4096)
POINTS = (4, 16, 64, 256)


@dataclass
class Price:
    """One line of the list."""

    name: str
    knobs: Knobs
    seconds: float  # of the whole run
    tracing: float  # [s] wall time of tracing
    processor: float  # [s] processor time of tracing
    median: float  # [%] error of full load hours of half of the eligible area
    error: float  # [%] on 95 % of the eligible area
    largest: str | None  # source of the largest part of it
    bounces_left: float  # [%] of all light that further reflections would add, about

    def as_dict(self):
        """Plain types by name."""
        return {**vars(self), "knobs": vars(self.knobs)}


@dataclass
class PriceList:
    """What accuracy costs on a scene."""

    prices: list  # of Price: the presets first
    pilot_seconds: float
    patches: int
    fixed: float  # [s] of every run: reading, preparing, sun sampling, electricity


def list_prices(scene, weather, request, reading=0.0, progress=silent):
    """Trace a pilot and predict what accuracy costs.

    Parameters
    ----------
    scene : Scene
    weather : Weather
    request : Request
        Whose settings are varied one at a time.
    reading : float
        Seconds that reading took.
    progress : callable

    Returns
    -------
    PriceList
    """
    started = time.perf_counter()
    prepared = build_tree(prepare_scene(scene, request, weather=weather), request)
    preparing = time.perf_counter() - started
    pilot = run_pilot(scene, prepared, weather, request, progress)
    names = list(dict.fromkeys([request.suns, *WAYS]))
    ways = {name: choose_suns(name, *weather.axis, request.seed, position=weather.data) for name in names}
    clock = time.perf_counter()
    whole = fill_untraced(pilot.transfer, name_groups(pilot.transfer.surfaces))
    traced = TracedYear(scene, weather, whole, request)
    measured = measure_ways(traced, list(ways.values()), progress, prepared=prepared, patches=FEWER)
    checking = time.perf_counter() - clock  # a run looks at twice as many patches, under one choice of suns
    sampling = dict(zip(names, (sampling_of_surfaces(one, pilot) for one in measured), strict=True))
    fixed = reading + preparing + checking + pilot.electricity
    prices = price_pilot(pilot, fixed, request.patch_size, len(scene.surfaces))
    own = Knobs(
        request.samples,
        request.shadow_samples,
        len(ways[request.suns]),
        request.suns,
        prepared.plan.max_bounces or 4,
        request.patch_size,
    )

    def price(name, **changes):
        if "way" in changes:
            changes["suns"] = len(ways[changes["way"]])
        knobs = replace(own, **changes)
        errors = predict_errors(pilot, knobs, sampling[knobs.way], request.patch_size)
        wall, processor, whole = predict_seconds(prices, knobs)
        left = 100 * left_by_bounces(pilot, knobs.bounces)
        return Price(
            name, knobs, whole, wall, processor, errors.at_share(share=0.5), errors.at_share(), errors.largest(), left
        )

    listed = [price(name, **knobs_of_preset(name)) for name in PRESETS]
    listed += [price(f"--samples {count}", samples=count) for count in SAMPLES]
    listed += [price(f"--shadow-samples {count}", shadow_samples=count) for count in POINTS]
    listed += [price(f"--suns {way}", way=way) for way in names]
    listed += [price(f"--max-bounces {count}", bounces=count) for count in range(6)]
    if request.patch_size:
        listed += [price(f"--patch-size {size:g}", patch_size=size) for size in (20.0, 10.0, 5.0)]
    listed += [price(f"{rounds} rounds", rounds=rounds) for rounds in (4, 16)]
    return PriceList(listed, time.perf_counter() - started, len(prepared.patches), fixed)


def knobs_of_preset(name):
    """Changes of Knobs that a preset stands for; what it does not name is the program's default."""
    settings = {"samples": 256, "shadow_samples": 16, "suns": "days:24", **PRESETS[name]}
    found = {key: settings[key] for key in ("samples", "shadow_samples", "patch_size") if key in settings}
    found["way"] = settings["suns"]
    if "max_bounces" in settings:
        found["bounces"] = settings["max_bounces"]
    return found


def sampling_of_surfaces(measured, pilot):
    """Error of a choice of suns for each surface of the pilot, as a share of its hours: (e,) float64."""
    return shares_of_names(measured, name_groups(pilot.transfer.surfaces)[pilot.runs["A"].errors.rows], "rms")


def describe_prices(listed):
    """The list as lines of text."""
    lines = [
        f"{listed.patches:,} patches; the pilot took {listed.pilot_seconds:.0f} s; "
        f"reading, checks and files add about {listed.fixed:.0f} s to tracing",
        "Standard error of full load hours that half and 95 % of the eligible area do not exceed, its largest part, "
        "and the light beyond the last reflection:",
        f"{'':24} {'seconds':>8} {'tracing':>8} {'half of':>8} {'95 % of':>8} {'largest part':14} {'reflections':>11}",
        f"{'':24} {'':>8} {'':>8} {'area, %':>8} {'area, %':>8} {'':14} {'left out, %':>11}",
    ]
    for one in listed.prices:
        source = {"passed_on": "reflected", "discretisation": "patch size"}.get(one.largest, one.largest or "none")
        lines.append(
            f"{one.name:24} {one.seconds:8.1f} {one.tracing:8.1f} {write_percent(one.median):>8} "
            f"{write_percent(one.error):>8} {source:14} {one.bounces_left:11.2f}"
        )
    if not any(np.isfinite(one.error) for one in listed.prices):
        lines.append("No surface is eligible for photovoltaics, so there are no errors of full load hours to predict.")
    return lines


def write_percent(value):
    """A percentage with two decimals, or a dash where it is not known."""
    return f"{value:.2f}" if np.isfinite(value) else "–"


def price_as_dict(listed):
    """The list in plain types."""
    return {
        **{name: getattr(listed, name) for name in ("patches", "pilot_seconds", "fixed")},
        "sources": SOURCES,
        "prices": [one.as_dict() for one in listed.prices],
        "unit": "s, percent of full load hours",
    }
