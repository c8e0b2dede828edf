"""Pictures of a run: plans of the city and the path of the sun; and the curve of `citypv accuracy`,
error against time.
"""

from functools import partial
from pathlib import Path

from .draw_plan import draw_plan
from .draw_sun_path import draw_sun_path
from .output_folder import write_whole
from .picture import DOTS, embed_figure, make_figure, make_logarithmic, plain_style
from .read_results import select_mounted


def draw_report(results):
    """Pictures of report.html as data URIs, drawn alike on every machine, as far as there is
    something to draw.

    Parameters
    ----------
    results : Results

    Returns
    -------
    dict of str to str
        plan-roof, plan-facade and sun-path.
    """
    site, mounted, pictures = results.summary["input"]["site"], select_mounted(results.faces), {}
    with plain_style():
        for show, chosen in (
            ("roof", mounted["kind"] != "facade"),
            ("facade", mounted["kind"] == "facade"),
        ):
            if results.outlines is not None and chosen.any():
                pictures[f"plan-{show}"] = embed_figure(
                    draw_plan(results.faces, results.outlines, show), "png"
                )
        suns = draw_sun_path(
            results.times, results.interval, site["latitude"], site["longitude"], results.suns
        )
        pictures["sun-path"] = embed_figure(suns)
    return pictures


def draw_cost_curve(curve, path):
    """Write the curve of a CostCurve, error on 95 % of the eligible area against seconds of the
    whole run.

    Parameters
    ----------
    curve : CostCurve
    path : path-like
    """
    with plain_style():
        figure = make_figure(8, 5)
        axes = figure.subplots()
        # A line for each family of settings, such as numbers of rays or ways of choosing suns.
        # Beginning of the name -> label, colour, mark.
        families = {
            "--samples": ("sky rays", "#0072B2", "s"),
            "--shadow-samples": ("shadow points", "#E69F00", "^"),
            "--suns days": ("days of suns", "#D55E00", "o"),
            "--max-bounces": ("reflections", "#009E73", "v"),
            "--patch-size": ("patch size", "#CC79A7", "D"),
        }
        for start, (label, colour, mark) in families.items():
            points = sorted(
                (prediction.seconds, prediction.error)
                for prediction in curve.prices
                if prediction.name.startswith(start)
            )
            axes.plot(
                *zip(*points, strict=True), color=colour, marker=mark, label=label
            ) if points else None
        # Presets (draft, standard, …) are stars with their names; rounds are not drawn.
        for prediction in curve.prices:
            if not prediction.name.startswith("--") and not prediction.name.endswith("rounds"):
                axes.plot(prediction.seconds, prediction.error, "k*", markersize=13, zorder=5)
                axes.annotate(
                    prediction.name.capitalize(),
                    (prediction.seconds, prediction.error),
                    (6, 6),
                    textcoords="offset points",
                )
        # Both axes are logarithmic. The file, in the format of its ending, is written whole or not.
        make_logarithmic(axes)
        words = "Error of full load hours on 95 % of the area with modules [%]"
        axes.set(xlabel="Seconds of the whole run (predicted)", ylabel=words)
        axes.legend()
        path = Path(path)
        write_whole(path, partial(figure.savefig, dpi=DOTS, format=path.suffix[1:]))
