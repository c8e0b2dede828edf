"""Write and read the variables of our own NetCDF files, and of groups of them."""

import h5py
import numpy as np


def write_variables(group, variables):
    """Write variables to a NetCDF file or a group of it. Their dimensions are made, with the
    lengths they have there.

    Parameters
    ----------
    group : h5netcdf.File or h5netcdf.Group
    variables : dict of str to tuple
        Dimensions (str or tuple of str), values, and where there are any attributes and options of
        packing.
    """
    sizes = {name: dimension.size for name, dimension in group.dimensions.items()}
    for dimensions, values, *_ in variables.values():
        names = (dimensions,) if isinstance(dimensions, str) else dimensions
        sizes |= dict(zip(names, np.shape(values), strict=True))
    group.dimensions = sizes
    for name, (dimensions, values, *more) in variables.items():
        array = np.asarray(values)
        details, packing = more[0] if more else {}, more[1] if len(more) > 1 and array.size else {}
        kind = h5py.string_dtype() if array.dtype.kind in "OU" else array.dtype
        axes = (dimensions,) if isinstance(dimensions, str) else tuple(dimensions)
        variable = group.create_variable(name, axes, kind, **packing)
        variable[...] = array
        variable.attrs.update(details)


def read_variables(place):
    """Variables and attributes of an open HDF5 file or a group of it, as NetCDF has them, by name.

    Parameters
    ----------
    place : h5py.File or h5py.Group

    Returns
    -------
    variables : dict of str to numpy.ndarray
        Texts as objects; dimensions without values of their own are among them, as zeros.
    attributes : dict of str to value
    """
    variables = {}
    for name, stored in place.items():
        if isinstance(stored, h5py.Dataset):
            texts = h5py.check_string_dtype(stored.dtype) is not None
            variables[name] = np.asarray((stored.asstr() if texts else stored)[...])
    return variables, {name: _read_attribute(value) for name, value in place.attrs.items()}


def _read_attribute(value):
    """An attribute as it was given: a text, a number, or an array of several."""
    if isinstance(value, h5py.Empty):
        return ""
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.ravel()[0]
    return value.decode() if isinstance(value, bytes) else value
