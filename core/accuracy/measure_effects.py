"""What effects change, measured: with each of them switched on and off.

Of effects of light, the city is traced with each of them switched, a large one with few rays. Both
runs have the same random numbers and suns, so that their difference has little noise. Several
pairs, each with its own, tell how much.

Of effects of the modules, and of Perez's sky, the full load hours of a Transfer are computed.
"""

from dataclasses import replace

import numpy as np

from ..effects.plan_effects import plan_effects
from ..effects.rays import RECEIVERS
from ..effects.table import TABLE
from ..energy.compute_energy import compute_energy
from ..energy.pv_system import ELECTRIC, build_system
from ..light.trace_run import choose_year
from ..light.transfer import SourceLight
from ..settings.progress import silent
from ..settings.request import BEST_SKY
from ..settings.threads import usable_threads
from ..sky.sky_models import choose_sky, sources_of
from .pilot import LARGE, trace_few, traced_patches

# suns of each pair, so that the pairs tell what the choice of suns does
PAIRS = (
    "days:11",
    "days:12",
    "days:13",
)
MOST_SURFACES = 64  # looked at, as evenly over the area as the eligible surfaces are


def measure_effects(inputs, progress=silent):
    """State share, standard error and seconds of all effects that change the light, in the plan of
    a city.

    The share is (with - without) / with of the full load hours. Seconds are what the effect adds to
    a run with the settings asked for. Effects that switching does not change get neither. All three
    are written into the effects of the plan, by which the city was prepared.

    Parameters
    ----------
    inputs : CityYear
        Its PreparedScene with the suns of the run.
    progress : callable

    Returns
    -------
    Transfer
        With all effects as planned, under fewer suns.
    """
    # Every run gathers light; if another estimator was asked for, the plan is made anew.
    plan, request = inputs.prepared.plan, replace(inputs.request, estimator="gather")
    inputs = (
        _replan(inputs._replace(request=request))
        if inputs.request.estimator != "gather"
        else inputs
    )
    # A city of up to 1,000 patches is traced with all rays, a larger one with 32 from each patch:
    # the difference of two runs with the same rays has little noise.
    large = traced_patches(inputs.prepared).sum() > 1_000
    samples = min(request.samples, LARGE) if large else request.samples
    # With as few rays from all patches there is nothing that `receivers` would change: it is left
    # out.
    # Effects that change the light: neither electrical ones nor shade on strings.
    traced = tuple(key for key in TABLE if key not in (*ELECTRIC, "string-shade"))
    keys = [key for key in traced if key != RECEIVERS or samples == request.samples]
    # The city again for each effect, with this one effect the other way round, if that changes it.
    others = {
        key: one
        for key in keys
        if (one := _replan(inputs, key)).prepared.plan[key].on != plan[key].on
    }
    measured = {key: [] for key in others}
    # Each pair is a run as planned and one with the effect switched, with the same suns and random
    # numbers. Suns and numbers change from pair to pair; there are three.
    for pair, days in enumerate(PAIRS):
        suns = choose_year(inputs.weather, replace(request, suns=days))
        planned = _trace_light(inputs, samples, suns, pair)
        for done, (key, other) in enumerate(others.items(), start=pair * len(others)):
            progress("switching effects", done, len(PAIRS) * len(others), "runs")
            measured[key].append((planned, _trace_light(other, samples, suns, pair)))
    # From differences of pairs: share, its standard error, and seconds that the effect takes.
    for key, pairs in measured.items():
        effect = plan[key]
        runs = [pair if effect.on else pair[::-1] for pair in pairs]  # with, and without
        # (pairs, 2)
        light, spent = (np.array([[one[k] for one in pair] for pair in runs]) for k in (0, 1))
        effect.share, effect.share_standard_error = compare_light(*light.T)
        # The median of all three pairs: the first run also loads compiled code and is slow, which
        # must not count.
        effect.seconds = float(np.median(spent[:, 0] - spent[:, 1]))
    return planned[-1]


