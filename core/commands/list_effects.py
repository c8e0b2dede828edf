"""`citypv effects`: what a run would simulate, why, how long it takes, and what each effect makes of the result."""

from ..accuracy.effect_shares import shares_of_effects, unshaded_transfer
from ..energy.pv_system import build_system
from ..study import check_tracing, prepare_study, read_scene, read_year
from .predict_seconds import predict_seconds


def list_effects(paths, request, progress):
    """Plan of a city: each effect with reason, bound, predicted seconds and expected share of full load hours.

    Parameters
    ----------
    paths : list of path-like
    request : Request
    progress : callable

    Returns
    -------
    EffectPlan

    Raises
    ------
    InputError
    """
    check_tracing(request)
    scene = read_scene(paths, request, progress)
    weather = read_year(scene.site, request)
    prepared = prepare_study(scene, weather, request)
    unshaded = unshaded_transfer(scene, prepared.suns, request.ground_albedo)
    shares = shares_of_effects(unshaded, weather, build_system(request), request.threads)
    state_shares(prepared.plan, shares)
    if request.estimator == "gather":
        state_seconds(prepared.plan, predict_seconds(prepared, request))
    return prepared.plan


def state_seconds(plan, seconds):
    """Write predicted seconds into the effects that cost them."""
    found = {
        "sky-rays": seconds.sky_rays,
        "shadow-rays": seconds.shadow_rays,
        "reflections": seconds.reflections,
        "perez": seconds.sources,
    }
    for effect in plan.effects:
        effect.seconds = found.get(effect.key, effect.seconds)


def state_shares(plan, shares):
    """Write shares of full load hours into the effects of a plan; those that are switched off leave out as much."""
    for key, share in shares.items():
        plan[key].share = share
        if not plan[key].on:
            plan[key].bound = abs(share)
