"""transfer.nc: the traced Transfer without weather, for reuse with other weather years.

The names in the file do not change with names in the code: what version 0.2.0 wrote is read. A group `bare` holds the
same variables for the months in which deciduous trees have no leaves. Each group keeps the CRC-32 of every variable and
attribute that it was written with, and a file that differs is refused: a flipped bit can look like light.
"""

import json
from dataclasses import replace
from pathlib import Path
from zlib import crc32

import h5netcdf
import numpy as np

from ..city.grid_cells import Outlines
from ..city.scene import Site, Surfaces
from ..light.kept_matrix import row_blocks
from ..light.transfer import ErrorParts, SourceLight, Transfer, record_of_dict
from ..read.open_netcdf import open_netcdf
from ..settings.errors import InputError
from ..settings.progress import silent
from ..sun.horizon import TerrainHorizon
from ..sun.horizon_band import SOURCES
from ..sun.suns import Suns
from .columns import COLUMNS
from .netcdf_file import netcdf_file, write_variables
from .write_summary import finite

FORMAT = "CityPV transfer 1"
CURE = "give the transfer.nc of a run of citypv simulate"
OTHER_CURE = "give the transfer.nc of a run of citypv simulate, or trace the city again if another version wrote it"
COPY = "copy it again from where it was written, or trace the city again"
STAGE = "writing transfer.nc"
CHUNK = 1 << 20  # bytes that are packed together: whole rows

BARE = "bare"  # group with the state of deciduous trees without leaves
SUMS = "checksums"  # attribute: JSON of names and CRC-32, those of attributes after a colon; 0.2.0 wrote none
UNCHECKED = "has no checksums (version 0.2.0 wrote none): damage would not be noticed"

TEXTS = tuple(column.name for column in COLUMNS if column.stored and column.kind == "text")
PER_SURFACE = {  # name -> owner, unit, long name
    column.name: (column.owner, column.unit, column.meaning)
    for column in COLUMNS
    if column.stored and column.kind != "text"
}

ALBEDO, MATERIAL = "albedo", "material"  # per surface; files written before they were kept lack both
TRACED_AS = {  # name -> attributes
    ALBEDO: {
        "units": "1",
        "long_name": "albedo that the surface was traced with; of mirrors, glossy faces, glass and water the most that "
        "they reflect",
    },
    MATERIAL: {"long_name": "material that the surface was traced as; empty where no more than an albedo was given"},
}

PER_SUN = ("weight", "day", "step")

PER_SURFACE_AND_SUN = {  # name -> long name
    "visible_share": "share of the surface that sees the sun",
    "direct_reflected": "reflected irradiance per DNI, without the first reflection of the far ground",
}

ERROR_PARTS = {  # name -> dimensions, long name; files written before they were kept lack them, forward has none
    "diffuse_passed_on": (
        ("surface", "replicate"),
        "deviations of replicates of diffuse light that other surfaces pass on",
    ),
    "direct_passed_on": (("surface", "replicate"), "the same of the annual mean of direct light"),
    "diffuse_discretisation": (("surface",), "diffuse light in excess by the size of patches; 0 where little"),
    "direct_discretisation": (("surface",), "the same of the annual mean of direct light"),
    "covariance": (("surface",), "covariance of the surface's own noise in diffuse and in annual direct light"),
    "direct_points": (("surface",), "variance of the annual mean of direct light from shadow points"),
}

TERRAIN = "terrain_elevation"  # files of runs without distant terrain lack it
TERRAIN_DETAILS = {
    "units": "degree",
    "long_name": "elevation of distant terrain at equally spaced azimuths, clockwise from true north",
}

NO_ROOM, CLEARANCE = "no_room", "clearance"  # files written before they were kept lack them
UNKNOWN_ROOM = "does not tell where modules have no room (version 0.2.0 did not keep it): --clearance has no effect"
ROOM_DETAILS = {"units": "1", "long_name": "share that is open, but looks at a face from less than the clearance"}

SOURCE_LIGHT = {  # field of SourceLight -> long name, of each traced source; files of isotropic skies have none
    "view_factor": "light of {title}, per {unit}, without reflections",
    "relative": "light of {title}, per {unit}, reflections included",
    "standard_error": "standard error of {name}_relative",
}

