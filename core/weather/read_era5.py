"""ERA5 and ERA5-Land in NetCDF, as delivered by the Climate Data Store or saved by other
programs.
"""

import tempfile
import zipfile
from contextlib import ExitStack
from dataclasses import dataclass
from functools import reduce
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.io import netcdf_file

from ..read.netcdf_file import open_netcdf
from ..read.open_input import open_zip
from ..settings.errors import InputError
from .grid_point import AXES, name_axes, weigh_lines
from .weather import Record

# Possible names of each variable; mean rates of the same hour stand in Wm⁻².
NAMES = {
    "ssrd": ("ssrd", "msdwswrf", "avg_sdswrf", "surface_solar_radiation_downwards"),
    "fdir": ("fdir", "msdrswrf", "avg_sdirswrf", "total_sky_direct_solar_radiation_at_surface"),
    "t2m": ("t2m", "2t", "2m_temperature"),
    "u10": ("u10", "10u", "10m_u_component_of_wind"),
    "v10": ("v10", "10v", "10m_v_component_of_wind"),
    "ws10": ("ws10", "si10", "10si", "10m_wind_speed"),
    "sp": ("sp", "surface_pressure"),
}
# J m**-2, J m-2, J/m^2 and J m⁻² become Jm-2.
SPELLINGS = {"⁻": "-", "²": "2", "¹": "1", "**": "", "^": "", " ": "", ".": "", "·": ""}
SPELLINGS |= {"/m2": "m-2", "/s": "s-1", "°C": "degC"}
# Unit in that spelling -> factor and offset to ours; to Jm⁻² per interval where it is not Wm⁻².
UNITS = {
    "ssrd": {"Jm-2": (1.0, 0.0), "kJm-2": (1e3, 0.0), "Wm-2": (1.0, 0.0), "Whm-2": (3600.0, 0.0)},
    "t2m": {"K": (1.0, -273.15), "degC": (1.0, 0.0), "C": (1.0, 0.0), "celsius": (1.0, 0.0)},
    "u10": {"ms-1": (1.0, 0.0)},
    "sp": {"Pa": (1.0, 0.0), "hPa": (100.0, 0.0)},
}
UNITS |= {"fdir": UNITS["ssrd"], "v10": UNITS["u10"], "ws10": UNITS["u10"]}
ACCUMULATED = ("ssrd", "fdir")
NEEDED = ("ssrd", "fdir", "t2m")
HOUR = pd.Timedelta(hours=1)
COLUMNS = {
    "ghi": "ssrd",
    "dhi": "ssrd - fdir",
    "temp_air": "t2m",
    "wind_speed": "wind",
    "pressure": "sp",
}
AGAIN = "download the file again; it may be cut"
GIVE_ERA5 = (
    "download ERA5 hourly data on single levels with ssrd, fdir, t2m, u10, v10 (and sp) as NetCDF"
)


@dataclass
class _Era5Grid:
    """Open files of one grid."""

    source: str
    files: list  # of (xarray.Dataset by our names, {our name: (factor, offset) to our unit})
    latitude: np.ndarray  # (a,) ascending [°]
    longitude: np.ndarray  # (b,) ascending, from -180 to below 180 [°]
    rows: np.ndarray  # (a,) int, row in the files of each latitude
    columns: np.ndarray  # (b,) int


