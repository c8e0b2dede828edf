"""What the pictures of a world share: which environment and place they show, and a map with coast lines."""

from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection

COAST = Path(__file__).with_name("coast_lines.npz")  # made by tools/make_coast_lines.py
COAST_STEP = 0.01  # [°]
LAND_LINE = {"colors": "#333333", "linewidths": 0.45}
SEA = "#f3f4f6"
UNSHADED = "unshaded"
CLEAR = 2  # of the variable `weather`
MERIDIAN = 10.0  # [°] of the paper's figures 8 and 9


def choose_environment(dataset, *, unshaded):
    """Name of the environment that a picture shows: the unshaded one, or the first traced one."""
    names = dataset["environment"].to_numpy().tolist()
    wanted = [name for name in names if (name == UNSHADED) == unshaded]
    return (wanted or names)[0]


def choose_group(dataset, group):
    """The group asked for, or the first one."""
    names = dataset["group"].to_numpy().tolist()
    return group if group in names else names[0]


def title_of_group(group):
    """facade_south -> "South facades"."""
    kind, _, orientation = group.partition("_")
    return f"{orientation.capitalize()} {kind}s"


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
    known = np.isfinite(values.to_numpy()).any(axis=tuple(range(2, values.ndim)))
    north = values["latitude"].to_numpy()[:, None] - latitude
    east = (values["longitude"].to_numpy()[None, :] - longitude + 180.0) % 360.0 - 180.0
    distance = np.where(known, np.hypot(2 * north, east), np.inf)
    if not np.isfinite(distance).any():
        return None
    row, column = np.unravel_index(distance.argmin(), distance.shape)
    return int(row), int(column)


def read_coast():
    """Coast lines: list of (k, 2) longitude and latitude [°]."""
    with np.load(COAST) as file:
        points, length = file["points"] * COAST_STEP, file["length"]
    return np.split(points, np.cumsum(length)[:-1])


def draw_map(axes, values, **style):
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
    longitude, latitude = values["longitude"].to_numpy(), values["latitude"].to_numpy()
    axes.set_facecolor(SEA)
    mesh = axes.pcolormesh(
        edges(longitude), np.clip(edges(latitude), -90, 90), values.to_numpy(), rasterized=True, **style
    )
    axes.add_collection(LineCollection(read_coast(), **LAND_LINE))
    axes.set_xlim(*edges(longitude)[[0, -1]])
    axes.set_ylim(*np.clip(edges(latitude)[[0, -1]], -90, 90))
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.xaxis.set_major_formatter(lambda value, _: write_degrees(value, "E", "W"))
    axes.yaxis.set_major_formatter(lambda value, _: write_degrees(value, "N", "S"))
    axes.locator_params(nbins=7)
    return mesh


def edges(centres):
    """Edges of cells from their centres: (k + 1,); a single cell is 1° wide."""
    if len(centres) < 2:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    middle = (centres[1:] + centres[:-1]) / 2
    return np.concatenate([[2 * centres[0] - middle[0]], middle, [2 * centres[-1] - middle[-1]]])


def write_degrees(value, positive, negative):
    """10.0 -> 10°E."""
    return f"{abs(value):g}°{positive if value > 0 else negative if value < 0 else ''}"


def describe_source(dataset):
    """A line on the weather, for below a picture."""
    label = dataset.attrs["weather_label"]
    way = "" if dataset.attrs["way"] == "exact" else "; suns of Greenwich shifted in time"
    return (label if len(label) <= 150 else label[:147] + "…") + way
