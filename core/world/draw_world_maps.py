"""World maps of full load hours and of what reflected light adds to them (paper, Fig. 6 and 7),
with coast lines.

Beside them what all pictures of a world share: which environment and place they show, and how
places are written.
"""

from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib.collections import LineCollection

from ..results.colour_map import choose_range
from ..results.picture import LINES, colour_scale, make_figure

UNSHADED = "unshaded"
CLEAR = 2  # of the variable `weather`
WIDE = 10.0  # [inch] of a picture of the world
MERIDIAN = 10.0  # [°] of the paper's figures 8 and 9

COLOURS = [look["color"] for look in LINES.values()]


def choose_environment(dataset):
    """Name of the environment that a picture shows: the first traced one, else the unshaded one."""
    names = dataset["environment"].to_numpy().tolist()
    return next((name for name in names if name != UNSHADED), names[0])


def map_of(values, environment):
    """What a map of an environment shows, and its title: facades that face the equator, else the
    first group it has.

    Parameters
    ----------
    values : xarray.DataArray
        latitude × longitude × environment × group.
    environment : str

    Returns
    -------
    xarray.DataArray, latitude × longitude
    str
    """
    own, north = values.sel(environment=environment), values["latitude"] >= 0
    names = own.dropna("group", how="all")["group"].to_numpy().tolist()
    sides = [
        side
        # North of the equator facades face it in the south, south of it in the north.
        for side, there in zip(
            ("facade_south", "facade_north"), (north.any(), not north.all()), strict=True
        )
        if there
    ]
    if not set(sides) <= set(names):
        group = next(iter([*names, *sides]))
        return own.sel(group=group), f"{title_of_group(group)}, {environment}"
    title = title_of_group(sides[0]) if len(sides) == 1 else "Facades towards the equator"
    south, north_facing = (own.sel(group=side, drop=True) for side in (sides[0], sides[-1]))
    return south.where(north, north_facing), f"{title}, {environment}"


def title_of_group(group):
    """facade_south -> "South facades", rack -> "Racks"."""
    kind, _, orientation = group.partition("_")
    return f"{orientation} {'flat roof' if kind == 'flat' else kind}s".strip().capitalize()


def nearest_place(values, latitude, longitude):
    """Row and column of the place with values nearest to one: latitude counts twice.

    Parameters
    ----------
    values : xarray.DataArray
        latitude × longitude × …, NaN where there is no weather.
    latitude, longitude : float
        [°]

    Returns
    -------
    tuple of int, or None
        None if no place has values.
    """
    known = values.notnull().any(values.dims[2:])
    east = (values["longitude"] - longitude + 180.0) % 360.0 - 180.0
    distance = np.hypot(2 * (values["latitude"] - latitude), east).where(known)
    return tuple(map(int, distance.argmin(distance.dims).values())) if known.any() else None


def read_coast():
    """Coast lines: list of (k, 2) longitude and latitude [°]."""
    # The file is made by tools/make_coast_lines.py.
    with np.load(Path(__file__).with_name("coast_lines.npz")) as file:
        return np.split(file["points"] * 0.01, np.cumsum(file["length"])[:-1])


def _draw_map(axes, values, **style):
    """A map of a grid, plate carrée, with coast lines.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    values : xarray.DataArray, latitude × longitude
        NaN stays blank.
    **style
        Of `pcolormesh`.

    Returns
    -------
    matplotlib.collections.QuadMesh
    """
    places = values["longitude"], values["latitude"]
    axes.set_facecolor("#f3f4f6")
    mesh = axes.pcolormesh(*places, values.to_numpy(), shading="nearest", rasterized=True, **style)
    west, east = axes.get_xlim()
    axes.set(xlim=(west, east), ylim=np.clip(axes.get_ylim(), -90, 90), aspect="equal")
    coast = read_coast()
    further = [np.add(line, (360.0, 0.0)) for line in coast] if east > 180.5 else []
    axes.add_collection(LineCollection(coast + further, colors="#333333", linewidths=0.45))
    axes.grid(visible=False)
    axes.xaxis.set_major_formatter(lambda value, _: write_longitude(value))
    mark_latitudes(axes)
    aspect = _shape_of_map(values)
    axes.locator_params(axis="x", nbins=int(np.clip(round(3 * aspect), 1, 7)))
    axes.locator_params(axis="y", nbins=int(np.clip(round(16 / aspect), 2, 7)))
    return mesh


def _shape_of_map(values):
    """Width over height of the map of a grid, with half a cell around its points."""
    width, height = (
        np.ptp(values[name].values) / (1 - 1 / values.sizes[name])
        for name in ("longitude", "latitude")
    )
    return width / height


def hatch_clear(axes, x, y, clear):
    """Hatch where the weather is a clear sky, (y, x) bool, if it is not everywhere; whether there
    is any of it.
    """
    hatched = clear.any() and not clear.all()
    if hatched:
        axes.contourf(x, y, clear, levels=[0.5, 1.5], colors="none", hatches=["////"])
    return hatched


def join_at_date_line(dataset):
    """A grid on both sides of the date line with its western part beyond 180°, so that the widest
    gap lies outside.

    Parameters
    ----------
    dataset : xarray.Dataset
        Longitudes ascending, from -180 to below 180 [°].

    Returns
    -------
    xarray.Dataset
    """
    longitude = dataset["longitude"].to_numpy()
    gaps = np.diff(longitude)
    if len(longitude) < 2 or gaps.max() <= longitude[0] + 360.0 - longitude[-1] + 1e-6:
        return dataset
    west = longitude <= longitude[gaps.argmax()]
    return dataset.assign_coords(longitude=longitude + 360.0 * west).sortby("longitude")