OUTLINES = {  # name -> dimensions, attributes; files written before outlines were kept lack them
    "outline_points": (
        ("corner", "axis"),
        {"units": "m", "long_name": "corners of the surfaces: true east, true north, up from the scene's origin"},
    ),
    "outline_ring_start": (("ring_bound",), {"long_name": "first corner of each ring, and the number of corners"}),
    "outline_surface_start": (("surface_bound",), {"long_name": "first ring of each surface, and the number of rings"}),
}


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
    total = sum(4 * getattr(state, name).size for state in states.values() for name in PER_SURFACE_AND_SUN)
    leafy, done = {"leaf_months": json.dumps(transfer.leaf_months)}, 0
    with netcdf_file(path) as stream, h5netcdf.File(stream, "w") as file:
        progress(STAGE, 0, total, "B")
        for group, state in states.items():
            place = file.create_group(group) if group else file
            variables, attributes = describe_state(state)
            attributes = attributes if group or transfer.bare is None else attributes | leafy
            write_variables(place, variables)
            sums = {":" + name: checksum(value) for name, value in attributes.items()}
            sums |= {name: checksum(values) for name, (_, values, *_) in variables.items()}
            for name in PER_SURFACE_AND_SUN:
                sums[name] = 0
                for values in append_matrix(place, name, getattr(state, name)):
                    sums[name], done = checksum(values, sums[name]), done + values.nbytes
                    progress(STAGE, done, total, "B")
            place.attrs.update(attributes | {SUMS: json.dumps(sums)})


def checksum(values, before=0):
    """CRC-32 of numbers or texts, after `before` of those in front of them."""
    array = np.asarray(values)
    if array.dtype.kind in "OUT":
        return crc32("\0".join(map(str, array.ravel())).encode(errors="surrogatepass"), before)
    return crc32(np.ascontiguousarray(array), before)


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
        "way": suns.sampling,
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
        for name, (dimensions, words) in ERROR_PARTS.items():
            variables[name] = (dimensions, getattr(transfer.error_parts, name), {"units": "1", "long_name": words})
    for source, light in ((SOURCES[name], light) for name, light in transfer.sources.items()):
        for field, words in SOURCE_LIGHT.items():
            named = words.format(name=source.name, title=source.title, unit=source.unit)
            variables[source.variable(field)] = "surface", getattr(light, field), {"units": "1", "long_name": named}
    shapes, source = describe_shapes(transfer)
    return variables | shapes, attributes | source


def describe_shapes(transfer):
    """What only some Transfers know of geometry: outlines, room for modules, distant terrain. As `describe_state`."""
    variables, attributes = {}, {}
    if transfer.outlines is not None:
        variables |= describe_outlines(transfer.outlines)
    if transfer.no_room is not None:
        variables[NO_ROOM] = (("surface", CLEARANCE), transfer.no_room, ROOM_DETAILS)
        variables[CLEARANCE] = ((CLEARANCE,), np.array(transfer.clearances, float), {"units": "m"})
    if transfer.terrain is not None:
        variables[TERRAIN] = ("azimuth", transfer.terrain.elevation, TERRAIN_DETAILS)
        attributes["terrain_source"] = transfer.terrain.source
    return variables, attributes


def describe_outlines(outlines):
    """Variables of the shapes of surfaces, as of `describe_state`."""
    values = outlines.points, outlines.ring_start, outlines.surface_start
    return {
        name: (dimensions, array, details, {"compression": "gzip", "shuffle": True})
        for (name, (dimensions, details)), array in zip(OUTLINES.items(), values, strict=True)
    }


