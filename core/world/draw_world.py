"""The pictures of a world from world.nc: maps (paper, Fig. 6 and 7), months and hours of the day
(Fig. 8 and 9).
"""

from functools import partial

import numpy as np

from ..read.netcdf_file import open_netcdf, rename_groups
from ..results import picture
from ..results.output_folder import write_whole
from ..results.picture import DOTS, LINES
from ..results.read_results import MONTHS
from ..settings.errors import InputError
from .draw_world_maps import (
    CLEAR,
    MERIDIAN,
    UNSHADED,
    choose_environment,
    describe_source,
    draw_world_gain,
    draw_world_map,
    hatch_clear,
    join_at_date_line,
    mark_latitudes,
    nearest_place,
    title_of_group,
    write_degrees,
    write_longitude,
)

PARTS = ("by_month", "by_solar_hour", "without_reflections")
SHOWN = ("weather", "full_load_hours", *(f"full_load_hours_{part}" for part in PARTS))
KINDS = ("facade", "roof")
DAY_GROUPS = {
    "roof_east": "-",
    "roof_west": "-",
    "facade_east": (0, (5, 2)),
    "facade_west": (0, (5, 2)),
}


def _draw_world_months(dataset):
    """Draw full load hours by month and latitude in the first traced environment: facades and
    roofs, east and south.

    Parameters
    ----------
    dataset : xarray.Dataset
        world.nc.

    Returns
    -------
    matplotlib.figure.Figure or None
        None where the northern hemisphere has fewer than two latitudes or no value, or where there
        is none of the groups.
    """
    # The first traced environment, along the meridian nearest to the wanted one, in the north.
    environment = choose_environment(dataset)
    values = dataset["full_load_hours_by_month"].sel(environment=environment)
    there = values.dropna("group", how="all")["group"].to_numpy()
    east = (dataset["longitude"].to_numpy() - MERIDIAN + 180.0) % 360.0 - 180.0
    along = {
        "longitude": int(np.abs(east).argmin()),
        "latitude": dataset["latitude"].to_numpy() >= 0,
    }
    values, clear = values.isel(along), (dataset["weather"].isel(along) == CLEAR).to_numpy()
    # Panels for the groups that are there: facades, then roofs, each kind with one scale.
    wanted = [
        [f"{kind}_{side}" for side in ("east", "south") if f"{kind}_{side}" in there]
        for kind in KINDS
    ]
    if len(clear) < 2 or not any(wanted) or not np.isfinite(values).any():
        return None
    count = sum(map(len, wanted))
    width = 11 * max(count, 2) / 4  # [inch]
    figure = picture.make_figure(width, 5.2)
    panels = figure.subplots(1, count, sharey=True, squeeze=False)[0]
    rest, note = iter(panels), ""
    for kind, names in zip(KINDS, wanted, strict=True):
        if not names:
            continue
        own, top = [next(rest) for _ in names], values.sel(group=names).max()
        for axes, name in zip(own, names, strict=True):
            mesh = _draw_panel(axes, values.sel(group=name), float(top))
            # Latitudes where the weather is a clear sky are hatched, unless all are.
            if hatch_clear(axes, (0.5, 12.5), values["latitude"], np.stack([clear, clear], axis=1)):
                note = " Hatched: clear sky."
        label = f"{kind.capitalize()}s: hours in the month [h]"
        figure.colorbar(mesh, ax=own, shrink=0.8, pad=0.02, label=label)
    panels[0].set_ylabel("Latitude")
    meridian = write_longitude(round(float(values["longitude"]), 2))
    words = f"{environment}, along {meridian}.{note} {describe_source(dataset, width)}"
    figure.supxlabel(words, fontsize=8)
    return figure


def _draw_panel(axes, values, top):
    """One group: months to the right, latitudes upwards; blank without weather."""
    months, table = np.arange(1, 13), values.transpose("latitude", "month").to_numpy()
    mesh = axes.pcolormesh(
        months,
        values["latitude"],
        table,
        cmap=picture.colour_scale("viridis"),
        vmin=0,
        vmax=top,
        shading="nearest",
        rasterized=True,
    )
    axes.set_xticks(months, [name[0] for name in MONTHS], fontsize=9)
    axes.set_title(title_of_group(values["group"].item()))
    mark_latitudes(axes)
    axes.grid(visible=False)
    return mesh