def write_degrees(value, positive, negative):
    """10.0 -> 10°E."""
    return f"{abs(value):g}°{positive if value > 0 else negative if value < 0 else ''}"


def mark_latitudes(axes):
    """Write the upward axis of a picture as latitudes."""
    axes.yaxis.set_major_formatter(lambda value, _: write_degrees(value, "N", "S"))


def write_longitude(value):
    """190.0 -> 170°W."""
    east = (value + 180.0) % 360.0 - 180.0
    return "180°" if east == -180.0 else write_degrees(round(east, 6), "E", "W")


def describe_source(dataset, width):
    """A line on the weather, for below a picture of some width [inch]; two or more below a narrow
    one.
    """
    label = dataset.attrs["weather_label"]
    way = "" if dataset.attrs["way"] == "exact" else "; suns of Greenwich shifted in time"
    words = (label if len(label) <= 150 else label[:147] + "…") + way + "; DC without losses"
    return words if width >= WIDE else fill(words, int(15 * width))


def draw_world_map(dataset):
    """Draw full load hours of facades towards the equator, or of the first group of an environment
    without them: a map for each environment, with one scale.

    Parameters
    ----------
    dataset : xarray.Dataset
        world.nc.

    Returns
    -------
    matplotlib.figure.Figure
    """
    # A panel for each environment, in one or two columns.
    maps = [map_of(dataset["full_load_hours"], name) for name in dataset["environment"].to_numpy()]
    columns = 1 if len(maps) < 3 else 2
    rows = -(-len(maps) // columns)
    width = min(WIDE, max(3.8, 3.7 * _shape_of_map(dataset) + 1.8))  # [inch] of one map
    figure = make_figure(width * (1 + 0.7 * (columns - 1)), 4.3 * rows + 0.2)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    # One scale for all maps, from values weighed by area on the globe.
    shown = np.stack([values.to_numpy() for values, _ in maps])
    areas = np.cos(np.radians(dataset["latitude"].to_numpy()))[:, None] * np.ones(shown.shape)
    low, high = choose_range(shown.ravel(), areas.ravel())
    clear = (dataset["weather"] == CLEAR).to_numpy()
    for axes, (values, title) in zip(panels, maps, strict=False):
        mesh = _draw_map(axes, values, cmap=colour_scale("viridis"), vmin=low, vmax=high)
        axes.set_title(title)
        # Places where the weather is a clear sky are hatched, unless all are.
        if hatch_clear(axes, dataset["longitude"], dataset["latitude"], clear):
            axes.text(
                0.01,
                0.02,
                "hatched: clear sky, an upper bound",
                transform=axes.transAxes,
                fontsize=8,
            )
    for axes in panels[len(maps) :]:
        axes.set_axis_off()
    style = {"shrink": 0.75 / rows**0.5, "extend": "both", "pad": 0.015}
    figure.colorbar(mesh, ax=panels.tolist(), label="Full load hours in a year [h]", **style)
    figure.supxlabel(describe_source(dataset, width), fontsize=8)
    return figure


def find_gain(dataset):
    """Increase of annual full load hours by reflected light [%], xarray.DataArray."""
    plain = dataset["full_load_hours_without_reflections"]
    return 100 * (dataset["full_load_hours"] / plain.where(plain > 0) - 1)


def draw_world_gain(dataset):
    """Draw what reflected light adds to full load hours [%]: for each environment by latitude, of
    facades to the south and east, and as a map of the first traced one.

    Parameters
    ----------
    dataset : xarray.Dataset
        world.nc.

    Returns
    -------
    matplotlib.figure.Figure
    """
    # widths of the map and of the lines
    share = float(np.clip(1.2 * _shape_of_map(dataset), 0.7, 2.6))
    width = 12 * (1 + share) / 3.6  # [inch]
    figure = make_figure(width, 4.1)
    profile, axes = figure.subplots(1, 2, width_ratios=(1, share))
    # Increase of the mean hours along each parallel.
    gain = find_gain(
        dataset[["full_load_hours", "full_load_hours_without_reflections"]].mean("longitude")
    )
    groups = [
        group for group in ("facade_south", "facade_east") if group in gain["group"].to_numpy()
    ]
    # A line for each environment and group; then the map.
    for number, name in enumerate(gain["environment"].to_numpy()):
        for group, style in zip(
            groups, ("-", (0, (5, 2)), (0, (3, 1, 1, 1)), (0, (1, 1))), strict=False
        ):
            line, look = gain.sel(environment=name, group=group), COLOURS[number % len(COLOURS)]
            label = f"{name}, {title_of_group(group).split()[0].lower()}"
            profile.plot(line, gain["latitude"], linestyle=style, color=look, label=label)
    profile.set(xlabel="Gain, mean along the parallel [%]", xlim=(0, None), title="Facades")
    mark_latitudes(profile)
    profile.legend(fontsize=8, loc="best")
    # The map is of facades towards the equator, or of the first group of an environment without
    # them; its colours end where 2 % of the places lie above.
    values, title = map_of(find_gain(dataset), choose_environment(dataset))
    top = np.ceil(np.nanpercentile(values, 98) / 5) * 5
    mesh = _draw_map(axes, values, cmap=colour_scale("cividis"), vmin=0, vmax=max(top, 5))
    axes.set_title(title)
    label = "Full load hours gained by reflected light [%]"
    figure.colorbar(mesh, ax=axes, shrink=0.75, extend="max", pad=0.015, label=label)
    figure.supxlabel(describe_source(dataset, width), fontsize=8)
    return figure
