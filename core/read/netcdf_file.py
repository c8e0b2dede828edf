"""NetCDF files without the NetCDF library: open files of others, of HDF5 or of the classic format,
and create our own, which keep an error until HDF5 has closed them.
"""

import errno
import importlib.util
import io
from contextlib import contextmanager

import h5py
import numpy as np

from ..settings.errors import InputError
from .open_input import open_input


@contextmanager
def netcdf_file(path):
    """Create a file that HDF5 writes to.

    HDF5 cannot close a file that it could not write in full, and crashes the process at its end. So
    it is told that all is well, what it writes after the first error is dropped, and the error is
    raised in the end.

    Parameters
    ----------
    path : path-like

    Yields
    ------
    binary stream

    Raises
    ------
    OSError
        The system refused to write: the disk is full, for instance.
    """
    with _KeptError(path, "w+") as stream:
        yield stream
    if stream.error is not None:
        raise OSError(
            stream.error.errno or errno.EIO,
            f"cannot be written ({stream.error.strerror}): is the disk full?",
            str(path),
        ) from stream.error


class _KeptError(io.FileIO):
    """An open file that keeps the first error of writing, and from then on drops what is
    written.
    """

    error = None

    def readinto(self, buffer):
        """Read; zeros where the file could not be written."""
        count = super().readinto(buffer)
        if self.error is not None and count < len(buffer):
            buffer[count:] = bytes(len(buffer) - count)
            return len(buffer)
        return count

    def write(self, data):
        """Write all of some bytes."""
        view = memoryview(data).cast("B")
        while self.error is None and len(view):
            try:
                view = view[super().write(view) :]
            except OSError as error:
                self.error = error
        return len(data)

    def truncate(self, size=None):
        """Cut or extend the file."""
        if self.error is None:
            try:
                return super().truncate(size)
            except OSError as error:
                self.error = error
        return size


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
    # NetCDF 4 is HDF5.
    return xarray.open_dataset(path, engine="h5netcdf", **options)


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
        raise InputError(
            path,
            f"is compressed by {', '.join(sorted(missing))}, which is not read without hdf5plugin",
            f"type: pip install hdf5plugin, or: nccopy -F none {path} new.nc",
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
        raise InputError(
            path,
            f"{name!r} is {what}, which is not followed",
            f"type: h5repack {path} new.nc, or: nccopy {path} new.nc, where you trust it; or ask "
            "for whole files",
        )

    with h5py.File(path) as file:
        # All groups are visited once each, wherever links within the file lead.
        waiting, seen = [file], set()
        while waiting:
            group = waiting.pop()
            place = h5py.h5o.get_info(group.id).addr
            if place in seen:
                continue
            seen.add(place)
            for name in group:
                # Three ways to take values from elsewhere: a link, a virtual data set, external
                # storage.
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
