"""How much area has how many full load hours, for each kind of surface."""

import numpy as np

from .picture import make_figure
from .tabulate import kind_title, select_mounted, tabulate_histograms

BAR, LINE = "#5b7fa6", "#222222"


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
    mounted = select_mounted(faces)
    edges, areas = tabulate_histograms(mounted)
    figure = make_figure(10, 3.5)
    panels = figure.subplots(1, len(areas), squeeze=False)[0] if areas else []
    for axes, (kind, area) in zip(panels, areas.items(), strict=True):
        axes.bar(edges[:-1], area, width=np.diff(edges), align="edge", color=BAR, edgecolor="white", linewidth=0.6)
        own = mounted[mounted["kind"] == kind]
        mean = np.average(own["full_load_hours"], weights=own["area"])
        axes.axvline(mean, color=LINE, linestyle=(0, (4, 2)), linewidth=1.3)
        axes.set_title(f"{kind_title(kind)}\nmean {mean:,.0f} h, {own['area'].sum():,.0f} m²", fontsize=10)
        axes.set_xlim(0, edges[-1])
        axes.set_xlabel("Full load hours a year [h]")
        axes.grid(visible=False, axis="x")
        axes.yaxis.set_major_formatter("{x:,.0f}")
    for axes in panels[:1]:
        axes.set_ylabel(f"Area [m²] in steps of {edges[1] - edges[0]:g} h")
    return figure