def _replan(inputs, key=None):
    """A city with the plan of its request, in which one effect is switched: CityYear."""
    # Scene and rays stay; only the plan of effects is made anew.
    prepared, weather, request = inputs.prepared, inputs.weather, inputs.request
    if key is not None:
        request = replace(request, effects=request.effects | {key: not prepared.plan[key].on})
    if key == "terrain-horizon" and request.horizon is None:  # there is none to be switched on
        return inputs
    known = {"materials": prepared.materials, "weather": weather, "suns": prepared.suns}
    plan = replace(
        plan_effects(prepared.scene, prepared.patches, request, **known),
        ray_scene=prepared.plan.ray_scene,
    )
    return inputs._replace(prepared=replace(prepared, plan=plan), request=request)


def _trace_light(inputs, samples, suns, pair):
    """Trace a city with so many rays from a patch, and the random numbers of one pair.

    Returns
    -------
    light : float
        Full load hours of the area that counts, or of all surfaces where none does, times that area
        [h m²].
    seconds : float
        [s] that a run with the settings asked for takes, by the pilot's model of costs.
    Transfer
    """
    # Trace, and weigh the light by hours of electricity of the surfaces that count.
    request = inputs.request
    prepared = inputs.prepared.reseed(request.seed + pair)
    run, transfer = trace_few(
        inputs._replace(prepared=prepared), (samples, request.shadow_samples), suns
    )
    system, sky = build_system(request), choose_sky(request, transfer)
    energy = compute_energy(transfer, inputs.weather, system, request.threads, sky=sky)
    if inputs.scene.surfaces.eligible.any():
        hours = (
            energy.capacity_factor.sum(axis=0)
            * energy.interval.total_seconds()
            / 3600
            / energy.years
        )
        light = hours @ energy.group_area
    else:
        light = transfer.surfaces.area @ np.nan_to_num(energy.full_load_hours)
    # The run asked for, predicted from the seconds of this small one.
    whole = replace(run, samples=request.samples, suns=len(prepared.suns))
    seconds = run.predict_seconds(whole) / usable_threads(request.threads)
    return float(light), seconds, transfer


def compare_light(on, off):
    """What an effect adds to the light, as a share of that with it, and its standard error: two
    float.

    `on` and `off` are (r,) float64, of r pairs of runs.
    """
    if not on.all():
        return 0.0, 0.0
    shares = (on - off) / on
    return float(shares.mean()), float(shares.std(ddof=1) / np.sqrt(len(shares)))


def shares_of_effects(transfer, weather, system, threads=None, *, sky="isotropic"):
    """Share of full load hours that each effect of the modules adds, or takes if negative.

    Parameters
    ----------
    transfer : Transfer
        Of it MOST_SURFACES eligible surfaces are looked at, or all if no more are eligible.
    weather : Weather
    system : PvSystem
    threads : int, optional
    sky : str
        Model of the diffuse sky, as of `compute_energy`.

    Returns
    -------
    dict of str to float
        (with - without)/with, of the area-weighted full load hours; empty if no surface is
        eligible.
    """
    # Electricity alone is computed again, on some surfaces, with each effect the other way round.
    rows, weight = _draw_surfaces(transfer.surfaces)
    few = transfer.take(rows)
    if not len(rows):
        return {}

    def hours(switched):
        energy = compute_energy(few, weather, replace(system, **switched), threads, sky=sky)
        return float(weight @ np.nan_to_num(energy.full_load_hours))

    as_set, shares = hours({}), {}
    for key in ELECTRIC:
        as_switched = getattr(system, key)
        other = hours({key: not as_switched})
        on, off = (as_set, other) if as_switched else (other, as_set)
        shares[key] = (on - off) / on if on > 0 else 0.0
    return shares


def state_effects(summary, transfer, weather, system, *, sky, threads=None):
    """Write the measured shares into the effects of a summary; without a plan (a file of long ago)
    there are none.

    Parameters
    ----------
    summary : dict
        Of `summarise`; changed.
    transfer : Transfer
    weather : Weather
    system : PvSystem
        Of this year's electricity, which may differ from the electricity of the traced run, as may
        the sky.
    sky : str
        Model of the sky that weighed the Transfer.
    threads : int, optional

    Returns
    -------
    dict of str to float
        Of `shares_of_effects`.
    """
    # Shares of the modules' effects, and of Perez' sky, go to the plan that was made before
    # tracing.
    shares = shares_of_effects(transfer, weather, system, threads, sky=sky)
    if shares:
        measured = {key: (share, abs(share), getattr(system, key)) for key, share in shares.items()}
        measured[BEST_SKY] = *share_of_sky(transfer, weather, system, threads), sky == BEST_SKY
        state_shares(summary, measured)
    return shares


