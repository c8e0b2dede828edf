"""Write transfer.nc: the traced Transfer without weather, for reuse with other weather years."""

import json

import h5netcdf
import numpy as np

from ..light.kept_matrix import row_blocks
from ..progress import silent
from ..sky.light_sources import SOURCES
from .netcdf_file import netcdf_file, write_variables
from .transfer_fields import (
    ALBEDO,
    BARE,
    ERROR_PARTS,
    FORMAT,
    MATERIAL,
    OUTLINES,
    PER_SUN,
    PER_SURFACE,
    PER_SURFACE_AND_SUN,
    SOURCE_LIGHT,
    TERRAIN,
    TERRAIN_DETAILS,
    TEXTS,
    TRACED_AS,
)
from .write_summary import finite

STAGE = "writing transfer.nc"
CHUNK = 1 << 20  # bytes that are packed together: whole rows


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
    with netcdf_file(path) as stream, h5netcdf.File(stream, "w") as file:
        progress(STAGE, 0, total, "B")
        for group, state in states.items():
            place = file.create_group(group) if group else file
            write_state(place, state)
            for name in PER_SURFACE_AND_SUN:
                for size in append_matrix(place, name, getattr(state, name)):
                    done += size
                    progress(STAGE, done, total, "B")


def write_state(file, state):
    """Write all of a Transfer but the matrices of surfaces × suns to a file or a group of it."""
    variables, attributes = describe_state(state)
    file.attrs.update(attributes)
    write_variables(file, variables)


def describe_state(transfer):
    """All of a Transfer but the matrices of surfaces × suns.

    Returns
    -------
    variables : dict of str to tuple
        Dimensions, values, and where there are any attributes and options of packing.
    attributes : dict
    """
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
    for name, light in transfer.sources.items():
        variables |= variables_of_source(SOURCES[name], light)
    if transfer.outlines is not None:
        values = transfer.outlines.points, transfer.outlines.ring_start, transfer.outlines.surface_start
        for (name, (dimensions, details)), array in zip(OUTLINES.items(), values, strict=True):
            variables[name] = (dimensions, array, details, {"compression": "gzip", "shuffle": True})
    if transfer.bare is not None:
        attributes["leaf_months"] = json.dumps(transfer.leaf_months)
    if transfer.terrain is not None:
        variables[TERRAIN] = ("azimuth", transfer.terrain.elevation, TERRAIN_DETAILS)
        attributes["terrain_source"] = transfer.terrain.source
    return variables, attributes


def variables_of_source(source, light):
    """Variables of the light of a traced source: dict."""
    return {
        source.variable(field): (
            "surface",
            getattr(light, field),
            {"units": "1", "long_name": words.format(name=source.name, title=source.title, unit=source.unit)},
        )
        for field, words in SOURCE_LIGHT.items()
    }


def append_matrix(file, name, matrix):
    """Add a matrix of surfaces × suns, block by block, and yield the bytes of each."""
    chunk = max(1, min(len(matrix), CHUNK // (4 * max(matrix.shape[1], 1)))), max(matrix.shape[1], 1)
    packed = {"chunks": chunk, "compression": "gzip", "compression_opts": 1, "shuffle": True} if matrix.size else {}
    variable = file.create_variable(name, ("surface", "sun"), "f4", **packed)
    variable.attrs.update({"units": "1", "long_name": PER_SURFACE_AND_SUN[name]})
    for rows, values in row_blocks(matrix):
        variable[rows] = values
        yield values.nbytes