def read_era5(paths, latitude, longitude, altitude, point):
    """Read ERA5 weather of one place.

    Radiation is accumulated (Jm⁻²), or averaged (Wm⁻²), over the interval that ends at the stamp
    (UTC). Temperature, wind and pressure hold for the stamp, half an hour after mid-interval; means
    with the stamp before would raise the full load hours of Berlin 2017 by 0.05 to 0.17 %.

    Parameters
    ----------
    paths : path-like or list of path-like
        As of `open_era5_grid`.
    latitude, longitude : float
        Place [°].
    altitude : float
        Of the place [m].
    point : {"nearest", "bilinear"}
        Nearest grid point, or bilinear interpolation between the four around the place.

    Returns
    -------
    Record
        ghi [Wm⁻²], temp_air [°C], wind_speed [ms⁻¹] and, if available, dhi [Wm⁻²] and pressure
        [Pa].
    """
    # Another word than nearest or bilinear is refused.
    if point not in ("nearest", "bilinear"):
        raise InputError("--weather-point", f"{point!r} is unknown", "give nearest or bilinear")
    # Grid points around the place and their weights, along rows and columns.
    paths = [Path(path) for path in (paths if isinstance(paths, list | tuple) else [paths])]
    with ExitStack() as stack:
        grid = open_era5_grid(paths, stack, ("ssrd", "t2m"))
        north = grid.latitude - latitude
        # Eastward distance by the shorter way round, so that 359.75° is near 0°.
        east = (grid.longitude - longitude + 180.0) % 360.0 - 180.0
        rows, columns = weigh_lines(north, point), weigh_lines(east, point)
        # A place outside the grid is refused.
        if rows is None or columns is None:
            problem = f"the place {latitude:.4f}° N, {longitude:.4f}° E is outside the grid"
            problem += f" ({grid.latitude[0]:g} to {grid.latitude[-1]:g}° N,"
            problem += f" {grid.longitude[0]:g} to {grid.longitude[-1]:g}° E)"
            raise InputError(grid.source, problem, "give weather of the city's own place")
        block = read_block(grid, np.flatnonzero(rows), np.flatnonzero(columns))
    # Mean of the one or four points by the product of their weights.
    corners = product(enumerate(rows[rows > 0]), enumerate(columns[columns > 0]))
    table = sum(
        a * b * block.isel(latitude=row, longitude=column) for (row, a), (column, b) in corners
    ).to_dataframe()
    # The grid gives the values, the requested place the sun. Sums since 0 UTC, as of ERA5-Land,
    # become values of each hour, which a note tells.
    place = f"{round(latitude + rows @ north, 5):g}°, {round(longitude + columns @ east, 5):g}°"
    table, notes = _undo_sums(table)
    label = (
        f"ERA5{'-Land' if notes else ''} {', '.join(path.name for path in paths)} ({point}: "
        f"{place})"
    )
    return Record(
        convert_era5(table), latitude, longitude, altitude, grid.source, label, notes, COLUMNS
    )


def open_era5_grid(paths, stack, needed=NEEDED, *, rounding=6):
    """Open the files of a grid without reading their values.

    Parameters
    ----------
    paths : list of path-like
        NetCDF files, or zips or folders of such files: one for each year, month, variable or group
        of variables. Files without any of these variables are ignored.
    stack : contextlib.ExitStack
        Closes them.
    needed : tuple of str
        Variables that must be there, beside the wind.

    Returns
    -------
    Era5Grid
        Latitudes and longitudes ascend, longitudes from -180° on.

    Raises
    ------
    InputError
        If a file cannot be read, the grids differ, or a variable is missing.
    """
    # All files have the same grid, whatever variables they hold.
    source, files, axes = ", ".join(map(str, paths)), [], None
    for path in map(Path, paths):
        for file in _list_files(path, stack):
            if (found := _open_file(path, file, stack)) is None:
                continue
            files.append(found)
            own = [found[0][name].to_numpy().astype(float) for name in AXES[1:]]
            axes = axes or own
            for name, values, expected in zip(AXES[1:], own, axes, strict=True):
                # Coordinates may differ by 0.01°.
                if values.shape != expected.shape or np.abs(values - expected).max() > 0.01:
                    raise InputError(
                        path,
                        f"its {name}s are not those of the other files",
                        "download all on the same grid",
                    )
    # All variables that are needed, in any of the files; wind as speed or by its components.
    if not files:
        raise InputError(source, "no weather variable inside", GIVE_ERA5)
    names = {name for _, scales in files for name in scales}
    missing = [name for name in needed if name not in names]
    if "ws10" not in names:
        missing += sorted({"u10", "v10"} - names)
    if missing:
        raise InputError(source, f"the variables {', '.join(missing)} are missing", GIVE_ERA5)
    # From south to north and from west to east, each meridian once.
    # `rounding`: decimals of coordinates [°].
    latitude, longitude = axes[0], np.round((axes[1] + 180.0) % 360.0 - 180.0, rounding)
    # the same meridian may be there twice, as -180 and 180°
    west, columns = np.unique(longitude, return_index=True)
    rows = np.argsort(latitude, kind="stable")
    return _Era5Grid(source, files, np.round(latitude[rows], rounding), west, rows, columns)