def append_matrix(file, name, matrix):
    """Add a matrix of surfaces × suns, and yield its blocks of rows."""
    chunk = max(1, min(len(matrix), CHUNK // (4 * max(matrix.shape[1], 1)))), max(matrix.shape[1], 1)
    packed = {"chunks": chunk, "compression": "gzip", "compression_opts": 1, "shuffle": True} if matrix.size else {}
    variable = file.create_variable(name, ("surface", "sun"), "f4", **packed)
    variable.attrs.update({"units": "1", "long_name": PER_SURFACE_AND_SUN[name]})
    for rows, values in row_blocks(matrix):
        variable[rows] = values
        yield values


def read_transfer(path):
    """Read a Transfer from transfer.nc.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    Transfer

    Raises
    ------
    InputError
        If the file is not there, cannot be read, is not a Transfer, or not what was written.
    """
    if not Path(path).is_file():
        raise InputError(path, "there is no such file", CURE)
    try:
        with open_netcdf(path) as dataset:
            dataset.load()
        bare = None
        if "leaf_months" in dataset.attrs:
            with open_netcdf(path, group=BARE) as bare:
                bare.load()
    except InputError:
        raise
    except (OSError, ValueError, RuntimeError, KeyError) as error:
        raise InputError(path, f"cannot be read as NetCDF ({error})", CURE) from error
    if dataset.attrs.get("title") != FORMAT:
        raise InputError(path, f"its title is {dataset.attrs.get('title')!r}, not {FORMAT!r}", OTHER_CURE)
    try:
        for state in (dataset, *([] if bare is None else [bare])):
            check_sums(path, state)
        notes = () if SUMS in dataset.attrs else (UNCHECKED,)
        notes += () if NO_ROOM in dataset else (UNKNOWN_ROOM,)
        transfer = replace(transfer_of_dataset(dataset), notes=notes)
        if bare is None:
            return transfer
        months = tuple(int(month) for month in json.loads(dataset.attrs["leaf_months"]))
        return replace(transfer, bare=transfer_of_dataset(bare), leaf_months=months)
    except (KeyError, TypeError, json.JSONDecodeError) as error:
        raise InputError(path, f"lacks or garbles {error}", CURE) from error


def check_sums(path, dataset):
    """Refuse variables and attributes that are not what was written; files without checksums pass."""
    for name, expected in json.loads(dataset.attrs.get(SUMS, "{}")).items():
        stored = dataset.attrs[name[1:]] if name.startswith(":") else dataset[name].values
        if checksum(stored) != expected:
            raise InputError(path, f"is damaged: {name.lstrip(':')} is not what was written (CRC-32)", COPY)


def transfer_of_dataset(dataset):
    """Transfer from the variables and attributes of a dataset; what only some runs have is None where it is missing."""
    values = {name: dataset[name].values for name in (*PER_SURFACE, *PER_SUN, *PER_SURFACE_AND_SUN)}
    texts = {name: [str(text) for text in dataset[name].values] for name in TEXTS}
    own = {name: values[name] for name, (owner, *_) in PER_SURFACE.items() if owner == "surfaces"}
    own["eligible"] = own["eligible"].astype(bool)
    site = json.loads(dataset.attrs["site"])
    found = {}
    if ALBEDO in dataset:
        found["albedo"] = dataset[ALBEDO].values
        found["material"] = [str(text) for text in dataset[MATERIAL].values]
        found["albedos"] = json.loads(dataset.attrs["albedos"])
    if "record" in dataset.attrs:
        found["record"] = record_of_dict(json.loads(dataset.attrs["record"]))
    if "direct_points" in dataset:
        found["error_parts"] = ErrorParts(**{name: dataset[name].values for name in ERROR_PARTS})
    if set(OUTLINES) <= set(dataset):
        found["outlines"] = Outlines(*(dataset[name].values for name in OUTLINES))
    if NO_ROOM in dataset:
        found["no_room"], found["clearances"] = dataset[NO_ROOM].values, tuple(dataset[CLEARANCE].values.tolist())
    if TERRAIN in dataset:
        found["terrain"] = TerrainHorizon(dataset[TERRAIN].values, str(dataset.attrs["terrain_source"]))
    return Transfer(
        surfaces=Surfaces(
            **{name: texts[name] for name in ("surface_id", "building_id", "thematic")},
            **{name: np.array(texts[name], dtype=str) for name in ("kind", "orientation")},
            **own,
            normal=dataset["normal"].values,
        ),
        site=Site(**{**site, "origin": tuple(site["origin"])}),
        suns=Suns(dataset.attrs["way"], dataset["direction"].values, *(values[name] for name in PER_SUN)),
        ground_albedo=float(dataset.attrs["ground_albedo"]),
        **{name: values[name] for name, (owner, *_) in PER_SURFACE.items() if owner == "transfer"},
        **{name: values[name] for name in PER_SURFACE_AND_SUN},
        sources={
            name: SourceLight(**{field: dataset[source.variable(field)].values for field in SOURCE_LIGHT})
            for name, source in SOURCES.items()
            if source.variable("relative") in dataset
        },
        **found,
    )
