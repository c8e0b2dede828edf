"""`citypv effects`: what a run would simulate, why, how long it takes, and what each effect makes of the result."""

from ..accuracy.measure_effects import measure_effects
from ..accuracy.pilot import CityYear
from ..energy.pv_system import build_system
from ..results.effect_shares import shares_of_effects
from ..study import check_tracing, prepare_study, read_scene, read_year
from ..transfer.prepare_scene import build_tree


def list_effects(paths, request, progress):
    """Plan of a city: each effect with reason and bound, and what it changes and takes in a small run.

    Parameters
    ----------
    paths : list of path-like
    request : Request
    progress : callable

    Returns
    -------
    TracePlan

    Raises
    ------
    InputError
    """
    check_tracing(request)
    scene = read_scene(paths, request, progress)
    weather = read_year(scene.site, request)
    prepared = build_tree(prepare_study(scene, weather, request), request)
    transfer = measure_effects(CityYear(scene, prepared, weather, request), progress)
    for key, share in shares_of_effects(transfer, weather, build_system(request), request.threads).items():
        effect = prepared.plan[key]
        effect.share = share
        if not effect.on:
            effect.bound = abs(share)
    return prepared.plan
