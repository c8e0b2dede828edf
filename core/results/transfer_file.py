"""transfer.nc: the traced Transfer without weather, for reuse with other weather years.

The names in the file do not change with names in the code: what version 0.2.0 wrote is read. A
group `bare` holds the same variables for the months in which deciduous trees have no leaves, and a
group `base`, of a variant whose base had too little light, holds them for the city before the edit.
Each group keeps the CRC-32 of every variable and attribute that it was written with, and a file
that differs is refused: a flipped bit can look like light.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple
from zlib import crc32

import h5netcdf
import h5py
import numpy as np

from ..city.building_facts import FACTS, BuildingFacts
from ..city.grid_cells import Outlines
from ..city.scene import Surfaces
from ..city.site import Site
from ..light.sun_matrix import row_blocks
from ..light.transfer import ErrorParts, SourceLight, TraceRecord, Transfer
from ..read.netcdf_file import check_hdf5, netcdf_file
from ..settings.errors import InputError, build_from
from ..settings.progress import silent
from ..sky.horizon import TerrainHorizon
from ..sky.horizon_band import SOURCES
from ..sun.suns import Suns
from .columns import COLUMNS
from .netcdf_variables import read_variables, write_variables
from .taken_rings import parts_of_rings, rings_of_parts
from .write_summary import finite

FORMAT = "CityPV transfer 1"
GIVE_TRANSFER = "give the transfer.nc of a run of citypv simulate"
GIVE_OWN_TRANSFER = (
    "give the transfer.nc of a run of citypv simulate, or trace the city again if another version "
    "wrote it"
)
COPY = "copy it again from where it was written, or trace the city again"
STAGE = "writing transfer.nc"
PACKED = {"compression": "gzip", "shuffle": True}

BARE = "bare"  # group with the state of deciduous trees without leaves
BASE = "base"  # group with the light of the city before an edit, which may have such a group itself
KEEPS_BASE = "light_before"  # attribute of a file that has it
# attribute: JSON of names and CRC-32, names of attributes after a colon; 0.2.0 wrote none
SUMS = "checksums"

MATRICES = {  # of surfaces × suns: name -> long name
    "visible_share": "share of the surface that sees the sun",
    "direct_reflected": (
        "reflected irradiance per DNI, without the first reflection of the far ground"
    ),
}
# Name in the file -> owner, its field, dimensions, unit, long name. A file has all variables of an
# owner, or none: not every run has error parts, a traced horizon, shapes of the surfaces or distant
# terrain.
VARIABLES = {
    "normal": ("surfaces", "normal", ("surface", "axis"), "1", "unit vector"),
    "direction": ("suns", "direction", ("sun", "axis"), "1", "unit vector to the sun"),
    "weight": ("suns", "weight", ("sun",), "1", "share of the year's sunny intervals"),
    "day": ("suns", "day", ("sun",), "", "a count, or the ordinal of the date"),
    "step": ("suns", "step", ("sun",), "", "step of the day"),
    "albedo": (
        "albedos",
        "albedo",
        ("surface",),
        "1",
        "albedo that the surface was traced with; of mirrors, glossy "
        "faces, glass and water the most that they reflect",
    ),
    "material": (
        "albedos",
        "material",
        ("surface",),
        "",
        "material that the surface was traced as; empty where no more than an albedo was given",
    ),
    "outline_points": (
        "outlines",
        "points",
        ("corner", "axis"),
        "m",
        "corners of the surfaces: true east, true north, up from the scene's origin",
    ),
    "outline_ring_start": (
        "outlines",
        "ring_start",
        ("ring_bound",),
        "",
        "first corner of each ring, and the number of corners",
    ),
    "outline_surface_start": (
        "outlines",
        "surface_start",
        ("surface_bound",),
        "",
        "first ring of each surface, and the number of rings",
    ),
    "no_room": (
        "room",
        "no_room",
        ("surface", "clearance"),
        "1",
        "share that is open, but looks at a face from less than the clearance",
    ),
    "clearance": ("room", "clearances", ("clearance",), "m", ""),
    "taken_points": (
        "taken",
        "points",
        ("taken_corner", "plane_axis"),
        "m",
        "corners of what is covered or without room: along the surface's level line, up its slope",
    ),
    "taken_ring_start": (
        "taken",
        "ring_start",
        ("taken_ring_bound",),
        "",
        "first corner of each ring; outer ones run counter-clockwise, holes clockwise",
    ),
    "taken_start": (
        "taken",
        "surface_start",
        ("taken_bound",),
        "",
        "first ring of each surface and clearance, and the number of rings",
    ),
    "left_out": (
        "left_out",
        "left_out",
        ("surface",),
        "1",
        "share without room, at the clearance of the run, whose light is not in the means",
    ),
    "string_loss": (
        "strings",
        "string_loss",
        ("surface", "sun", "diffuse_share"),
        "",
        "what strings of modules lose of their power without shade, in steps of 1/1020, where a "
        "quarter, a half and three quarters of all light are diffuse and reflected",
    ),
    "edge_distance": (
        "edge",
        "edge_distance",
        ("surface",),
        "m",
        "from the surface's middle along its normal in plan to the outline of the built area",
    ),
    "height_source": (
        "heights",
        "height_source",
        ("surface",),
        "",
        "attribute that gives the height of the building, or what it was estimated from; empty "
        "where "
        "it was not extruded",
    ),
    "terrain_elevation": (
        "terrain",
        "elevation",
        ("azimuth",),
        "degree",
        "elevation of distant terrain at equally spaced azimuths, clockwise from true north",
    ),
}
for field, per, long_name in (
    ("diffuse_passed_on", ("replicate",), "deviations of replicates of diffuse light passed on"),
    ("direct_passed_on", ("replicate",), "the same of the annual mean of direct light"),
    (
        "diffuse_discretisation",
        (),
        "diffuse light in excess by the size of patches; 0 where little",
    ),
    ("direct_discretisation", (), "the same of the annual mean of direct light"),
    ("covariance", (), "covariance of own noise in diffuse and in annual direct light"),
    ("direct_points", (), "variance of the annual mean of direct light from shadow points"),
):
    VARIABLES[field] = "error_parts", field, ("surface", *per), "1", long_name
for field in ("building", *FACTS):
    VARIABLES[f"told_{field}"] = "facts", field, ("building",), "", f"{field} that files tell"
for column in COLUMNS:
    if column.stored:
        VARIABLES[column.name] = (
            column.owner,
            column.name,
            ("surface",),
            column.unit,
            column.meaning,
        )
for source in SOURCES.values():
    for field, long_name in (
        ("view_factor", f"light of {source.title}, per {source.unit}, without reflections"),
        ("relative", f"light of {source.title}, per {source.unit}, reflections included"),
        ("standard_error", f"standard error of {source.name}_relative"),
    ):
        VARIABLES[source.variable(field)] = source.name, field, ("surface",), "1", long_name


def write_transfer(path, transfer, progress=silent):
    """Write a Transfer.

    Parameters
    ----------
    path : path-like
    transfer : Transfer
    progress : callable, optional
        See `core.settings.progress`; in bytes of the matrices, before they are packed.
    """
    base = transfer.base and replace(transfer.base, facts=None)
    states = {None: transfer, BARE: transfer.bare, BASE: base}
    states[f"{BASE}/{BARE}"] = transfer.base and transfer.base.bare
    states = {group: state for group, state in states.items() if state is not None}
    total = sum(4 * getattr(state, name).size for state in states.values() for name in MATRICES)
    done = 0
    with netcdf_file(path) as stream, h5netcdf.File(stream, "w") as file:
        progress(STAGE, 0, total, "B")
        for group, state in states.items():
            place = file.create_group(group) if group else file
            variables, attributes = _describe_state(state)
            if state.base is not None:
                attributes[KEEPS_BASE] = BASE
            if state.bare is not None:
                attributes["leaf_months"] = json.dumps(state.leaf_months)
            write_variables(place, variables)
            sums = {":" + name: _checksum(value) for name, value in attributes.items()}
            sums |= {name: _checksum(values) for name, (_, values, *_) in variables.items()}
            for name in MATRICES:
                sums[name] = 0
                for values in _append_matrix(place, name, getattr(state, name)):
                    sums[name], done = _checksum(values, sums[name]), done + values.nbytes
                    progress(STAGE, done, total, "B")
            place.attrs.update(attributes | {SUMS: json.dumps(sums)})


def _checksum(values, before=0):
    """CRC-32 of numbers or texts, after `before` of those in front of them."""
    array = np.asarray(values)
    if array.dtype.kind in "OUT":
        return crc32("\0".join(map(str, array.ravel())).encode(errors="surrogatepass"), before)
    return crc32(np.ascontiguousarray(array), before)


def describe_fields(owners):
    """Variables of some owners, as of `netcdf_variables.write_variables`.

    Parameters
    ----------
    owners : dict of str to object
        None for those that there are not.
    """
    variables = {}
    for name, (owner, field, dimensions, *details) in VARIABLES.items():
        if owners.get(owner) is not None:
            values = getattr(owners[owner], field)
            values = np.array(values, dtype=object if isinstance(values, list) else None)
            values = values.astype(np.int8) if values.dtype == bool else values
            told = {
                key: text for key, text in zip(("units", "long_name"), details, strict=True) if text
            }
            variables[name] = (
                dimensions,
                values,
                told,
                PACKED if owner in ("outlines", "taken", "strings") else {},
            )
    return variables


def _describe_state(transfer):
    """All of a Transfer but the matrices of surfaces × suns: variables by name, and attributes.

    Groups of fields that it lacks (albedos, heights, strings, terrain …) are left out. Attributes
    hold the format, the way of choosing suns and the ground's albedo, and as JSON texts the site,
    the albedos that were given, and the record of the trace.
    """
    # Groups of variables by the object whose fields they are; None leaves a group out.
    owners = {
        name: getattr(transfer, name)
        for name in ("surfaces", "suns", "error_parts", "outlines", "terrain", "facts")
    }
    owners |= {"transfer": transfer, **transfer.sources}
    owners["albedos"] = None if transfer.albedo is None else transfer
    owners["edge"] = None if transfer.surfaces.edge_distance is None else transfer.surfaces
    owners["heights"] = None if transfer.surfaces.height_source is None else transfer.surfaces
    owners["room"] = None if transfer.no_room is None else transfer
    # Polygons of what is taken are written as rings.
    known = transfer.taken_parts is not None
    owners["taken"] = rings_of_parts(transfer.taken_parts) if known else None
    owners["strings"] = None if transfer.string_loss is None else transfer
    owners["left_out"] = None if transfer.left_out is None else transfer
    # Numbers and short words as attributes; what has structure as JSON.
    attributes = {
        "title": FORMAT,
        "way": transfer.suns.sampling,
        "ground_albedo": transfer.ground_albedo,
    }
    texts = {"site": vars(transfer.site), "albedos": transfer.albedos}
    texts["record"] = None if transfer.record is None else transfer.record.as_dict()
    for name, value in texts.items():
        if value is not None:
            attributes[name] = json.dumps(finite(value), ensure_ascii=False)
    if transfer.terrain is not None:
        attributes["terrain_source"] = transfer.terrain.source
    return describe_fields(owners), attributes


def _append_matrix(file, name, matrix):
    """Add a matrix of surfaces × suns, and yield its blocks of rows."""
    # Whole rows of about a megabyte are packed together.
    chunk = (
        max(1, min(len(matrix), (1 << 20) // (4 * max(matrix.shape[1], 1)))),
        max(matrix.shape[1], 1),
    )
    packed = (
        {"chunks": chunk, "compression": "gzip", "compression_opts": 1, "shuffle": True}
        if matrix.size
        else {}
    )
    variable = file.create_variable(name, ("surface", "sun"), "f4", **packed)
    variable.attrs.update({"units": "1", "long_name": MATRICES[name]})
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
        raise InputError(path, "there is no such file", GIVE_TRANSFER)
    return _read_group(path, None)


class _Stored(NamedTuple):
    """What stands in a group of a file."""

    variables: dict  # name -> array
    attributes: dict


def _read_group(path, group):
    """Transfer in a group of a file (None: at its top), with its state without leaves and the
    light before an edit, where the file has them.
    """
    # Variables and attributes of the group, and of the state without leaves where there is one.
    with InputError.parsing(path, "cannot be read as NetCDF", GIVE_TRANSFER):
        check_hdf5(path)
        with h5py.File(path) as file:
            place = file[group] if group else file
            stored = _Stored(*read_variables(place))
            bare = None
            if "leaf_months" in stored.attributes:
                bare = _Stored(*read_variables(place[BARE]))
    # Another format, a wrong checksum, or a file that lacks what every run writes is refused.
    title = stored.attributes.get("title")
    if title != FORMAT:
        raise InputError(path, f"its title is {title!r}, not {FORMAT!r}", GIVE_OWN_TRANSFER)
    try:
        for state in (stored, *([] if bare is None else [bare])):
            _check_sums(path, state)
            _check_names(path, state)
        # What the file does not say is noted; then both states, and the light before an edit.
        unchecked = "has no checksums (version 0.2.0 wrote none): damage would not be noticed"
        notes = () if SUMS in stored.attributes else (unchecked,)
        unknown_room = (
            "does not tell where modules have no room (version 0.2.0 did not keep it): "
            "--clearance has no effect"
        )
        notes += () if "no_room" in stored.variables else (unknown_room,)
        transfer = replace(make_transfer(*stored), notes=notes)
        if KEEPS_BASE in stored.attributes:
            transfer = replace(transfer, base=_read_group(path, BASE))
        if bare is None:
            return transfer
        months = tuple(int(month) for month in json.loads(stored.attributes["leaf_months"]))
        return replace(transfer, bare=make_transfer(*bare), leaf_months=months)
    except InputError:
        raise
    except ValueError as error:  # texts that are no JSON, or have other keys, as in another version
        raise InputError.blame(path, "garbles a value", error, GIVE_OWN_TRANSFER) from error


def _check_names(path, stored):
    """Refuse a file without what every run writes."""
    wanted = [
        name for name, (owner, *_) in VARIABLES.items() if owner in ("surfaces", "suns", "transfer")
    ]
    missing = [name for name in (*wanted, *MATRICES) if name not in stored.variables]
    missing += [name for name in ("way", "ground_albedo", "site") if name not in stored.attributes]
    if missing:
        raise InputError(path, f"lacks {', '.join(missing)}", GIVE_OWN_TRANSFER)


def _check_sums(path, stored):
    """Refuse variables and attributes that are not what was written; files without
    checksums pass.
    """
    for entry, expected in json.loads(stored.attributes.get(SUMS, "{}")).items():
        values, name = stored.attributes if entry[0] == ":" else stored.variables, entry.lstrip(":")
        if name not in values:
            raise InputError(path, f"is damaged: {name} is missing", COPY)
        if _checksum(values[name]) != expected:
            raise InputError(path, f"is damaged: {name} is not what was written (CRC-32)", COPY)


def read_fields(file, owner, *, needed=False):
    """What an open file, or variables by name, have of an owner, by field; empty if it lacks any of
    it and that is not `needed`.
    """
    names = {field: name for name, (whose, field, *_) in VARIABLES.items() if whose == owner}
    if not needed and not all(name in file for name in names.values()):
        return {}
    values = {field: np.asarray(file[name][...]) for field, name in names.items()}
    return {
        field: list(map(str, value)) if value.dtype.kind in "OUT" else value
        for field, value in values.items()
    }


def make_transfer(variables, attributes):
    """Transfer from the variables and attributes of a file; what only some runs have is None
    where it is missing.
    """
    # Arrays go to surfaces, suns and light, which every file has, and to what some files have.
    surfaces, suns, own = (
        read_fields(variables, name, needed=True) for name in ("surfaces", "suns", "transfer")
    )
    surfaces |= {name: np.array(surfaces[name], dtype=str) for name in ("kind", "orientation")}
    surfaces["eligible"] = surfaces["eligible"].astype(bool)
    surfaces |= read_fields(variables, "edge") | read_fields(variables, "heights")
    for name in ("albedos", "room", "left_out", "strings"):
        own |= read_fields(variables, name)
    if "clearances" in own:
        own["clearances"] = tuple(own["clearances"].tolist())
    # Site, albedos and the record of the trace stand in attributes as JSON.
    written = [name for name in ("site", "albedos", "record") if name in attributes]
    texts = {name: json.loads(attributes[name]) for name in written}
    if "record" in texts:
        own["record"] = TraceRecord.from_dict(texts["record"])
    # Objects that only some runs have.
    builders = {"error_parts": ErrorParts, "outlines": Outlines, "facts": BuildingFacts}
    for name, build in builders.items():
        if found := read_fields(variables, name):
            own[name] = build(**found)
    if found := read_fields(variables, "taken"):
        own["taken_parts"] = parts_of_rings(Outlines(**found), len(own["clearances"]))
    if terrain := read_fields(variables, "terrain"):
        own["terrain"] = TerrainHorizon(**terrain, source=str(attributes["terrain_source"]))
    sources = {
        name: SourceLight(**found) for name in SOURCES if (found := read_fields(variables, name))
    }
    return Transfer(
        surfaces=Surfaces(**surfaces),
        site=build_from(Site, texts["site"] | {"origin": tuple(texts["site"].get("origin", ()))}),
        suns=Suns(attributes["way"], **suns),
        ground_albedo=float(attributes["ground_albedo"]),
        albedos=texts.get("albedos"),
        sources=sources,
        **own,
        **{name: variables[name] for name in MATRICES},
    )
