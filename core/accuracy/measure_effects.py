"""What effects change, measured: a small part of the city traced with each of them switched on and off.

Both runs have the same random numbers, so that their difference has little noise. Several pairs, each with numbers of
its own, tell how much; and where the part is one of a larger city, its surfaces tell how far others may differ. It is
the middle of the city: towards the edge less stands in the way.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..effects.plan_effects import plan_effects
from ..effects.table import TABLE
from ..energy.compute_energy import compute_energy
from ..energy.pv_system import ELECTRIC, build_system
from ..light.prepare_scene import reseed
from ..settings.progress import silent
from ..settings.threads import usable_threads
from ..sun.sky_models import choose_sky
from .pilot import choose_square, trace_part, traced_patches
from .trace_run import choose_year

TRACED = tuple(key for key in TABLE if key not in ELECTRIC)  # effects that change the light
PAIRS = 3
MOST = 1_000  # patches of the part
INNER = 0.5  # of them lie in its inner part, whose surfaces count
SUNS = "days:12"


@dataclass
class PartLight:
    """What a run of a part of a city found."""

    hours: np.ndarray  # (n,) full load hours of the city's surfaces times their area [h m²]; 0 outside the part
    seconds: np.ndarray  # (2,) [s] of processor time, before the suns and from then on
    transfer: object  # of the surfaces of the part


def measure_effects(inputs, progress=silent):
    """State share, standard error and seconds of all effects that change the light, in the plan of a city.

    The share is (with - without) / with of the full load hours. Seconds are those of a run with the same settings.

    Parameters
    ----------
    inputs : CityYear
        Its PreparedScene with the suns of the run.
    progress : callable

    Returns
    -------
    Transfer
        Of the part with all effects as planned.
    """
    plan, request = inputs.prepared.plan, replace(inputs.request, estimator="gather")
    inputs = replan(inputs._replace(request=request)) if inputs.request.estimator != "gather" else inputs
    states = {key: one for key in TRACED if (one := replan(inputs, key)).prepared.plan[key].on != plan[key].on}
    square, counted = choose_neighbourhood(inputs.prepared)
    suns, found = choose_year(inputs.weather, replace(request, suns=SUNS)), {key: [] for key in states}
    for pair in range(PAIRS):
        planned = trace_light(inputs, square, suns, pair)
        for done, (key, other) in enumerate(states.items(), start=pair * len(states)):
            progress("switching effects", done, PAIRS * len(states), "runs")
            found[key].append((planned, trace_light(other, square, suns, pair)))
    traced = traced_patches(inputs.prepared)
    part_of_all = float(square[traced].mean()) if traced.any() else 1.0
    more = np.array([1.0, len(inputs.prepared.suns) / len(suns)]) / part_of_all / usable_threads(request.threads)
    for key, pairs in found.items():
        effect = plan[key]
        runs = [pair if effect.on else pair[::-1] for pair in pairs]  # with, and without
        light = np.array([[run.hours[counted] for run in pair] for pair in runs])  # (PAIRS, 2, k) [h m²]
        spent = np.array([[run.seconds for run in pair] for pair in runs])  # (PAIRS, 2, 2) [s]
        effect.share, effect.share_standard_error = compare_light(light[:, 0], light[:, 1], 1 - part_of_all)
        effect.seconds = float(np.median((spent[:, 0] - spent[:, 1]) @ more))  # the first run loads compiled code
    return planned.transfer


def replan(inputs, key=None):
    """A city with the plan of its request, in which one effect is switched: CityYear."""
    prepared, weather, request = inputs.prepared, inputs.weather, inputs.request
    if key is not None:
        request = replace(request, effects=request.effects | {key: not prepared.plan[key].on})
    if key == "terrain-horizon" and request.horizon is None:  # there is none to be switched on
        return inputs
    known = {"materials": prepared.materials, "weather": weather, "suns": prepared.suns}
    plan = replace(plan_effects(prepared.scene, prepared.patches, request, **known), ray_scene=prepared.plan.ray_scene)
    return inputs._replace(prepared=replace(prepared, plan=plan), request=request)


def choose_neighbourhood(prepared, count=MOST):
    """So many patches of a square in the middle of the city, (p,) bool, and surfaces of its inner part, (n,) bool.

    Both are the whole city where that has no more patches than the square. Where no eligible surface lies in the inner
    part, as where the middle of a city is one large roof, those of the whole square count.
    """
    scene, traced = prepared.scene, traced_patches(prepared)
    square = choose_square(scene, prepared.patches, traced, count)
    within = square if square.all() else choose_square(scene, prepared.patches, traced, int(INNER * count))
    counted = surfaces_of(scene, within)
    return square, counted if (counted & scene.surfaces.eligible).any() else surfaces_of(scene, square)


def surfaces_of(scene, patches):
    """Surfaces of some patches: (n,) bool."""
    found, own = np.zeros(len(scene.surfaces), bool), scene.triangle_surface
    found[own[patches & (own >= 0)]] = True
    return found


def trace_light(inputs, square, suns, pair):
    """Trace a part of a city with the random numbers of one pair: PartLight."""
    request, surfaces = inputs.request, inputs.scene.surfaces
    inputs = inputs._replace(prepared=reseed(inputs.prepared, request.seed + pair))
    run, transfer, part = trace_part(inputs, square, (request.samples, request.shadow_samples), suns)
    system, sky = build_system(request), choose_sky(request, transfer)
    energy = compute_energy(transfer, inputs.weather, system, request.threads, sky=sky)
    area = np.where(energy.eligible, energy.counted_area, 0) if surfaces.eligible.any() else transfer.surfaces.area
    hours = np.zeros(len(surfaces))
    hours[part.surfaces] = np.nan_to_num(energy.full_load_hours) * area
    return PartLight(hours, np.array(run.seconds), transfer)


def compare_light(on, off, unseen):
    """What an effect adds to the light, as a share of that with it, and its standard error: two float.

    Parameters
    ----------
    on, off : (r, k) float64
        Of k surfaces, in r pairs of runs.
    unseen : float
        Share of the city that is not among the surfaces, which are taken as drawn from it.
    """
    whole = on.sum(axis=1)
    if not whole.all():
        return 0.0, 0.0
    shares = (whole - off.sum(axis=1)) / whole
    one, share = on.mean(axis=0), float(shares.mean())
    # Linearised variance of a ratio of two sums over surfaces.
    apart = one - off.mean(axis=0) - share * one
    drawn = np.sqrt(max(unseen, 0.0) * (apart**2).sum()) / one.sum()
    return share, float(np.hypot(shares.std(ddof=1) / np.sqrt(len(shares)), drawn))
