"""timeseries.nc: capacity factors of the groups over the weather's time, by the CF conventions."""

import numpy as np
import pandas as pd
import xarray

from ..files.open_netcdf import ENGINE
from .netcdf_file import netcdf_file


def write_timeseries(path, energy, weather):
    """Write `capacity_factor(time, group)`.

    Parameters
    ----------
    path : path-like
    energy : Energy
    weather : Weather
    """
    start = energy.times.tz_convert("UTC").tz_localize(None)
    bounds = np.stack([start.to_numpy(), (start + energy.interval).to_numpy()], axis=1)
    names = np.array(["_".join(group) for group in energy.groups], dtype=str)
    hours = energy.interval / pd.Timedelta(hours=1)
    dataset = xarray.Dataset(
        {
            "capacity_factor": (
                ("time", "group"),
                energy.capacity_factor.astype(np.float32),
                {
                    "units": "1",
                    "long_name": "DC power per nominal power, mean over the area of the group that counts",
                    "cell_methods": "time: mean",
                },
            ),
            "area": (
                "group",
                energy.group_area,
                {"units": "m2", "long_name": "area that counts of eligible surfaces"},
            ),
            "surface_count": ("group", energy.group_count, {"units": "1", "long_name": "number of eligible surfaces"}),
            "time_bounds": (("time", "bounds"), bounds),
        },
        coords={
            "time": (
                "time",
                start,
                {"standard_name": "time", "long_name": "start of the interval (UTC)", "bounds": "time_bounds"},
            ),
            "group": ("group", names, {"long_name": "kind and orientation of the surfaces"}),
        },
        attrs={
            "Conventions": "CF-1.11",
            "title": "Capacity factors of roofs and facades",
            "source": "CityPV: ray-traced irradiance, module models of pvlib",
            "comment": f"weather: {weather.label}; full load hours are the sum times {hours:g} h",
        },
    )
    if energy.capacity_factor_ac is not None:
        dataset["capacity_factor_ac"] = (
            ("time", "group"),
            energy.capacity_factor_ac.astype(np.float32),
            {
                "units": "1",
                "long_name": "AC power per nominal DC power, after system losses and inverter",
                "cell_methods": "time: mean",
            },
        )
    time = {"units": "seconds since 1970-01-01 00:00:00", "calendar": "proleptic_gregorian", "dtype": "int64"}
    with netcdf_file(path) as stream:
        dataset.to_netcdf(
            stream,
            engine=ENGINE,
            encoding={
                "time": time,
                "time_bounds": time,
                "capacity_factor": {"zlib": True, "_FillValue": np.float32(np.nan)},
            },
        )
