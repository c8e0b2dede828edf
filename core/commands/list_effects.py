"""`citypv effects`: what a run would simulate, why, how long it takes, and what each effect makes of the result."""

from ..energy.pv_system import build_system
from ..results.effect_shares import shares_of_effects, unshaded_transfer
from ..study import check_settings, prepare_study, read_scene, read_year


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
    check_settings(request)
    scene = read_scene(paths, request, progress)
    weather = read_year(scene.site, request)
    prepared = prepare_study(scene, weather, request)
    unshaded = unshaded_transfer(scene, prepared.suns, request.ground_albedo)
    shares = shares_of_effects(unshaded, weather, build_system(request), request.threads)
    state_shares(prepared.plan, shares)
    return prepared.plan


def state_shares(plan, shares):
    """Write shares of full load hours into the effects of a plan; those that are switched off leave out as much."""
    for key, share in shares.items():
        plan[key].share = share
        if not plan[key].on:
            plan[key].bound = abs(share)
