"""world.nc: full load hours of every place by the CF conventions."""

import numpy as np
import xarray

from ..energy.counted_area import name_group
from ..read.netcdf_file import netcdf_file
from ..settings.version import __version__
from ..weather.grid_sources import MEANINGS
from .place_hours import HOURS, MONTHS

BY_MONTH = slice(1, 1 + MONTHS)
YEAR, MONTH, DARK = (
    "full load hours of a year",
    "full load hours of each month",
    "without any reflected light",
)
GAIN, ERROR = (
    "full load hours of a year over those without reflected light, minus one",
    "standard error by tracing",
)
SOLAR = "hour of local mean solar time"
PARTS = {  # name -> values, their periods, dimension of these, long name
    "full_load_hours": ("full_load_hours", 0, (), YEAR),
    "full_load_hours_standard_error": ("standard_error", 0, (), f"{ERROR}: {YEAR}"),
    "full_load_hours_by_month": ("full_load_hours", BY_MONTH, ("month",), MONTH),
    "full_load_hours_by_month_standard_error": (
        "standard_error",
        BY_MONTH,
        ("month",),
        f"{ERROR}: {MONTH}",
    ),
    "full_load_hours_by_hour": (
        "full_load_hours",
        slice(BY_MONTH.stop, BY_MONTH.stop + HOURS),
        ("hour",),
        f"{YEAR}, by hour of the day (UTC)",
    ),
    "full_load_hours_by_solar_hour": (
        "full_load_hours",
        slice(BY_MONTH.stop + HOURS, BY_MONTH.stop + 2 * HOURS),
        ("solar_hour",),
        f"{YEAR}, by {SOLAR}",
    ),
    "full_load_hours_without_reflections": ("without_reflections", 0, (), f"{YEAR} {DARK}"),
    "full_load_hours_without_reflections_by_month": (
        "without_reflections",
        BY_MONTH,
        ("month",),
        f"{MONTH}, {DARK}",
    ),
    "gain_by_reflections": ("gain", 0, (), GAIN),
    "gain_by_reflections_standard_error": ("gain_error", 0, (), f"{ERROR}: {GAIN}"),
    "capacity_factor": ("mean", 0, (), "mean of the year: full load hours over 8760 h"),
}


def _dataset_of_world(world):
    """A World as a dataset: latitude × longitude (or station) × environment × group × period.

    Parameters
    ----------
    world : World

    Returns
    -------
    xarray.Dataset
        Full load hours with and without reflections, their errors, the gain and the mean; what
        weather each place has; counts and areas of groups.
    """
    # Places on a grid of latitude and longitude, or stations.
    places = world.places
    grid = places.rows is not None
    at = ("latitude", "longitude") if grid else ("station",)
    shape = (len(places.rows), len(places.columns)) if grid else (len(places),)
    # Gain by reflections, and hours as a share of the year's 8,760.
    annual, plain = (
        one[..., 0].astype(float) for one in (world.full_load_hours, world.without_reflections)
    )
    gain = np.divide(annual, plain, out=np.full_like(annual, np.nan), where=plain > 0) - 1
    yearly = {"gain": gain, "gain_error": world.gain_error, "mean": annual / 8760}
    values = vars(world) | {name: one[..., None].astype(np.float32) for name, one in yearly.items()}
    # Variables with unit and words, in the order of these axes.
    variables = {}
    for name, (field, periods, dimension, words) in PARTS.items():
        part = values[field][..., periods]
        about = {"units": "h" if name.startswith("full_load_hours") else "1", "long_name": words}
        if f"{name}_standard_error" in PARTS:
            about["ancillary_variables"] = f"{name}_standard_error"
        axes = (*at, "environment", "group", *dimension)
        variables[name] = axes, part.reshape(*shape, *part.shape[1:]), about
    # What weather a place has is a flag with its meaning.
    flags = {
        "long_name": "what the weather of the place is",
        "flag_values": np.array(list(MEANINGS), np.int8),
        "flag_meanings": " ".join(MEANINGS.values()),
    }
    variables["weather"] = (at, world.weather.reshape(shape), flags)
    # Areas and counts are of groups, the same at all places.
    owner = ("environment", "group")
    variables["area"] = (owner, world.group_area, {"units": "m2", "long_name": "area that counts"})
    variables["surface_count"] = (
        owner,
        world.group_count,
        {"units": "1", "long_name": "number of eligible surfaces"},
    )
    return xarray.Dataset(variables, _coordinates(world, grid), _attributes(world))


def _coordinates(world, grid):
    """Coordinates of world.nc, with units and names of the CF conventions: dict.

    Places (a grid's axes or stations), environments, groups, months and hours.
    """
    # Degrees along the axes of a grid, or for each station.
    places = world.places
    where = {}
    for name, sign, axis, along in (
        ("latitude", "north", "Y", places.rows),
        ("longitude", "east", "X", places.columns),
    ):
        about = {"units": f"degrees_{sign}", "standard_name": name}
        where[name] = (
            (name, along, about | {"axis": axis})
            if grid
            else ("station", getattr(places, name), about)
        )
    if not grid:
        where["station"] = (
            "station",
            np.array(places.names, dtype=object),
            {"long_name": "name of the station"},
        )
    # Names of environments and groups; months and hours.
    names = np.array([name_group(*pair) for pair in world.groups], dtype=object)
    return where | {
        "environment": (
            "environment",
            np.array(world.environments, dtype=object),
            {"long_name": "traced city"},
        ),
        "group": ("group", names, {"long_name": "kind and orientation of the surfaces"}),
        "month": (
            "month",
            np.arange(1, 13),
            {"units": "1", "long_name": "month of the year (UTC)"},
        ),
        "hour": (
            "hour",
            np.arange(24),
            {"units": "1", "long_name": "hour of the day (UTC), from its start"},
        ),
        "solar_hour": (
            "solar_hour",
            np.arange(24),
            {"units": "1", "long_name": f"{SOLAR}, from its start"},
        ),
    }


def _attributes(world):
    """Global attributes of the dataset."""
    named = (
        f"{name}: {source}" for name, source in zip(world.environments, world.sources, strict=True)
    )
    return {
        "Conventions": "CF-1.11",
        "title": "Full load hours of roofs and facades of the world",
        "source": f"CityPV {__version__}: ray-traced irradiance, module models of pvlib",
        "comment": (
            f"weather: {world.label}; {world.years:g} year{'s' * (world.years != 1)}; DC without "
            "losses"
        ),
        "weather_label": world.label,
        "way": world.way,
        "sky": world.sky,
        "environments": "; ".join(named),
    }


def write_world(path, world):
    """Write world.nc.

    Parameters
    ----------
    path : path-like
    world : World
    """
    dataset = _dataset_of_world(world)
    encoding = {
        name: {"zlib": True, "complevel": 1, "_FillValue": np.float32(np.nan)}
        for name, values in dataset.data_vars.items()
        if values.dtype == np.float32
    }
    # Coordinates and areas have no missing values.
    encoding |= {name: {"_FillValue": None} for name in ("latitude", "longitude", "area")}
    with netcdf_file(path) as stream:
        dataset.to_netcdf(stream, engine="h5netcdf", encoding=encoding)
