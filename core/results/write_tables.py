"""The tables of a run: faces.csv, groups.csv, buildings.csv, series.csv and timeseries.nc (by the
CF conventions).
"""

from functools import partial

import h5netcdf
import numpy as np
import pandas as pd

from ..energy import building_power
from ..energy.counted_area import name_group
from ..energy.pv_system import build_system
from ..read.netcdf_file import netcdf_file
from ..settings.system_settings import BUILDINGS
from ..sun.solar_position import local_middle
from .columns import TABLED, name_months, write_table
from .districts import write_districts
from .netcdf_variables import write_variables
from .surfaces_file import write_surfaces
from .write_buildings import write_buildings, write_uses

HOUR = pd.Timedelta(hours=1)
GROUP_COLUMNS = ("kind", "orientation", "period", "index", "full_load_hours", "count", "area")
GROUP_COLUMNS += ("full_load_hours_standard_error", "full_load_hours_dc")
PACKED = {"compression": "gzip", "fillvalue": np.float32(np.nan)}


def write_faces(path, transfer, energy, *, monthly=False):
    """Write the results of each surface, numbers with six significant digits.

    Parameters
    ----------
    path : path-like
    transfer : Transfer
    energy : Energy
    monthly : bool
        Whether to add columns with the full load hours of each month.
    """
    columns = {column.name: column.values_of(transfer, energy) for column in TABLED}
    columns |= {
        column.name: np.where(columns[column.name], "true", "false")
        for column in TABLED
        if column.kind == "flag"
    }
    columns |= name_months(energy.full_load_hours_by_month) if monthly else {}
    write_table(path, pd.DataFrame(columns))


def write_groups(path, energy):
    """Write full load hours of the groups of eligible surfaces, means over their counted area, and
    their errors.

    Parameters
    ----------
    path : path-like
    energy : Energy
    """
    hours, rows = sum_periods(energy), []
    for group, names in enumerate(energy.groups):
        counted = energy.group_count[group], energy.group_area[group]
        annual = energy.group_standard_error[group], energy.group_dc[group]
        for (period, index), values in hours.items():
            only = annual if period == "annual" else (np.nan, np.nan)
            rows.append((*names, period, index, f"{values[group]:.6g}", *counted, *only))
    write_table(path, pd.DataFrame(rows, columns=GROUP_COLUMNS))


def sum_periods(energy):
    """Full load hours of each group in each period, per year; years are separate if the weather
    covers several.

    Parameters
    ----------
    energy : Energy

    Returns
    -------
    dict of (str, int or str) to numpy.ndarray, (g,)
        By period and index [h].
    """
    names = [("annual", ""), *(("month", month) for month in range(1, 13))]
    names += [(period, hour) for period in ("hour", "solar_hour") for hour in range(24)]
    share = share_periods(energy.times, energy.interval, energy.longitude)
    hours_of_periods = dict(
        zip(
            names,
            share @ energy.capacity_factor * (energy.interval / HOUR / energy.years),
            strict=True,
        )
    )
    return hours_of_periods | {("year", year): hours for year, hours in energy.sum_years().items()}


def share_periods(times, interval, longitude):
    """Share of intervals in the whole, its months, hours of the day and hours of local mean solar
    time.

    An interval belongs to the month and hour of its middle, in the zone of the times. It is split
    between hours of local mean solar time, which start at any time within hours of UTC.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (T,)
        Start of the intervals.
    interval : pandas.Timedelta
    longitude : float [°]

    Returns
    -------
    numpy.ndarray, (61, T) float64
        The whole, 12 months, 24 hours, 24 hours of solar time.
    """
    middle, length = times + interval / 2, interval / HOUR
    start = local_middle(times, interval, longitude) - interval / 2
    begin = ((start - start.floor("D")) / HOUR).to_numpy()
    share, every = np.zeros((61, len(times))), np.arange(len(times))
    share[0] = 1.0
    share[middle.month.to_numpy(), every] = 1.0
    share[13 + middle.hour.to_numpy(), every] = 1.0
    for number in range(int(np.ceil(length)) + 1):
        hour = np.floor(begin) + number
        overlap = np.minimum(hour + 1, begin + length) - np.maximum(hour, begin)
        share[37 + hour.astype(int) % 24, every] += np.maximum(overlap, 0.0) / length
    return share


def _write_series(path, transfer, energy):
    """Write the time series of the requested surfaces, surface by surface.

    Parameters
    ----------
    path : path-like
    transfer : Transfer
    energy : Energy
        With `series`.
    """
    series = energy.series
    count = len(series.rows)
    names = np.array(transfer.surfaces.surface_id, dtype=object)[series.rows]
    times = [str(time.isoformat()).replace("+00:00", "Z") for time in energy.times.floor("s")]
    columns = {"surface_id": np.repeat(names, len(times)), "time": np.tile(times, count)}
    for name in ("poa_direct", "poa_diffuse", "capacity_factor"):
        columns[name] = getattr(series, name).T.ravel()
    write_table(path, pd.DataFrame(columns))