def state_shares(summary, shares):
    """Write share and outcome of effects, `shares` by key: share, what is left out without it, and
    whether it is on.
    """
    for effect in summary["traced"].get("effects") or ():
        if effect["key"] not in shares:
            continue
        # What an effect leaves out when off is held against the bound that the plan gave.
        share, most, on = shares[effect["key"]]
        if on != effect.get("on", on):  # decided anew by `citypv yield`
            effect.update(
                on=on,
                extent="simulated" if on else "left out",
                reason=f"switched {'on' if on else 'off'}",
                bound=0.0 if on else None,
                outcome=None,
            )
        effect["share"] = share
        if not on or not effect.get("outcome"):
            left_out = 0.0 if on else most
            bound = left_out if effect.get("bound") is None else effect["bound"]
            effect["outcome"] = {"left_out": left_out, "holds": bool(left_out <= bound)}


def _draw_surfaces(surfaces):
    """Eligible surfaces, or of many some at equal steps of their summed area, ordered by tilt and
    azimuth.

    Returns
    -------
    rows : (k,) int
    weight : (k,) float64
    """
    # Ordered by how they face, and drawn at equal steps of area: each drawn one stands for as much.
    rows = np.flatnonzero(surfaces.eligible)
    if len(rows) <= MOST_SURFACES:
        return rows, surfaces.area[rows]
    order = rows[np.lexsort([surfaces.surface_azimuth[rows], surfaces.surface_tilt[rows]])]
    area = np.cumsum(surfaces.area[order])
    steps = (np.arange(MOST_SURFACES) + 0.5) / MOST_SURFACES * area[-1]
    return order[np.searchsorted(area, steps)], np.ones(MOST_SURFACES)


def share_of_sky(transfer, weather, system, threads=None):
    """Share of full load hours that Perez's sky adds, or takes if negative.

    Where a source of light was not traced, each surface sees as much of it as of the sky that it
    faces.

    Returns
    -------
    share : float
        (Perez - isotropic)/Perez, of the area-weighted full load hours.
    largest : float
        Largest of all kinds and orientations, without sign.
    """
    # Hours under both models of the sky on a few surfaces, of all of them and of each group.
    rows, weight = _draw_surfaces(transfer.surfaces)
    few = _with_sources(transfer.take(rows))
    of_sky = [
        compute_energy(few, weather, system, threads, sky=sky).full_load_hours
        for sky in (BEST_SKY, "isotropic")
    ]
    names = np.char.add(
        np.asarray(few.surfaces.kind, str), np.asarray(few.surfaces.orientation, str)
    )
    groups = [np.where(names == name, weight, 0) for name in np.unique(names)]
    best, isotropic = np.nan_to_num(of_sky)
    sums = ((weights @ best, weights @ (best - isotropic)) for weights in (weight, *groups))
    share, *of_groups = (float(change / whole) if whole > 0 else 0.0 for whole, change in sums)
    return share, max(map(abs, of_groups))


def _with_sources(transfer):
    """A Transfer, and its state without leaves, whose surfaces see as much of each source of light
    as of the sky.
    """
    bare = transfer.bare and _with_sources(transfer.bare)
    normal = np.asarray(transfer.surfaces.normal, float)
    # openness  share of the sky visible of what the surface faces [–].
    openness = np.clip(transfer.sky_view_factor / np.maximum((1 + normal[:, 2]) / 2, 1e-9), 0, 1)
    views = {source.name: source.unshaded(normal) * openness for source in sources_of(BEST_SKY)}
    estimated = {name: SourceLight(view, view, np.zeros(len(view))) for name, view in views.items()}
    return replace(transfer, bare=bare, sources=estimated | transfer.sources)
