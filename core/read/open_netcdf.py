"""Open a NetCDF file, of HDF5 or of the classic format, without the NetCDF library."""

import importlib.util

import h5py
import numpy as np

from ..settings.errors import InputError
from .open_input import open_input

ENGINE = "h5netcdf"  # NetCDF 4 is HDF5


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
        It is compressed by a method, or in a format, that is not read here, or takes values from
        other files.
    Exception
        Not NetCDF, or a damaged file: what `parsing` makes an InputError of.
    """
    import xarray  # takes long, and a run without such files needs none of it

    with open_input(path) as stream:
        start = stream.read(4)
    if start == b"CDF\x05":
        raise InputError(
            path,
            "is NetCDF in the format CDF-5, which is not read",
            f"type: nccopy -k nc4 {path} new.nc",
        )
    if start in (b"CDF\x01", b"CDF\x02"):
        return xarray.open_dataset(path, engine="scipy", **options)
    check_hdf5(path)
    return xarray.open_dataset(path, engine=ENGINE, **options)


def check_hdf5(path):
    """Refuse an HDF5 file that is compressed by a method that is not read here, or takes values
    from other files.

    Raises
    ------
    InputError
    Exception
        As of `open_netcdf`.
    """
    # Deflate (zlib), which nearly every file uses, is always there; hdf5plugin brings Zstandard,
    # Blosc, bzip2, others.
    if importlib.util.find_spec("hdf5plugin") is not None:
        import hdf5plugin  # noqa: F401, its import makes its methods known
    refuse_links(path)
    with h5py.File(path) as file:
        plans = [
            item.id.get_create_plist() for item in file.values() if isinstance(item, h5py.Dataset)
        ]
        filters = [
            plan.get_filter(number) for plan in plans for number in range(plan.get_nfilters())
        ]
    names = {code: bytes(name).decode() or f"filter {code}" for code, _, _, name in filters}
    missing = {name for code, name in names.items() if not h5py.h5z.filter_avail(code)}
    if missing:
        problem = (
            f"is compressed by {', '.join(sorted(missing))}, which is not read without hdf5plugin"
        )
        raise InputError(
            path, problem, f"type: pip install hdf5plugin, or: nccopy -F none {path} new.nc"
        )


def rename_groups(dataset):
    """A dataset of version 0.2.0, which wrote flat_none and rack_none, with the names flat and
    rack.
    """
    group = dataset["group"]
    names = [str(name).removesuffix("_none") for name in group.to_numpy()]
    return dataset.assign_coords(group=("group", np.array(names, dtype=object), group.attrs))


def refuse_links(path):
    """Refuse an HDF5 file that takes values from other files, which whoever made it chooses: by
    links to them, virtual data sets, or data sets kept outside. Links within the file do no harm.

    Raises
    ------
    InputError
    Exception
        As of `open_netcdf`.
    """

    def refuse(name, what):
        cure = (
            f"type: h5repack {path} new.nc, or: nccopy {path} new.nc, where you trust it; or ask "
            "for whole files"
        )
        raise InputError(path, f"{name!r} is {what}, which is not followed", cure)

    with h5py.File(path) as file:
        waiting, seen = [file], set()
        while waiting:
            group = waiting.pop()
            place = h5py.h5o.get_info(group.id).addr
            if place in seen:
                continue
            seen.add(place)
            for name in group:
                link = group.get(name, getlink=True)
                if isinstance(link, h5py.ExternalLink):
                    refuse(name, f"a link to another file, {link.filename}")
                item = group.get(name)
                if isinstance(item, h5py.Group):
                    waiting.append(item)
                elif isinstance(item, h5py.Dataset) and item.is_virtual:
                    refuse(name, "a virtual data set, of values in other files")
                elif isinstance(item, h5py.Dataset) and item.external:
                    refuse(name, "kept in another file")