def write_timeseries(path, energy, weather, buildings=None):
    """Write `capacity_factor(time, group)`; the last group is the whole, `all`: its factors times
    kWp are its power.

    Parameters
    ----------
    path : path-like
    energy : Energy
    weather : Weather
    buildings : callable, optional
        `compute_building_power` of a run whose buildings get series, too.
    """
    # Start and end of each interval in seconds of the epoch, as CF asks for.
    ends = energy.times.append(energy.times + energy.interval) - pd.Timestamp(0, tz="UTC")
    bounds = (ends // pd.Timedelta(seconds=1)).to_numpy().reshape(2, -1).T
    names = np.array([*(name_group(*group) for group in energy.groups), "all"], dtype=object)
    # The whole is the mean of the groups, by the share of their modules.
    kwp = np.array(
        [
            energy.kwp[energy.eligible & (energy.kind == kind) & (energy.orientation == side)].sum()
            for kind, side in energy.groups
        ]
    )
    share = kwp / max(kwp.sum(), np.finfo(float).tiny)
    # Axes first, then sizes of groups, their factors, and the power of buildings where asked for.
    variables = {
        "time": (
            "time",
            bounds[:, 0],
            {
                "standard_name": "time",
                "long_name": "start of the interval (UTC)",
                "bounds": "time_bounds",
                "units": "seconds since 1970-01-01",
                "calendar": "proleptic_gregorian",
            },
        ),
        "group": (
            "group",
            names,
            {"long_name": "kind and orientation of the surfaces; all of them"},
        ),
        "time_bounds": (("time", "bounds"), bounds),
    }
    told = {
        "area": (energy.group_area, "m2", "area of eligible surfaces that counts"),
        "surface_count": (energy.group_count, "1", "number of eligible surfaces"),
    }
    for name, (values, unit, words) in told.items():
        variables[name] = (
            "group",
            np.append(values, values.sum()),
            {"units": unit, "long_name": words},
        )
    factors = np.column_stack([energy.capacity_factor, energy.capacity_factor @ share]).astype(
        np.float32
    )
    variables["capacity_factor"] = (
        ("time", "group"),
        factors,
        {
            "units": "1",
            "cell_methods": "time: mean",
            "long_name": (
                "AC power over nominal DC power, after losses and inverter: mean "
                "over the area of the group that counts"
            ),
        },
        dict(PACKED),
    )
    if buildings is not None:
        names, power = buildings()
        words = {
            "units": "kW",
            "cell_methods": "time: mean",
            "long_name": "AC power of the building's modules",
        }
        variables["building"] = (
            "building",
            names.astype(object),
            {"long_name": "identifier of the top-level building"},
        )
        variables["building_power"] = ("time", "building"), power, words, dict(PACKED)
    # One netCDF file with titles that tell what it holds.
    hours = energy.interval / pd.Timedelta(hours=1)
    with netcdf_file(path) as stream, h5netcdf.File(stream, "w") as file:
        file.attrs.update(
            {
                "Conventions": "CF-1.11",
                "title": "Capacity factors of roofs and facades",
                "source": "CityPV: ray-traced irradiance, module models of pvlib",
                "comment": (
                    f"weather: {weather.label}; full load hours are the sum times {hours:g} h"
                ),
            }
        )
        write_variables(file, variables)


def write_tables(folder, transfer, energy, weather, request, *, progress):
    """Write faces.csv, groups.csv, buildings.csv, timeseries.nc, surfaces.nc; uses.csv where the
    files tell what buildings are for; if requested, districts.csv and series.csv.

    Parameters
    ----------
    folder : pathlib.Path
    transfer : Transfer
    energy : Energy
    weather : Weather
    request : Request
    progress : callable
        See `core.settings.progress`; counts files.
    """
    # Each file has the function that writes it; they are called in this order at the end.
    system, monthly, wanted = build_system(request), request.monthly, BUILDINGS in request.series
    run = transfer, weather, energy, system
    power = partial(building_power.compute_building_power, *run)
    tables = {
        "faces.csv": lambda path: write_faces(path, transfer, energy, monthly=monthly),
        "groups.csv": lambda path: write_groups(path, energy),
        "buildings.csv": lambda path: write_buildings(
            path, transfer, energy, weather, monthly=monthly
        ),
        "timeseries.nc": lambda path: write_timeseries(
            path, energy, weather, power if wanted else None
        ),
        "surfaces.nc": lambda path: write_surfaces(
            path,
            transfer,
            energy,
            building_power.compute_building_hours(*run),
        ),
    }
    # Sums by what buildings are for, where that is known; districts and series if asked for.
    if transfer.facts is not None and any(transfer.facts.function):
        tables["uses.csv"] = lambda path: write_uses(path, transfer, energy, weather)
    if request.districts:
        tables["districts.csv"] = lambda path: write_districts(
            path, transfer, energy, weather, request.districts
        )
    if energy.series is not None:
        tables["series.csv"] = lambda path: _write_series(path, transfer, energy)
    for number, (name, write) in enumerate(tables.items()):
        progress("writing tables", number, len(tables), "files")
        write(folder / name)
    progress("writing tables", len(tables), len(tables), "files")
