"""Full load hours of the months (paper, Fig. 8, for one place)."""

import numpy as np

from .picture import LINES, OTHER, make_figure
from .tabulate import MONTHS, kind_title, tabulate_periods


def draw_months(groups):
    """Draw the full load hours of each group by month, a panel for each kind.

    Parameters
    ----------
    groups : pandas.DataFrame
        groups.csv.

    Returns
    -------
    matplotlib.figure.Figure
    """
    tables = tabulate_periods(groups, "month")
    figure = make_figure(10, 3.9)
    panels = figure.subplots(1, len(tables), sharey=True, squeeze=False)[0]
    for axes, (kind, table) in zip(panels, tables.items(), strict=True):
        for orientation, hours in table.items():
            look = LINES.get(orientation, OTHER)
            axes.plot(table.index, hours, label=f"{orientation}: {hours.sum():,.0f} h a year", markersize=4.5, **look)
        axes.set_title(kind_title(kind))
        axes.set_xticks(np.arange(1, 13), MONTHS, fontsize=9)
        axes.legend(loc="upper left", fontsize=8.5, handlelength=3.2)
        axes.margins(x=0.02)
    top = max((table.to_numpy().max() for table in tables.values()), default=1.0)
    panels[0].set_ylim(0, 1.45 * max(top, 1e-3))  # room for the legend
    panels[0].set_ylabel("Full load hours in the month [h]")
    return figure
