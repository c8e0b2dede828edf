"""ERA5 reanalysis, as the Climate Data Store delivers it in NetCDF."""

import tempfile
import zipfile
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from scipy.io import netcdf_file

from ..errors import InputError
from .grid_point import interpolate_point
from .record import Record

VARIABLES = ("ssrd", "fdir", "t2m", "u10", "v10")
UNITS = {"ssrd": "J m**-2", "fdir": "J m**-2", "t2m": "K", "u10": "m s**-1", "v10": "m s**-1", "sp": "Pa"}
SECONDS = 3600.0  # accumulated over one hour
CURE = "download ERA5 hourly data on single levels with ssrd, fdir, t2m, u10, v10 (and sp) as NetCDF"


def read_era5(path, latitude, longitude, altitude, point):
    """Read ERA5 weather of one place.

    Radiation is accumulated over the hour that ends at the stamp (UTC), so the interval starts one hour earlier.
    Temperature, wind and pressure are those of the stamp, half an hour after mid-interval; means with the stamp before
    would raise the full load hours of Berlin 2017 by 0.05 to 0.17 %.

    Parameters
    ----------
    path : path-like
        A NetCDF file, or a zip or a folder of such files: one for each year, or for groups of variables.
    latitude, longitude : float
        Place [°].
    altitude : float
        Of the place [m].
    point : {"nearest", "bilinear"}
        Nearest grid point, or bilinear interpolation between the four around the place.

    Returns
    -------
    Record
        ghi, dhi [Wm⁻²], temp_air [°C], wind_speed [ms⁻¹] and, where the file has it, pressure [Pa].
    """
    path = Path(path)
    if path.is_dir():
        table, place = read_files(path, sorted(path.glob("*.nc")), latitude, longitude, point)
    elif zipfile.is_zipfile(path):
        with tempfile.TemporaryDirectory() as folder:
            files = unzip_netcdf(path, Path(folder))
            table, place = read_files(path, files, latitude, longitude, point)
    else:
        table, place = read_files(path, [path], latitude, longitude, point)
    missing = [name for name in VARIABLES if name not in table]
    if missing:
        raise InputError(path, f"the variables {', '.join(missing)} are missing", CURE)
    # The values are those of the grid; the sun is that of the place asked for.
    label = f"ERA5 {path.name} ({point}: {place[0]:g}°, {place[1]:g}°)"
    return Record(convert_era5(table), latitude, longitude, altitude, str(path), label)


def unzip_netcdf(path, folder):
    """Unpack the NetCDF files of a zip into a folder, under names of our own: list of paths."""
    files = []
    with zipfile.ZipFile(path) as archive:
        members = [member for member in archive.namelist() if member.endswith(".nc")]
        for number, member in enumerate(members):
            files.append(folder / f"{number}.nc")
            files[-1].write_bytes(archive.read(member))
    return files


def read_files(path, files, latitude, longitude, point):
    """Join the tables of several NetCDF files.

    Parameters
    ----------
    path : pathlib.Path
        What the user gave, for messages.
    files : list of pathlib.Path
        NetCDF files.
    latitude, longitude, point
        As in `read_era5`.

    Returns
    -------
    table : pandas.DataFrame
        Of the file's variables, indexed by stamps in UTC.
    place : tuple of float
        Latitude and longitude [°] the values belong to.
    """
    if not files:
        raise InputError(path, "no .nc file inside", CURE)
    tables = []
    for file in files:
        table, place = read_file(path, file, latitude, longitude, point)
        tables.append(table)
    table = tables[0]
    for other in tables[1:]:
        table = table.combine_first(other)
    return table, place


def read_file(path, file, latitude, longitude, point):
    """Values of one NetCDF file at one place: the table and the place, as in `read_files`."""
    try:
        check_length(file)
        dataset = xr.open_dataset(file, engine="netcdf4", drop_variables=["number"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        words = " ".join(str(error).split())[:160]
        raise InputError(
            path, f"cannot be read as NetCDF ({words})", "download the file again; it may be cut"
        ) from error
    with dataset:
        dataset = rename_dimensions(path, dataset)
        names = [name for name in UNITS if name in dataset]
        for name in names:
            unit = dataset[name].attrs.get("units", UNITS[name])
            if unit != UNITS[name]:
                raise InputError(path, f"{name} is in {unit!r}, not {UNITS[name]!r}", CURE)
        dataset, place = interpolate_point(path, dataset[names], latitude, longitude, point)
        if "expver" in dataset.dims:
            dataset = merge_versions(dataset)
        times = pd.DatetimeIndex(dataset["time"].to_numpy(), tz="UTC")
        table = pd.DataFrame({name: dataset[name].to_numpy().astype(float) for name in names}, index=times)
    return table, place


def check_length(file):
    """Raise where a file in NetCDF's classic format is shorter than its header says.

    The NetCDF library reads zeros beyond the end of such a file. (Files in HDF5 know their own length.)
    """
    with file.open("rb") as stream:
        if stream.read(4) in (b"CDF\x01", b"CDF\x02"):
            stream.seek(0)
            # Laying every array over the mapped file fails where bytes are missing.
            classic = netcdf_file(stream, "r", mmap=True)
            classic.variables.clear()


def rename_dimensions(path, dataset):
    """Give time and place the names time, latitude and longitude, whichever of the known ones the file uses."""
    names = {"valid_time": "time", "lat": "latitude", "lon": "longitude"}
    dataset = dataset.rename(
        {old: new for old, new in names.items() if old in dataset.variables and new not in dataset}
    )
    for name in ("time", "latitude", "longitude"):
        if name not in dataset.variables:
            raise InputError(path, f"no coordinate {name}", CURE)
        if name not in dataset.dims:
            dataset = dataset.expand_dims(name)
    if not np.issubdtype(dataset["time"].dtype, np.datetime64):
        raise InputError(path, "its times are in no standard calendar", CURE)
    return dataset


def merge_versions(dataset):
    """Join final and preliminary data, which the file keeps side by side along expver with gaps in each."""
    merged = dataset.isel(expver=0, drop=True)
    for version in range(1, dataset.sizes["expver"]):
        merged = merged.fillna(dataset.isel(expver=version, drop=True))
    return merged


def convert_era5(table):
    """Irradiance, temperature and wind from ERA5's own variables.

    Parameters
    ----------
    table : pandas.DataFrame
        ssrd, fdir [Jm⁻²], t2m [K], u10, v10 [ms⁻¹], perhaps sp [Pa]; stamps end the hour.

    Returns
    -------
    pandas.DataFrame
        ghi, dhi [Wm⁻²], temp_air [°C], wind_speed [ms⁻¹], perhaps pressure [Pa]; stamps start the hour.
    """
    # The files hold packed integers: nights come out slightly off zero, and fdir slightly above ssrd.
    ghi = table["ssrd"] / SECONDS
    dhi = (table["ssrd"] - table["fdir"]) / SECONDS
    data = pd.DataFrame({"ghi": ghi, "dhi": dhi, "temp_air": table["t2m"] - 273.15})
    data["wind_speed"] = np.hypot(table["u10"], table["v10"])
    if "sp" in table:
        data["pressure"] = table["sp"]
    return data.set_axis(data.index - pd.Timedelta(hours=1), axis=0)
