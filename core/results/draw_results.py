"""Pictures of a run: months and hours of the day of the groups (paper, Fig. 8 and 9, for one
place), and histograms.

Beside them the curve of `citypv accuracy`, error against time.
"""

from functools import partial
from pathlib import Path

import numpy as np

from .draw_plan import draw_plan
from .draw_sun_path import draw_sun_path
from .output_folder import write_whole
from .picture import DOTS, LINES, OTHER, embed_figure, make_figure, make_logarithmic, plain_style
from .read_results import MONTHS, kind_title, select_mounted, tabulate_histograms, tabulate_periods

FAMILIES = {  # beginning of the name -> label, colour, mark
    "--samples": ("sky rays", "#0072B2", "s"),
    "--shadow-samples": ("shadow points", "#E69F00", "^"),
    "--suns days": ("days of suns", "#D55E00", "o"),
    "--max-bounces": ("reflections", "#009E73", "v"),
    "--patch-size": ("patch size", "#CC79A7", "D"),
}


def draw_report(results):
    """Pictures of report.html as data URIs, drawn alike on every machine, as far as there is
    something to draw.

    Parameters
    ----------
    results : Results

    Returns
    -------
    dict of str to str
        plan-roof, plan-facade, months, day, sun-path and histograms.
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
        if len(results.groups):
            pictures["months"] = embed_figure(draw_periods(results.groups, "month"))
            pictures["day"] = embed_figure(draw_periods(results.groups, "solar_hour"))
        suns = draw_sun_path(
            results.times, results.interval, site["latitude"], site["longitude"], results.suns
        )
        pictures["sun-path"] = embed_figure(suns)
        if len(mounted):
            pictures["histograms"] = embed_figure(draw_histograms(results.faces))
    return pictures


def draw_periods(groups, period, *, abreast=3):
    """Draw the full load hours of each group by month or by hour of the day, in a panel for each
    kind.

    Parameters
    ----------
    groups : pandas.DataFrame
        groups.csv.
    period : {"month", "solar_hour"}
        UTC, and local solar time.

    Returns
    -------
    matplotlib.figure.Figure
    """
    # A panel for each kind, as many abreast as fit; the others go.
    tables, monthly = tabulate_periods(groups, period), period == "month"
    # `abreast`: panels side by side.
    rows = -(-len(tables) // abreast)
    figure = make_figure(10, 3.9 * rows)
    panels = figure.subplots(rows, min(len(tables), abreast), sharey=True, squeeze=False).ravel()
    for axes in panels[len(tables) :]:
        axes.remove()
    for axes in panels[: len(tables) : abreast]:
        axes.set_ylabel(
            "Full load hours in the month [h]" if monthly else "Full load hours in a year [h]"
        )
    # A line for each direction, by month or by hour of the day.
    for axes, (kind, table) in zip(panels, tables.items(), strict=False):
        for side, hours in table.items():
            words = ("all" if side == "none" else side) + (
                f": {hours.sum():,.0f} h a year" if monthly else ""
            )
            middle = table.index if monthly else table.index + 0.5
            axes.plot(middle, hours, label=words, markersize=4, **LINES.get(side, OTHER))
        axes.set_title(kind_title(kind))
        axes.legend(
            loc="upper left", fontsize=8 if len(table.columns) > 4 else 8.5, handlelength=3.2
        )
        if monthly:
            axes.set_xticks(np.arange(1, 13), MONTHS, fontsize=9)
            axes.margins(x=0.02)
        else:
            axes.set(
                xlabel="Hour of the day, local solar time", xticks=np.arange(0, 25, 3), xlim=(0, 24)
            )
    # The legend stands above the highest line.
    top, lines = (
        max(map(size, tables.values())) for size in (np.max, lambda table: len(table.columns))
    )
    panels[0].set_ylim(0, max(top, 1e-3) / (0.95 - 0.05 * lines))
    return figure


def draw_histograms(faces):
    """Draw the area by full load hours, a panel for each kind; a line marks the mean.

    Parameters
    ----------
    faces : pandas.DataFrame
        faces.csv.

    Returns
    -------
    matplotlib.figure.Figure
    """
    # Area in steps of full load hours, a panel for each kind.
    mounted = select_mounted(faces)
    edges, areas = tabulate_histograms(mounted)
    figure = make_figure(10, 3.5)
    panels = figure.subplots(1, len(areas), squeeze=False)[0] if areas else []
    for axes, (kind, area) in zip(panels, areas.items(), strict=True):
        axes.bar(
            edges[:-1],
            area,
            width=np.diff(edges),
            align="edge",
            color="#5b7fa6",
            edgecolor="white",
            linewidth=0.6,
        )
        # The mean by area as a dashed line.
        own = mounted[mounted["kind"] == kind]
        mean = np.average(own["full_load_hours"], weights=own["area"])
        axes.axvline(mean, color="#222222", linestyle=(0, (4, 2)), linewidth=1.3)
        axes.set_title(
            f"{kind_title(kind)}\nmean {mean:,.0f} h, {own['area'].sum():,.0f} m²", fontsize=10
        )
        axes.set(xlim=(0, edges[-1]), xlabel="Full load hours a year [h]")
        axes.grid(visible=False, axis="x")
        axes.yaxis.set_major_formatter("{x:,.0f}")
    for axes in panels[:1]:
        axes.set_ylabel(f"Area [m²] in steps of {edges[1] - edges[0]:g} h")
    return figure


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
        for start, (label, colour, mark) in FAMILIES.items():
            points = sorted(
                (prediction.seconds, prediction.error)
                for prediction in curve.prices
                if prediction.name.startswith(start)
            )
            axes.plot(
                *zip(*points, strict=True), color=colour, marker=mark, label=label
            ) if points else None
        # Presets (draft, standard, …) are stars with their names.
        for prediction in curve.prices:
            if not prediction.name.startswith("--") and not prediction.name.endswith("rounds"):
                axes.plot(prediction.seconds, prediction.error, "k*", markersize=13, zorder=5)
                axes.annotate(
                    prediction.name.capitalize(),
                    (prediction.seconds, prediction.error),
                    (6, 6),
                    textcoords="offset points",
                )
        # Both axes are logarithmic; written whole or not at all.
        make_logarithmic(axes)
        words = "Error of full load hours on 95 % of the area with modules [%]"
        axes.set(xlabel="Seconds of the whole run (predicted)", ylabel=words)
        axes.legend()
        path = Path(path)
        write_whole(path, partial(figure.savefig, dpi=DOTS, format=path.suffix[1:]))
