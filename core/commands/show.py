"""`citypv effects`, `citypv accuracy` and `citypv plot`: what is shown without a run, or
after it.
"""

import importlib.util
import time
from pathlib import Path

from ..accuracy.cost_curve import predict_costs
from ..accuracy.measure_effects import measure_effects, shares_of_effects
from ..accuracy.sun_sampling import CityYear
from ..energy.pv_system import build_system
from ..run import study
from ..settings.errors import InputError
from ..settings.progress import TerminalProgress
from ..sky.sky_models import choose_sky
from ..weather.find_source import refuse_settings


def list_effects(paths, request, progress):
    """Plan of a city: each effect with reason and bound, and what it changes and takes in a small
    run.

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
    study.check_tracing(request)
    scene = study.read_scene(paths, request, progress)
    weather = study.read_year(scene.site, request)
    prepared = study.prepare_study(scene, weather, request).build_tree(request)
    transfer = measure_effects(CityYear(scene, prepared, weather, request), progress)
    for key, share in shares_of_effects(
        transfer,
        weather,
        build_system(request),
        threads=request.threads,
        sky=choose_sky(request, transfer),
    ).items():
        effect = prepared.plan[key]
        effect.share = share
        if not effect.on:
            effect.bound = abs(share)
    return prepared.plan


PICTURES = (".png", ".svg", ".pdf")


def show_accuracy(paths, request, plot=None):
    """Predict seconds and errors of presets and settings: CostCurve.

    Parameters
    ----------
    paths : list of path-like
    request : Request
        Its settings are varied one at a time.
    plot : path-like, optional
        Picture to write.

    Raises
    ------
    InputError
    """
    if plot and not str(plot).endswith(PICTURES):
        raise InputError(
            "--plot", f"{plot} is not a picture", f"give a name that ends in {', '.join(PICTURES)}"
        )
    refuse_settings(request, ("least_hours", "leave_out"), "errors, which are those of all faces")
    study.check_tracing(request)
    started, progress = time.perf_counter(), TerminalProgress(lasting=False)
    scene = study.read_scene(paths, request, progress)
    weather = study.read_year(scene.site, request)
    curve = predict_costs(scene, weather, request, time.perf_counter() - started, progress)
    if plot:
        from ..results.draw_results import draw_cost_curve

        draw_cost_curve(curve, plot)
    return curve


def plot_results(folder, *, private=False, **words):
    """Draw the results in a folder and write report.html beside them; of a world, draw its
    pictures.

    Parameters
    ----------
    folder : path-like
        Of `citypv simulate`, `citypv yield` or `citypv world`. A report or pictures of an earlier
        call are replaced.
    private : bool
        Leave out names and addresses of buildings.
    **words
        `title`, `attribution`, `language` and `districts` of `write_report`.

    Returns
    -------
    list of pathlib.Path
        Files written: the page, or the pictures.

    Raises
    ------
    InputError
        matplotlib is not installed, or the folder holds no results.
    """
    if importlib.util.find_spec("matplotlib") is None:
        raise InputError(
            "citypv plot",
            "needs matplotlib, which is not installed",
            "type: pip install matplotlib",
        )
    path = Path(folder) / "world.nc"
    if path.is_file():
        from ..world.draw_world import draw_world

        names = draw_world(path, path.parent)
        if not names:
            raise InputError(
                path,
                "holds single places, of which there are no pictures",
                "give a world on a grid",
            )
        return [path.parent / name for name in names]
    from ..results.read_results import read_results
    from ..results.write_report import write_report

    results = read_results(folder)
    if private:
        results.buildings[["address", "name"]] = ""
    return [write_report(folder, results, **words)]
