"""ERA5 of a whole grid, read lazily: one or many NetCDF files, opened once, and a block of points at a time."""

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from ..settings.errors import InputError
from ..weather.read_era5 import CURE, NEEDED, check_variables, convert_era5, list_files, merge_versions, open_file

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
        files = []
        for path in paths:
            for file in list_files(Path(path), stack):
                found = open_file(path, file, stack)
                files += [] if found is None else [(path, *found)]
        if not files:
            raise InputError(source, "no weather variable inside", CURE)
        check_variables(source, {name for _, _, names, _ in files for name in names})
        latitude, longitude = (files[0][1][name].to_numpy().astype(float) for name in ("latitude", "longitude"))
        for path, dataset, *_ in files[1:]:
            for name, expected in (("latitude", latitude), ("longitude", longitude)):
                own = dataset[name].to_numpy().astype(float)
                if own.shape != expected.shape or np.abs(own - expected).max() > 10.0**-ROUNDING:
                    problem = f"its {name}s are not those of the other files"
                    raise InputError(path, problem, "download all on the same grid")
        times = pd.DatetimeIndex(np.unique(np.concatenate([one["time"].to_numpy() for _, one, *_ in files])), tz="UTC")
    except BaseException:
        stack.close()
        raise
    west = np.round((longitude + 180.0) % 360.0 - 180.0, ROUNDING)
    west, columns = np.unique(west, return_index=True)  # the same meridian may be there twice, as -180 and 180°
    rows = np.argsort(latitude, kind="stable")
    return Era5Grid(source, files, np.round(latitude[rows], ROUNDING), west, rows, columns, times, stack)


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
            # A later file fills what earlier ones lack, as when one point is read.
            known = found[ours][place]
            found[ours][place] = np.where(np.isnan(known), values + np.float32(offset), known)
    return found


def point_of_block(block, row, column, times):
    """Weather of one point of a block, as of `convert_era5`; None if it has no value at all of a needed variable.

    Returns
    -------
    pandas.DataFrame or None
    """
    values = {name: array[:, row, column].astype(float) for name, array in block.items()}
    if any(np.isnan(values[name]).all() for name in NEEDED):
        return None
    return convert_era5(pd.DataFrame(values, index=times))
