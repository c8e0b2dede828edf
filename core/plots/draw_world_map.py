"""World map of full load hours (paper, Fig. 6)."""

import numpy as np

from ..results.colour_map import choose_range
from .picture import colour_scale, make_figure
from .world_axes import (
    CLEAR,
    WIDE,
    choose_environment,
    choose_group,
    describe_source,
    draw_map,
    shape_of_map,
    title_of_group,
)

GROUP = "facade_south"


def draw_world_map(dataset, group=GROUP, environment=None):
    """Draw full load hours of one group in one environment.

    Parameters
    ----------
    dataset : xarray.Dataset
        world.nc.
    group : str
    environment : str, optional
        By default the unshaded one, as in the paper, else the first.

    Returns
    -------
    matplotlib.figure.Figure or None
        None for a single row or column.
    """
    if min(dataset.sizes["latitude"], dataset.sizes["longitude"]) < 2:
        return None
    environment = environment or choose_environment(dataset, unshaded=True)
    group = choose_group(dataset, group, environment)
    values = dataset["full_load_hours"].sel(environment=environment, group=group)
    width = min(WIDE, max(3.8, 3.7 * shape_of_map(values) + 1.8))  # [inch]
    figure = make_figure(width, 4.5)
    axes = figure.subplots()
    low, high = choose_range(values.to_numpy().ravel(), area_weights(values).ravel())
    mesh = draw_map(axes, values, cmap=colour_scale("viridis"), vmin=low, vmax=high)
    hatch_clear_sky(axes, dataset)
    axes.set_title(f"{title_of_group(group)}, {environment}")
    bar = figure.colorbar(mesh, ax=axes, shrink=0.75, extend="both", pad=0.015)
    bar.set_label("Full load hours in a year [h]")
    figure.supxlabel(describe_source(dataset, width), fontsize=8)
    return figure


def area_weights(values):
    """Area of the cells of a grid, in proportion: (a, b)."""
    return np.cos(np.radians(values["latitude"].to_numpy()))[:, None] * np.ones(values.shape)


def hatch_clear_sky(axes, dataset):
    """Hatch what is a clear sky on a map of other weather."""
    clear = (dataset["weather"] == CLEAR).to_numpy()
    if not clear.any() or clear.all():
        return
    axes.contourf(dataset["longitude"], dataset["latitude"], clear, levels=[0.5, 1.5], colors="none", hatches=["////"])
    axes.text(0.01, 0.02, "hatched: clear sky, an upper bound", transform=axes.transAxes, fontsize=8)
