"""Months by latitude along one meridian (paper, Fig. 8)."""

import numpy as np

from .picture import colour_scale, make_figure
from .tabulate import MONTHS
from .world_axes import (
    CLEAR,
    MERIDIAN,
    choose_environment,
    describe_source,
    edges,
    own_groups,
    title_of_group,
    write_degrees,
    write_longitude,
)

KINDS = ("facade", "roof")
SIDES = ("east", "south")


def draw_world_months(dataset, environment=None):
    """Draw full load hours by month and latitude: facades and roofs, facing east and south.

    Parameters
    ----------
    dataset : xarray.Dataset
        world.nc.
    environment : str, optional
        By default the first that was traced.

    Returns
    -------
    matplotlib.figure.Figure or None
        None where there are fewer than two latitudes with weather on the northern hemisphere, or none of the groups.
    """
    environment = environment or choose_environment(dataset, unshaded=False)
    values = dataset["full_load_hours_by_month"].sel(environment=environment).assign_coords(weather=dataset["weather"])
    east = (values["longitude"].to_numpy() - MERIDIAN + 180.0) % 360.0 - 180.0
    values = values.isel(longitude=int(np.abs(east).argmin()))
    values = values.isel(latitude=values["latitude"].to_numpy() >= 0)
    if values.sizes["latitude"] < 2 or not np.isfinite(values).any():
        return None
    there = own_groups(dataset["full_load_hours_by_month"], environment)
    wanted = [[f"{kind}_{side}" for side in SIDES if f"{kind}_{side}" in there] for kind in KINDS]
    if not any(wanted):
        return None
    count = sum(map(len, wanted))
    width = 11 * max(count, 2) / 4  # [inch]
    figure = make_figure(width, 5.2)
    panels = figure.subplots(1, count, sharey=True, squeeze=False)[0]
    rest = iter(panels)
    for kind, names in zip(KINDS, wanted, strict=True):
        if not names:
            continue
        top = float(np.nanmax(values.sel(group=names)))
        own = [next(rest) for _ in names]
        for axes, name in zip(own, names, strict=True):
            mesh = draw_panel(axes, values.sel(group=name), top)
            axes.set_title(title_of_group(name))
        figure.colorbar(mesh, ax=own, shrink=0.8, pad=0.02).set_label(f"{kind.capitalize()}s: hours in the month [h]")
    panels[0].set_ylabel("Latitude")
    east = write_longitude(round(float(values["longitude"]), 2))
    clear = values["latitude"].to_numpy()[(values["weather"] == CLEAR).to_numpy()]
    hatched = 0 < len(clear) < values.sizes["latitude"]
    for axes in panels if hatched else ():
        hatch_rows(axes, values["latitude"].to_numpy(), clear)
    note = " Hatched: clear sky." if hatched else ""
    source = describe_source(dataset, width)
    figure.supxlabel(f"{environment}, along {east}.{note} {source}", fontsize=8)
    return figure


def hatch_rows(axes, latitude, chosen):
    """Hatch some rows of a panel."""
    bounds = edges(latitude)
    for low, high, place in zip(bounds[:-1], bounds[1:], latitude, strict=True):
        if place in chosen:
            axes.axhspan(low, high, facecolor="none", edgecolor="#ffffff90", hatch="///", linewidth=0)


def draw_panel(axes, values, top):
    """One group: months to the right, latitudes upwards; blank without weather."""
    latitude = values["latitude"].to_numpy()
    table = values.transpose("latitude", "month").to_numpy()
    mesh = axes.pcolormesh(
        np.arange(0.5, 13), edges(latitude), table, cmap=colour_scale("viridis"), vmin=0, vmax=top, rasterized=True
    )
    axes.set_xticks(np.arange(1, 13), [name[0] for name in MONTHS], fontsize=9)
    axes.yaxis.set_major_formatter(lambda value, _: write_degrees(value, "N", "S"))
    axes.grid(visible=False)
    return mesh
