"""Hours of the day in each environment at two latitudes (paper, Fig. 9)."""

import numpy as np

from .picture import LINES, make_figure
from .world_axes import (
    MERIDIAN,
    UNSHADED,
    describe_source,
    nearest_place,
    title_of_group,
    write_degrees,
    write_longitude,
)

LATITUDES = (20.0, 60.0)
GROUPS = {"roof_east": "-", "roof_west": "-", "facade_east": (0, (5, 2)), "facade_west": (0, (5, 2))}
FURTHEST = 4.0  # [°] of latitude between a picture and the place it shows


def draw_world_day(dataset):
    """Draw full load hours by hour of local solar time: a row for each latitude, a column for each environment.

    Parameters
    ----------
    dataset : xarray.Dataset
        world.nc.

    Returns
    -------
    matplotlib.figure.Figure or None
        None where there is no place with weather near the latitudes.
    """
    values = dataset["full_load_hours_by_solar_hour"]
    found = [nearest_place(values, latitude, MERIDIAN) for latitude in LATITUDES]
    rows = [
        (latitude, *place)
        for latitude, place in zip(LATITUDES, found, strict=True)
        if place and abs(float(values["latitude"][place[0]]) - latitude) <= FURTHEST
    ]
    names = [name for name in dataset["environment"].to_numpy() if name != UNSHADED] or [UNSHADED]
    if not rows:
        return None
    figure = make_figure(max(4.0 * len(names), 5.0), 3.2 * len(rows))
    panels = figure.subplots(len(rows), len(names), sharex=True, sharey="row", squeeze=False)
    for line, (_, row, column) in zip(panels, rows, strict=True):
        place = values.isel(latitude=row, longitude=column)
        north, east = (round(float(place[name]), 2) for name in ("latitude", "longitude"))
        where = f"{write_degrees(north, 'N', 'S')}, {write_longitude(east)}"
        for axes, name in zip(line, names, strict=True):
            draw_lines(axes, place.sel(environment=name))
            axes.set_title(f"{name}, {where}")
        own = [group for group in GROUPS if group in values["group"].to_numpy()]
        line[0].set_ylim(0, 1.05 * max(float(place.sel(group=own, environment=names).max()), 1e-3))
        line[0].set_ylabel("Full load hours in a year [h]")
    panels[0, 0].legend(fontsize=8, loc="upper left")
    for axes in panels[-1]:
        axes.set_xlabel("Hour of the day, local solar time")
    figure.supxlabel(describe_source(dataset), fontsize=8)
    return figure


def draw_lines(axes, values):
    """East and west, roofs solid and facades dashed."""
    for group, style in GROUPS.items():
        if group in values["group"].to_numpy() and np.isfinite(values.sel(group=group)).all():
            look = LINES[group.split("_")[1]]
            hours = values.sel(group=group)
            label = f"{title_of_group(group)}"
            axes.plot(hours["solar_hour"] + 0.5, hours, color=look["color"], linestyle=style, label=label)
    axes.set_xticks(np.arange(0, 25, 3))
    axes.set_xlim(0, 24)
