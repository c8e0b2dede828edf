"""Full load hours by the hour of the day (paper, Fig. 9)."""

import numpy as np

from .picture import LINES, OTHER, make_figure
from .tabulate import kind_title, tabulate_periods

SOLAR, UNIVERSAL = "Hour of the day, local solar time", "Hour of the day, UTC"


def choose_hours(groups):
    """Hours of the day by local solar time; in files without them by UTC.

    Returns
    -------
    tables : dict of str to pandas.DataFrame
        As of `tabulate_periods`.
    title : str
        Of the axis.
    """
    tables = tabulate_periods(groups, "solar_hour")
    return (tables, SOLAR) if tables else (tabulate_periods(groups, "hour"), UNIVERSAL)


def draw_day(groups):
    """Draw the full load hours of each group by hour of the day, a panel for each kind.

    Parameters
    ----------
    groups : pandas.DataFrame
        groups.csv.

    Returns
    -------
    matplotlib.figure.Figure
    """
    tables, title = choose_hours(groups)
    figure = make_figure(10, 3.9)
    panels = figure.subplots(1, len(tables), sharey=True, squeeze=False)[0]
    for axes, (kind, table) in zip(panels, tables.items(), strict=True):
        for orientation, hours in table.items():
            look = LINES.get(orientation, OTHER)
            axes.plot(table.index + 0.5, hours, label=orientation, markersize=4, **look)
        axes.set_title(kind_title(kind))
        axes.set_xlabel(title)
        axes.set_xticks(np.arange(0, 25, 3))
        axes.set_xlim(0, 24)
        axes.legend(loc="upper left", fontsize=8.5, handlelength=3.2)
    panels[0].set_ylim(bottom=0)
    panels[0].set_ylabel("Full load hours in a year [h]")
    return figure
