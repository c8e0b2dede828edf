"""Write transfer.nc: the traced Transfer without weather, for reuse with other weather years."""

import json

import netCDF4
import numpy as np
import xarray

from ..progress import silent
from ..transfer.kept_matrix import row_blocks
from .output_folder import netcdf_errors
from .transfer_fields import (
    ALBEDO,
    BARE,
    ERROR_PARTS,
    FORMAT,
    HORIZON,
    MATERIAL,
    OUTLINES,
    PER_SUN,
    PER_SURFACE,
    PER_SURFACE_AND_SUN,
    TERRAIN,
    TERRAIN_DETAILS,
    TEXTS,
    TRACED_AS,
)
from .write_summary import finite

STAGE = "writing transfer.nc"


def write_transfer(path, transfer, progress=silent):
    """Write a Transfer.

    Parameters
    ----------
    path : path-like
    transfer : Transfer
    progress : callable, optional
        See `core.progress`; in bytes of the matrices, before they are packed.
    """
    states = {None: transfer} if transfer.bare is None else {None: transfer, BARE: transfer.bare}
    total, done = 0, 0
    for state in states.values():
        total += sum(4 * getattr(state, name).size for name in PER_SURFACE_AND_SUN)
    with netcdf_errors(path):
        for group, state in states.items():
            describe_state(state).to_netcdf(path, engine="netcdf4", group=group, mode="a" if group else "w")
        progress(STAGE, 0, total, "B")
        with netCDF4.Dataset(path, "a") as file:
            for group, state in states.items():
                for name in PER_SURFACE_AND_SUN:
                    for size in append_matrix(file[group] if group else file, name, getattr(state, name)):
                        done += size
                        progress(STAGE, done, total, "B")


def describe_state(transfer):
    """All of a Transfer but the matrices of surfaces × suns: xarray.Dataset."""
    surfaces, suns, site = transfer.surfaces, transfer.suns, transfer.site
    variables = {"normal": (("surface", "axis"), surfaces.normal), "direction": (("sun", "axis"), suns.direction)}
    for name in TEXTS:
        variables[name] = ("surface", np.array(getattr(surfaces, name), dtype=object))
    for name, (owner, unit, long_name) in PER_SURFACE.items():
        values = np.asarray(getattr(surfaces if owner == "surfaces" else transfer, name))
        values = values.astype(np.int8) if values.dtype == bool else values
        variables[name] = ("surface", values, {"units": unit, "long_name": long_name})
    for name in PER_SUN:
        variables[name] = ("sun", getattr(suns, name))
    attributes = {
        "title": FORMAT,
        "way": suns.way,
        "ground_albedo": transfer.ground_albedo,
        "site": json.dumps(finite(vars(site))),
    }
    if transfer.record is not None:
        attributes["record"] = json.dumps(finite(transfer.record.as_dict()), ensure_ascii=False)
    if transfer.albedo is not None:
        variables[ALBEDO] = ("surface", transfer.albedo, TRACED_AS[ALBEDO])
        variables[MATERIAL] = ("surface", np.array(transfer.material, dtype=object), TRACED_AS[MATERIAL])
        attributes["albedos"] = json.dumps(finite(transfer.albedos), ensure_ascii=False)
    if transfer.error_parts is not None:
        for name, (dimensions, long_name) in ERROR_PARTS.items():
            attributes_of_part = {"units": "1", "long_name": long_name}
            variables[name] = (dimensions, getattr(transfer.error_parts, name), attributes_of_part)
    variables |= horizon_variables(transfer.horizon)
    if transfer.outlines is not None:
        values = transfer.outlines.points, transfer.outlines.ring_start, transfer.outlines.surface_start
        for (name, (dimensions, details)), array in zip(OUTLINES.items(), values, strict=True):
            variables[name] = (dimensions, array, details, {"zlib": True})
    if transfer.bare is not None:
        attributes["leaf_months"] = json.dumps(transfer.leaf_months)
    if transfer.terrain is not None:
        variables[TERRAIN] = ("azimuth", transfer.terrain.elevation, TERRAIN_DETAILS)
        attributes["terrain_source"] = transfer.terrain.source
    return xarray.Dataset(variables, attrs=attributes)


def horizon_variables(horizon):
    """Variables of the light of the horizon: dict, empty where it was not traced."""
    if horizon is None:
        return {}
    return {
        name: ("surface", getattr(horizon, field), {"units": "1", "long_name": long_name})
        for field, (name, long_name) in HORIZON.items()
    }


def append_matrix(file, name, matrix):
    """Add a matrix of surfaces × suns, block by block, and yield the bytes of each."""
    variable = file.createVariable(name, "f4", ("surface", "sun"), compression="zlib", complevel=1)
    variable.setncatts({"units": "1", "long_name": PER_SURFACE_AND_SUN[name]})
    for rows, values in row_blocks(matrix):
        variable[rows] = values
        yield values.nbytes