def read_block(grid, rows, columns):
    """Values of a block of points, in our units.

    Parameters
    ----------
    grid : Era5Grid
    rows, columns : numpy.ndarray of int
        Of `grid.latitude` and `grid.longitude`.

    Returns
    -------
    xarray.Dataset, time × latitude × longitude, float64
        By stamps, in order; NaN where no file has a value.
    """
    with InputError.parsing(grid.source, "cannot be read as NetCDF", AGAIN):
        return _read_block(grid, rows, columns)


def _read_block(grid, rows, columns):
    parts = []
    for dataset, scales in grid.files:
        part = dataset.isel(latitude=grid.rows[rows], longitude=grid.columns[columns]).drop_vars(
            AXES[1:]
        )
        # Final and preliminary data are stored along expver, with gaps in each.
        versions = (
            [part.isel(expver=k) for k in range(part.sizes["expver"])]
            if "expver" in part.dims
            else [part]
        )
        for version in versions:
            values = {
                name: version[name].astype(float) * factor + offset
                for name, (factor, offset) in scales.items()
            }
            parts.append(version.assign(values).reset_coords(drop=True))
    # A later file fills what earlier ones lack.
    return reduce(lambda one, other: one.combine_first(other), parts).sortby("time")


def _list_files(path, stack):
    """NetCDF files of a file, a folder or a zip, which is unpacked until the stack closes: list of
    paths.
    """
    files = sorted(path.glob("*.nc")) if path.is_dir() else [path]
    if not path.is_dir() and zipfile.is_zipfile(path):
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        with (
            InputError.parsing(path, "cannot be unpacked", AGAIN),
            open_zip(path) as archive,
        ):
            members = [member for member in archive.namelist() if member.endswith(".nc")]
            files = [folder / f"{number}.nc" for number in range(len(members))]  # under new names
            for file, member in zip(files, members, strict=True):
                file.write_bytes(archive.read(member))
    if not files:
        raise InputError(path, "no .nc file inside", GIVE_ERA5)
    return files


