"""world.nc: full load hours of every place by the CF conventions."""

import numpy as np
import xarray

from ..read.open_netcdf import ENGINE
from ..results.netcdf_file import netcdf_file
from ..settings.version import __version__
from .place_hours import HOURS, MONTHS
from .sources import MEANINGS

FILL = {"zlib": True, "complevel": 1, "_FillValue": np.float32(np.nan)}
BY_MONTH, GAIN = slice(1, 1 + MONTHS), "gain_by_reflections"
BY_HOUR, BY_SOLAR_HOUR = (slice(BY_MONTH.stop + HOURS * day, BY_MONTH.stop + HOURS * (day + 1)) for day in (0, 1))
SOLAR = "hour of local mean solar time, from its start"
YEAR = "full load hours of a year"
PARTS = {  # name -> periods, further dimension, long name
    "full_load_hours": (0, None, YEAR),
    "full_load_hours_by_month": (BY_MONTH, "month", "full load hours of each month"),
    "full_load_hours_by_hour": (BY_HOUR, "hour", f"{YEAR}, by hour of the day (UTC)"),
    "full_load_hours_by_solar_hour": (BY_SOLAR_HOUR, "solar_hour", f"{YEAR}, by hour of local mean solar time"),
}
PLAIN = "full_load_hours_without_reflections"
WITHOUT = {
    PLAIN: (0, None, f"{YEAR} without any reflected light"),
    f"{PLAIN}_by_month": (BY_MONTH, "month", "full load hours of each month, without any reflected light"),
}


def dataset_of_world(world):
    """A World as a dataset: latitude × longitude (or station) × environment × group × period.

    Parameters
    ----------
    world : World

    Returns
    -------
    xarray.Dataset
    """
    places = world.places
    grid = places.rows is not None
    at = ("latitude", "longitude") if grid else ("station",)
    shape = (len(places.rows), len(places.columns)) if grid else (len(places),)
    variables = {}
    for values, table in ((world.full_load_hours, PARTS), (world.without_reflections, WITHOUT)):
        for name, (periods, dimension, words) in table.items():
            part, dimensions = values[..., periods], (*at, "environment", "group", *([dimension] if dimension else []))
            variables[name] = dimensions, part.reshape(*shape, *part.shape[1:]), {"units": "h", "long_name": words}
    add_errors(variables, world, shape)
    dimensions, annual, _ = variables["full_load_hours"]
    words = {"units": "1", "long_name": "mean of the year: full load hours over 8760 h"}
    variables["capacity_factor"] = dimensions, annual / np.float32(8760), words
    flags = {
        "long_name": "what the weather of the place is",
        "flag_values": np.array(list(MEANINGS), np.int8),
        "flag_meanings": " ".join(MEANINGS.values()),
    }
    variables["weather"] = (at, world.weather.reshape(shape), flags)
    owner = ("environment", "group")
    variables["area"] = (owner, world.group_area, {"units": "m2", "long_name": "area that counts"})
    variables["surface_count"] = (owner, world.group_count, {"units": "1", "long_name": "number of eligible surfaces"})
    return xarray.Dataset(variables, coordinates(world, grid), attributes(world))


def add_errors(variables, world, shape):
    """Add the gain by reflections, and the standard errors of hours, months and gain, each beside its own variable."""
    annual, plain = (variables[name][1].astype(float) for name in ("full_load_hours", PLAIN))
    gain = np.divide(annual, plain, out=np.full_like(annual, np.nan), where=plain > 0) - 1
    words = {"units": "1", "long_name": "full load hours of a year over those without reflected light, minus one"}
    variables[GAIN] = (variables["full_load_hours"][0], gain.astype(np.float32), words)
    errors = world.standard_error
    for name, found in (
        ("full_load_hours", errors[..., 0]),
        ("full_load_hours_by_month", errors[..., 1:]),
        (GAIN, world.gain_error),
    ):
        dimensions, _, words = variables[name]
        words["ancillary_variables"] = f"{name}_standard_error"
        about = {"units": words["units"], "long_name": f"standard error by tracing: {words['long_name']}"}
        variables[words["ancillary_variables"]] = (dimensions, found.reshape(*shape, *found.shape[1:]), about)


def coordinates(world, grid):
    """Coordinates of the dataset."""
    places = world.places
    where = {}
    for name, sign, axis, along in (
        ("latitude", "north", "Y", places.rows),
        ("longitude", "east", "X", places.columns),
    ):
        about = {"units": f"degrees_{sign}", "standard_name": name}
        where[name] = (name, along, about | {"axis": axis}) if grid else ("station", getattr(places, name), about)
    if not grid:
        where["station"] = "station", np.array(places.names, dtype=object), {"long_name": "name of the station"}
    names = np.array(["_".join(pair) for pair in world.groups], dtype=object)
    return where | {
        "environment": ("environment", np.array(world.environments, dtype=object), {"long_name": "traced city"}),
        "group": ("group", names, {"long_name": "kind and orientation of the surfaces"}),
        "month": ("month", np.arange(1, 13), {"units": "1", "long_name": "month of the year (UTC)"}),
        "hour": ("hour", np.arange(24), {"units": "1", "long_name": "hour of the day (UTC), from its start"}),
        "solar_hour": ("solar_hour", np.arange(24), {"units": "1", "long_name": SOLAR}),
    }


def attributes(world):
    """Global attributes of the dataset."""
    named = (f"{name}: {source}" for name, source in zip(world.environments, world.sources, strict=True))
    return {
        "Conventions": "CF-1.11",
        "title": "Full load hours of roofs and facades of the world",
        "source": f"CityPV {__version__}: ray-traced irradiance, module models of pvlib",
        "comment": f"weather: {world.label}; {world.years:g} year{'s' * (world.years != 1)}; DC without losses",
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
    dataset = dataset_of_world(world)
    encoding = {name: FILL for name, values in dataset.data_vars.items() if values.dtype == np.float32}
    # Coordinates and areas have no missing values.
    encoding |= {name: {"_FillValue": None} for name in ("latitude", "longitude", "area")}
    with netcdf_file(path) as stream:
        dataset.to_netcdf(stream, engine=ENGINE, encoding=encoding)
