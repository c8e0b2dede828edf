"""ERA5 of a whole grid, read lazily: one or many NetCDF files, opened once, and a block of points at a time."""

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from ..errors import InputError
from .read_era5 import (
    ACCUMULATED,
    CURE,
    NAMES,
    RATES,
    UNITS,
    WIND,
    check_length,
    convert_era5,
    list_files,
    merge_versions,
    rename_dimensions,
    spell_unit,
)

NEEDED = ("ssrd", "fdir", "t2m")
ROUNDING = 6  # decimals of coordinates [°]


@dataclass
class Era5Grid:
    """Open files of one grid."""

    source: str
    files: list  # of (path, xarray.Dataset, {our name: name in the file}, {our name: (factor, offset)})
    latitude: np.ndarray  # (a,) ascending [°]
    longitude: np.ndarray  # (b,) ascending, from -180 to below 180 [°]
    rows: np.ndarray  # (a,) int, row in the files of each latitude
    columns: np.ndarray  # (b,) int
    rates: set  # variables in Wm⁻²
    times: pd.DatetimeIndex  # (t,) stamps in UTC, of all files together
    stack: ExitStack  # closes the files


def open_era5_grid(paths):
    """Open the files of a grid without reading their values.

    Parameters
    ----------
    paths : list of path-like
        As of `read_era5`.

    Returns
    -------
    Era5Grid

    Raises
    ------
    InputError
        If a file cannot be read, the grids differ, or a variable is missing.
    """
    source, stack = ", ".join(map(str, paths)), ExitStack()
    try:
        files = [open_file(Path(path), file, stack) for path in paths for file in list_files(Path(path), stack)]
        files = [found for found in files if found is not None]
        if not files:
            raise InputError(source, "no weather variable inside", CURE)
        check_variables(source, {name for _, _, names, *_ in files for name in names})
        latitude, longitude = (files[0][1][name].to_numpy().astype(float) for name in ("latitude", "longitude"))
        for path, dataset, *_ in files[1:]:
            check_same_grid(path, dataset, latitude, longitude)
        rates = [set(one) & rates for _, _, one, _, rates in files]
        mixed = set().union(*rates) - {name for name in set().union(*rates) if all_rates(files, name)}
        if mixed:
            raise InputError(
                source, f"{', '.join(sorted(mixed))} in Wm⁻² in one file, in Jm⁻² in another", "use one unit"
            )
        times = pd.DatetimeIndex(np.unique(np.concatenate([one["time"].to_numpy() for _, one, *_ in files])), tz="UTC")
    except BaseException:
        stack.close()
        raise
    west = np.round((longitude + 180.0) % 360.0 - 180.0, ROUNDING)
    west, columns = np.unique(west, return_index=True)  # the same meridian may be there twice, as -180 and 180°
    rows = np.argsort(latitude, kind="stable")
    opened = [one[:4] for one in files]
    return Era5Grid(
        source, opened, np.round(latitude[rows], ROUNDING), west, rows, columns, set().union(*rates), times, stack
    )


def all_rates(files, name):
    """Whether a variable is a rate in each file that has it."""
    return all(name in rates for _, _, names, _, rates in files if name in names)


def open_file(path, file, stack):
    """Open one NetCDF file: path, dataset, names, scales and rates; None if it holds no weather."""
    try:
        check_length(file)
        dataset = stack.enter_context(xr.open_dataset(file, engine="netcdf4", drop_variables=["number"]))
    except (OSError, ValueError, KeyError, TypeError) as error:
        words = " ".join(str(error).split())[:160]
        raise InputError(
            path, f"cannot be read as NetCDF ({words})", "download the file again; it may be cut"
        ) from error
    names = {ours: name for ours, known in NAMES.items() for name in known if name in dataset.data_vars}
    if not names:
        return None
    dataset = rename_dimensions(path, dataset[list(names.values())])
    scales, rates = {}, set()
    for ours, name in names.items():
        default = next(iter(UNITS[ours])) if name not in RATES else "Wm-2"
        unit = spell_unit(dataset[name].attrs.get("units", default))
        if unit not in UNITS[ours]:
            known = " or ".join(UNITS[ours])
            raise InputError(path, f"{name} is in {dataset[name].attrs['units']!r}, not in {known}", CURE)
        scales[ours] = UNITS[ours][unit]
        rates |= {ours} & set(ACCUMULATED) if unit == "Wm-2" else set()
    return path, dataset, names, scales, rates


def check_variables(source, names):
    """Refuse files that lack a variable that is needed."""
    missing = [name for name in NEEDED if name not in names]
    if "ws10" not in names and not names >= WIND:
        missing += sorted(WIND - names)
    if missing:
        raise InputError(source, f"the variables {', '.join(missing)} are missing", CURE)


def check_same_grid(path, dataset, latitude, longitude):
    """Refuse a file whose points are not those of the first one."""
    for name, expected in (("latitude", latitude), ("longitude", longitude)):
        own = dataset[name].to_numpy().astype(float)
        if own.shape != expected.shape or np.abs(own - expected).max() > 10.0**-ROUNDING:
            raise InputError(path, f"its {name}s are not those of the other files", "download all on the same grid")


def read_block(grid, rows, columns):
    """Values of a block of points.

    Parameters
    ----------
    grid : Era5Grid
    rows, columns : slice or numpy.ndarray of int
        Of `grid.latitude` and `grid.longitude`.

    Returns
    -------
    dict of str to numpy.ndarray, (t, a, b) float32
        In our units, NaN where no file has a value.
    """
    north, east = grid.rows[rows], grid.columns[columns]
    axis = grid.times.tz_localize(None)
    found = {}
    for _, dataset, names, scales in grid.files:
        part = dataset.isel(latitude=north, longitude=east)
        if "expver" in part.dims:
            part = merge_versions(part)
        place = axis.get_indexer(pd.DatetimeIndex(part["time"].to_numpy()))
        for ours, name in names.items():
            factor, offset = scales[ours]
            values = part[name].transpose("time", "latitude", "longitude").to_numpy() * np.float32(factor)
            if ours not in found:
                found[ours] = np.full((len(axis), len(north), len(east)), np.nan, np.float32)
            found[ours][place] = values + np.float32(offset)
    return found


def point_of_block(block, row, column, times, rates):
    """Weather of one point of a block, as of `convert_era5`; None if the point has no values at all.

    Returns
    -------
    pandas.DataFrame or None
    """
    values = {name: array[:, row, column].astype(float) for name, array in block.items()}
    if all(np.isnan(values[name]).all() for name in NEEDED):
        return None
    return convert_era5(pd.DataFrame(values, index=times), rates)