def _draw_world_day(dataset):
    """Draw full load hours by hour of local solar time: a row for each of the places nearest to 20°
    and 60° north at one meridian, a column for each environment, a line for each group of surfaces.
    The unshaded environment is drawn only where there is no other.

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
    # Places near the wanted latitudes.
    near = [(latitude, nearest_place(values, latitude, MERIDIAN)) for latitude in (20.0, 60.0)]
    # A picture shows a place within 4° of latitude.
    places = [
        values[at] for wanted, at in near if at and abs(values["latitude"][at[0]] - wanted) <= 4.0
    ]
    names = [name for name in dataset["environment"].to_numpy() if name != UNSHADED] or [UNSHADED]
    if not places:
        return None
    # A row for each, a column for each environment, all of a row with one scale.
    width = max(4.0 * len(names), 5.0)  # [inch]
    figure = picture.make_figure(width, 3.2 * len(places))
    panels = figure.subplots(len(places), len(names), sharex=True, sharey="row", squeeze=False)
    for line, place in zip(panels, places, strict=True):
        north, east = (round(float(place[name]), 2) for name in ("latitude", "longitude"))
        where = f"{write_degrees(north, 'N', 'S')}, {write_longitude(east)}"
        for axes, name in zip(line, names, strict=True):
            _draw_lines(axes, place.sel(environment=name))
            axes.set_title(f"{name}, {where}")
        own = [group for group in DAY_GROUPS if group in values["group"].to_numpy()]
        line[0].set_ylim(0, 1.05 * max(float(place.sel(group=own, environment=names).max()), 1e-3))
        line[0].set_ylabel("Full load hours in a year [h]")
    panels[0, 0].legend(fontsize=8, loc="upper left")
    for axes in panels[-1]:
        axes.set_xlabel("Hour of the day, local solar time")
    figure.supxlabel(describe_source(dataset, width), fontsize=8)
    return figure


def _draw_lines(axes, values):
    """East and west, roofs solid and facades dashed."""
    for group, style in DAY_GROUPS.items():
        if group in values["group"].to_numpy() and np.isfinite(values.sel(group=group)).all():
            hours, colour = values.sel(group=group), LINES[group.split("_")[1]]["color"]
            axes.plot(
                hours["solar_hour"] + 0.5,
                hours,
                color=colour,
                linestyle=style,
                label=title_of_group(group),
            )
    axes.set(xticks=np.arange(0, 25, 3), xlim=(0, 24))


PICTURES = {
    "world_map.png": draw_world_map,
    "world_gain.png": draw_world_gain,
    "world_months.png": _draw_world_months,
    "world_day.png": _draw_world_day,
}


def draw_world(path, folder):
    """Draw the pictures that the places allow: maps need at least two rows and columns of a grid.

    Parameters
    ----------
    path : path-like
        world.nc.
    folder : pathlib.Path

    Returns
    -------
    list of str
        Names of the files written.

    Raises
    ------
    InputError
        The file cannot be read, or is none of `citypv world`.
    """
    cure = "compute it again: citypv world … --overwrite"
    with InputError.parsing(path, "cannot be read as NetCDF", cure), open_netcdf(path) as dataset:
        dataset.load()
    missing = [name for name in SHOWN if name not in dataset]
    if missing:
        raise InputError(path, f"has no {', '.join(missing)}", cure)
    dataset = rename_groups(dataset)
    if "latitude" not in dataset.dims:
        return []
    dataset, written = join_at_date_line(dataset), []
    area = min(dataset.sizes["latitude"], dataset.sizes["longitude"]) > 1
    with picture.plain_style():
        for name, draw in PICTURES.items():
            figure = (
                draw(dataset) if area or name not in ("world_map.png", "world_gain.png") else None
            )
            if figure is not None:
                write_whole(
                    folder / name,
                    partial(figure.savefig, dpi=DOTS, format="png", metadata={"Software": None}),
                )
                written.append(name)
    return written
