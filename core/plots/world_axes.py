"""What the pictures of a world share: which environment and place they show, and a map with coast lines."""

from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib.collections import LineCollection

COAST = Path(__file__).with_name("coast_lines.npz")  # made by tools/make_coast_lines.py
COAST_STEP = 0.01  # [°]
LAND_LINE = {"colors": "#333333", "linewidths": 0.45}
SEA = "#f3f4f6"
UNSHADED = "unshaded"
CLEAR = 2  # of the variable `weather`
WIDE = 10.0  # [inch] of a picture of the world
PLACES = ("latitude", "longitude")
MERIDIAN = 10.0  # [°] of the paper's figures 8 and 9


def choose_environment(dataset, *, unshaded):
    """Name of the environment that a picture shows: the unshaded one, or the first traced one."""
    names = dataset["environment"].to_numpy().tolist()
    wanted = [name for name in names if (name == UNSHADED) == unshaded]
    return (wanted or names)[0]


def choose_group(dataset, group, environment):
    """The group asked for, or the first one that an environment has."""
    names = own_groups(dataset["full_load_hours"], environment)
    return group if group in names or not names else names[0]


def own_groups(values, environment):
    """Groups of which an environment has values anywhere: list of str."""
    known = np.isfinite(values.sel(environment=environment)).any([name for name in PLACES if name in values.dims])
    further = [name for name in known.dims if name != "group"]
    return values["group"].to_numpy()[known.any(further).to_numpy()].tolist()


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
    west, east = edges(longitude)[[0, -1]]
    further = [np.add(line, (360.0, 0.0)) for line in read_coast()] if east > 180.5 else []
    axes.add_collection(LineCollection(read_coast() + further, **LAND_LINE))
    axes.set_xlim(west, east)
    axes.set_ylim(*np.clip(edges(latitude)[[0, -1]], -90, 90))
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.xaxis.set_major_formatter(lambda value, _: write_longitude(value))
    axes.yaxis.set_major_formatter(lambda value, _: write_degrees(value, "N", "S"))
    aspect = shape_of_map(values)
    axes.locator_params(axis="x", nbins=int(np.clip(round(3 * aspect), 1, 7)))
    axes.locator_params(axis="y", nbins=int(np.clip(round(16 / aspect), 2, 7)))
    return mesh


def shape_of_map(values):
    """Width over height of the map of a grid."""
    west, east = edges(values["longitude"].to_numpy())[[0, -1]]
    south, north = np.clip(edges(values["latitude"].to_numpy())[[0, -1]], -90, 90)
    return (east - west) / (north - south)


def join_at_date_line(dataset):
    """A grid on both sides of the date line with its western part beyond 180°, so that the widest gap lies outside.

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


def edges(centres):
    """Edges of cells from their centres: (k + 1,); a single cell is 1° wide."""
    if len(centres) < 2:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    middle = (centres[1:] + centres[:-1]) / 2
    return np.concatenate([[2 * centres[0] - middle[0]], middle, [2 * centres[-1] - middle[-1]]])


def write_degrees(value, positive, negative):
    """10.0 -> 10°E."""
    return f"{abs(value):g}°{positive if value > 0 else negative if value < 0 else ''}"


def write_longitude(value):
    """190.0 -> 170°W."""
    east = (value + 180.0) % 360.0 - 180.0
    return "180°" if east == -180.0 else write_degrees(round(east, 6), "E", "W")


def describe_source(dataset, width=10.0):
    """A line on the weather, for below a picture of some width [inch]; two or more below a narrow one."""
    label = dataset.attrs["weather_label"]
    way = "" if dataset.attrs["way"] == "exact" else "; suns of Greenwich shifted in time"
    words = (label if len(label) <= 150 else label[:147] + "…") + way
    return words if width >= WIDE else fill(words, int(15 * width))