def _open_file(path, file, stack):
    """Open one NetCDF file without reading its values.

    Parameters
    ----------
    path, file : path-like
        What the user gave, for messages, and the NetCDF file.
    stack : contextlib.ExitStack
        Closes it.

    Returns
    -------
    dataset : xarray.Dataset
        The weather variables by our names, with coordinates time, latitude and longitude.
    scales : dict of str to tuple of float
        Factor and offset to our unit of each.

    None instead where it has no weather variable.
    """
    try:
        with InputError.parsing(path, "cannot be read as NetCDF", AGAIN):
            # A truncated file in the classic format is found out before xarray, which would leave
            # it open.
            with file.open("rb") as stream:
                if stream.read(4) in (b"CDF\x01", b"CDF\x02"):
                    stream.seek(0)
                    # mapping the arrays fails if bytes are missing
                    classic = netcdf_file(stream, "r", mmap=True)
                    classic.variables.clear()
            dataset = stack.enter_context(open_netcdf(file, drop_variables=["number"]))
    except InputError as error:
        raise InputError(path, error.problem, error.cure) from error
    names = {
        ours: name for ours, known in NAMES.items() for name in known if name in dataset.data_vars
    }
    if not names:
        return None
    dataset = name_axes(path, dataset[list(names.values())], GIVE_ERA5)
    steps, scales = np.diff(dataset["time"].to_numpy()), {}
    # The interval is the commonest step, but an hour at most: a file may hold one stamp, or one
    # hour of each day, and ERA5 has every hour.
    interval = min(pd.Series(steps).mode().iloc[0], HOUR) if len(steps) else HOUR
    for ours, name in names.items():
        default = (
            next(iter(UNITS[ours]))
            if name not in ("msdwswrf", "avg_sdswrf", "msdrswrf", "avg_sdirswrf")
            else "Wm-2"
        )
        # A variable without a unit has ERA5's own; one in an unknown unit is refused.
        unit = dataset[name].attrs.get("units", default)
        for other, own in SPELLINGS.items():
            unit = unit.replace(other, own)
        if unit not in UNITS[ours]:
            known = " or ".join(UNITS[ours])
            raise InputError(
                path, f"{name} is in {dataset[name].attrs['units']!r}, not in {known}", GIVE_ERA5
            )
        factor, offset = UNITS[ours][unit]
        # Sums become means over the interval.
        summed = ours in ACCUMULATED and unit != "Wm-2"
        scales[ours] = factor / interval.total_seconds() if summed else factor, offset
    return dataset.rename({name: ours for ours, name in names.items()}), scales


def _undo_sums(table):
    """Hourly radiation from sums since 0 UTC, as ERA5-Land has them, and what was done:
    pandas.DataFrame, list of str.

    Only such sums never fall from 1 to 24 UTC of any day. The first stamp of a file that begins at
    0 UTC is the sum of a day before it: there the same hour of the next day is taken.

    Parameters
    ----------
    table : pandas.DataFrame
        As in `convert_era5`, by its stamps.
    """
    names = [name for name in ACCUMULATED if name in table]
    steps, after = table[names].diff(), table.index.hour != 1
    hourly = len(table) > 48 and (table.index[1:] - table.index[:-1] == HOUR).all()
    if not hourly or not (table["ssrd"] > 0).any():
        return table, []
    # Packed integers may fall by their last digit.
    if (steps["ssrd"][after] < -1e-3 * table["ssrd"].max()).any():
        return table, []
    steps = steps.where(after[:, None], table[names])
    if table.index[0].hour == 0:
        steps.iloc[0] = steps.iloc[24]
    return table.assign(**steps.clip(lower=0.0)), ["radiation of each hour from sums since 0 UTC"]


def convert_era5(table):
    """Irradiance, temperature and wind from ERA5's own variables.

    Parameters
    ----------
    table : pandas.DataFrame
        ssrd, perhaps fdir [Wm⁻²], t2m [°C], u10 and v10 or ws10 [ms⁻¹], perhaps sp [Pa]; stamps end
        the interval, UTC.

    Returns
    -------
    pandas.DataFrame
        ghi, perhaps dhi [Wm⁻²], temp_air [°C], wind_speed [ms⁻¹], perhaps pressure [Pa]; stamps
        start the interval.
    """
    steps = table.index[1:] - table.index[:-1]
    interval = steps.to_series().mode().iloc[0] if len(steps) else HOUR
    # Values are packed integers: at night slightly off zero, and fdir slightly above ssrd.
    wind = table["ws10"] if "ws10" in table else np.hypot(table["u10"], table["v10"])
    data = pd.DataFrame({"ghi": table["ssrd"]})
    if "fdir" in table:
        data["dhi"] = table["ssrd"] - table["fdir"]
    data = data.assign(temp_air=table["t2m"], wind_speed=wind)
    if "sp" in table:
        data["pressure"] = table["sp"]
    return data.set_axis(data.index.tz_localize("UTC") - interval, axis=0)
