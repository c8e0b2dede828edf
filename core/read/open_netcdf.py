"""Open a NetCDF file, of HDF5 or of the classic format, without the NetCDF library."""

import importlib.util
from pathlib import Path

import h5py
import numpy as np

from ..settings.errors import InputError

ENGINE = "h5netcdf"  # NetCDF 4 is HDF5
CLASSIC = (b"CDF\x01", b"CDF\x02")
CDF5 = b"CDF\x05"


def open_netcdf(path, **options):
    """Open a NetCDF file.

    Parameters
    ----------
    path : path-like
    **options
        Of `xarray.open_dataset`.

    Returns
    -------
    xarray.Dataset
        Not yet read; the caller closes it.

    Raises
    ------
    InputError
        It is compressed by a method, or in a format, that is not read here.
    OSError, ValueError, TypeError
        Not NetCDF, or a damaged file.
    """
    import xarray  # takes long, and a run without such files needs none of it

    with Path(path).open("rb") as stream:
        start = stream.read(4)
    if start == CDF5:
        raise InputError(path, "is NetCDF in the format CDF-5, which is not read", f"type: nccopy -k nc4 {path} new.nc")
    if start in CLASSIC:
        return xarray.open_dataset(path, engine="scipy", **options)
    # Deflate (zlib), which nearly every file uses, is always there; hdf5plugin brings Zstandard, Blosc, bzip2, others.
    if importlib.util.find_spec("hdf5plugin") is not None:
        import hdf5plugin  # noqa: F401, its import makes its methods known
    with h5py.File(path) as file:
        plans = [item.id.get_create_plist() for item in file.values() if isinstance(item, h5py.Dataset)]
        filters = [plan.get_filter(number) for plan in plans for number in range(plan.get_nfilters())]
    names = {code: bytes(name).decode() or f"filter {code}" for code, _, _, name in filters}
    missing = {name for code, name in names.items() if not h5py.h5z.filter_avail(code)}
    if missing:
        problem = f"is compressed by {', '.join(sorted(missing))}, which is not read without hdf5plugin"
        raise InputError(path, problem, f"type: pip install hdf5plugin, or: nccopy -F none {path} new.nc")
    return xarray.open_dataset(path, engine=ENGINE, **options)


def rename_groups(dataset):
    """A dataset of version 0.2.0, which wrote flat_none and rack_none, with the names flat and rack."""
    group = dataset["group"]
    names = [str(name).removesuffix("_none") for name in group.to_numpy()]
    return dataset.assign_coords(group=("group", np.array(names, dtype=object), group.attrs))
