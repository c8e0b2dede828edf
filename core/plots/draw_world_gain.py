"""What reflected light adds to full load hours, as a map and by latitude (paper, Fig. 7)."""

import numpy as np

from .picture import LINES, colour_scale, make_figure
from .world_axes import (
    choose_environment,
    choose_group,
    describe_source,
    draw_map,
    shape_of_map,
    title_of_group,
    write_degrees,
)

GROUPS = ("facade_south", "facade_east")
STYLES = ("-", (0, (5, 2)), (0, (3, 1, 1, 1)), (0, (1, 1)))
COLOURS = [look["color"] for look in LINES.values()]


def find_gain(dataset):
    """Increase of annual full load hours by reflected light [%], xarray.DataArray."""
    plain = dataset["full_load_hours_without_reflections"]
    return 100 * (dataset["full_load_hours"] / plain.where(plain > 0) - 1)


def mean_gain(dataset):
    """Increase of the mean hours along each parallel [%]: latitude × environment × group."""
    mean = dataset[["full_load_hours", "full_load_hours_without_reflections"]].mean("longitude")
    return find_gain(mean)


def draw_world_gain(dataset):
    """Draw the gain of each environment by latitude, and the map of the unshaded one.

    Parameters
    ----------
    dataset : xarray.Dataset
        world.nc.

    Returns
    -------
    matplotlib.figure.Figure or None
        None for a single row or column.
    """
    if min(dataset.sizes["latitude"], dataset.sizes["longitude"]) < 2:
        return None
    share = float(np.clip(1.2 * shape_of_map(dataset), 0.7, 2.6))  # widths of the map and of the lines
    width = 12 * (1 + share) / 3.6  # [inch]
    figure = make_figure(width, 4.1)
    profile, axes = figure.subplots(1, 2, width_ratios=(1, share))
    draw_profiles(profile, mean_gain(dataset))
    environment = choose_environment(dataset, unshaded=True)
    group = choose_group(dataset, GROUPS[0], environment)
    values = find_gain(dataset).sel(environment=environment, group=group)
    top = np.ceil(np.nanpercentile(values, 98) / 5) * 5
    mesh = draw_map(axes, values, cmap=colour_scale("cividis"), vmin=0, vmax=max(top, 5))
    axes.set_title(f"{title_of_group(group)}, {environment}")
    bar = figure.colorbar(mesh, ax=axes, shrink=0.75, extend="max", pad=0.015)
    bar.set_label("Full load hours gained by reflected light [%]")
    figure.supxlabel(describe_source(dataset, width), fontsize=8)
    return figure


def draw_profiles(axes, gain):
    """Lines of the mean gain by latitude: a colour for each environment, dashes for east facades."""
    groups = [group for group in GROUPS if group in gain["group"].to_numpy()]
    for number, environment in enumerate(gain["environment"].to_numpy()):
        for group, style in zip(groups, STYLES, strict=False):
            line = gain.sel(environment=environment, group=group)
            label = f"{environment}, {title_of_group(group).split()[0].lower()}"
            axes.plot(line, gain["latitude"], linestyle=style, color=COLOURS[number % len(COLOURS)], label=label)
    axes.set_xlabel("Gain, mean along the parallel [%]")
    axes.yaxis.set_major_formatter(lambda value, _: write_degrees(value, "N", "S"))
    axes.set_xlim(left=0)
    axes.set_title("Facades")
    axes.legend(fontsize=8, loc="best")
