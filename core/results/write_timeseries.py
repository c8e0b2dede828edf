"""timeseries.nc: capacity factors of the groups over the weather's time, by the CF conventions."""

import h5netcdf
import numpy as np
import pandas as pd

from .netcdf_file import netcdf_file, write_variables

EPOCH = {"units": "seconds since 1970-01-01", "calendar": "proleptic_gregorian"}
MEAN = {"units": "1", "cell_methods": "time: mean"}


def write_timeseries(path, energy, weather):
    """Write `capacity_factor(time, group)`.

    Parameters
    ----------
    path : path-like
    energy : Energy
    weather : Weather
    """
    hours = energy.interval / pd.Timedelta(hours=1)
    with netcdf_file(path) as stream, h5netcdf.File(stream, "w") as file:
        file.attrs.update(
            {
                "Conventions": "CF-1.11",
                "title": "Capacity factors of roofs and facades",
                "source": "CityPV: ray-traced irradiance, module models of pvlib",
                "comment": f"weather: {weather.label}; full load hours are the sum times {hours:g} h",
            }
        )
        write_variables(file, describe_series(energy))


def describe_series(energy):
    """Variables of timeseries.nc, as of `write_variables`."""
    start = seconds_since_1970(energy.times)
    bounds = np.stack([start, seconds_since_1970(energy.times + energy.interval)], axis=1)
    names = np.array(["_".join(group) for group in energy.groups], dtype=object)
    found = {
        "time": (
            "time",
            start,
            {"standard_name": "time", "long_name": "start of the interval (UTC)", "bounds": "time_bounds", **EPOCH},
        ),
        "group": ("group", names, {"long_name": "kind and orientation of the surfaces"}),
        "time_bounds": (("time", "bounds"), bounds),
        "capacity_factor": describe_factor(
            energy.capacity_factor, "DC power per nominal power, mean over the area of the group that counts"
        ),
        "area": ("group", energy.group_area, {"units": "m2", "long_name": "area that counts of eligible surfaces"}),
        "surface_count": ("group", energy.group_count, {"units": "1", "long_name": "number of eligible surfaces"}),
    }
    if energy.capacity_factor_ac is not None:
        words = "AC power per nominal DC power, after system losses and inverter"
        found["capacity_factor_ac"] = describe_factor(energy.capacity_factor_ac, words)
    return found


def describe_factor(values, words):
    """Capacity factors (time, group) as a variable, with the words that say what they are."""
    how = {"compression": "gzip", "fillvalue": np.float32(np.nan)}
    return ("time", "group"), values.astype(np.float32), {**MEAN, "long_name": words}, how


def seconds_since_1970(times):
    """Times (t,) tz-aware in seconds: (t,) int64."""
    return (times - pd.Timestamp(0, tz="UTC")) // pd.Timedelta(seconds=1)
