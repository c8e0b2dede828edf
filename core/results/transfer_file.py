"""The fields of transfer.nc."""

import json
from dataclasses import replace
from pathlib import Path

import h5netcdf
import numpy as np

from ..errors import InputError
from ..files.open_netcdf import open_netcdf
from ..horizon.horizon import TerrainHorizon
from ..progress import silent
from ..scene.outline_surfaces import Outlines
from ..scene.scene import Site, Surfaces
from ..sky.light_sources import SOURCES
from ..sun.suns import Suns
from ..transfer.kept_matrix import row_blocks
from ..transfer.trace_record import record_of_dict
from ..transfer.transfer import ErrorParts, SourceLight, Transfer
from .columns import COLUMNS
from .netcdf_file import netcdf_file, write_variables
from .write_summary import finite

FORMAT = "CityPV transfer 1"
BARE = "bare"  # group with the state of deciduous trees without leaves

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


CURE = "give the transfer.nc of a run of citypv simulate"
OTHER_CURE = "give the transfer.nc of a run of citypv simulate, or trace the city again if another version wrote it"


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
        If the file is not there, cannot be read, or is not a Transfer.
    """
    if not Path(path).is_file():
        raise InputError(path, "there is no such file", CURE)
    try:
        dataset = load_dataset(path)
        bare = load_dataset(path, group=BARE) if "leaf_months" in dataset.attrs else None
    except InputError:
        raise
    except (OSError, ValueError, RuntimeError) as error:
        raise InputError(path, f"cannot be read as NetCDF ({error})", CURE) from error
    if dataset.attrs.get("title") != FORMAT:
        raise InputError(path, f"its title is {dataset.attrs.get('title')!r}, not {FORMAT!r}", OTHER_CURE)
    try:
        check_dimensions(path, dataset)
        transfer = transfer_of_dataset(dataset)
        if bare is None:
            return transfer
        check_dimensions(path, bare)
        months = tuple(int(month) for month in json.loads(dataset.attrs["leaf_months"]))
        return replace(transfer, bare=transfer_of_dataset(bare), leaf_months=months)
    except (KeyError, TypeError, json.JSONDecodeError) as error:
        raise InputError(path, f"lacks or garbles {error}", CURE) from error


def load_dataset(path, **options):
    """Dataset of a file, or of a group in it, in memory."""
    with open_netcdf(path, **options) as dataset:
        return dataset.load()


def check_dimensions(path, dataset):
    """Raise an error if the dimensions of variables are not those of a Transfer."""
    expected = dict.fromkeys((*TEXTS, *PER_SURFACE), ("surface",)) | dict.fromkeys(PER_SUN, ("sun",))
    expected |= dict.fromkeys(PER_SURFACE_AND_SUN, ("surface", "sun"))
    expected |= {"normal": ("surface", "axis"), "direction": ("sun", "axis")}
    expected |= dict.fromkeys(TRACED_AS, ("surface",)) if ALBEDO in dataset else {}
    expected |= {name: part[0] for name, part in ERROR_PARTS.items()} if "direct_points" in dataset else {}
    names = [source.variable(field) for source in SOURCES.values() for field in SOURCE_LIGHT]
    expected |= {name: ("surface",) for name in names if name in dataset}
    expected |= {name: dimensions for name, (dimensions, _) in OUTLINES.items() if name in dataset}
    expected |= {TERRAIN: ("azimuth",)} if TERRAIN in dataset else {}
    for name, dimensions in expected.items():
        if dataset[name].dims != dimensions:
            raise InputError(path, f"{name} lies along {dataset[name].dims}, not {dimensions}", CURE)


def transfer_of_dataset(dataset):
    """Transfer from the variables and attributes of a dataset."""
    values = {name: dataset[name].values for name in (*PER_SURFACE, *PER_SUN, *PER_SURFACE_AND_SUN)}
    texts = {name: [str(text) for text in dataset[name].values] for name in TEXTS}
    own = {name: values[name] for name, (owner, *_) in PER_SURFACE.items() if owner == "surfaces"}
    own["eligible"] = own["eligible"].astype(bool)
    site = json.loads(dataset.attrs["site"])
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
        record=record_of_dict(json.loads(dataset.attrs["record"])) if "record" in dataset.attrs else None,
        **{name: values[name] for name, (owner, *_) in PER_SURFACE.items() if owner == "transfer"},
        **{name: values[name] for name in PER_SURFACE_AND_SUN},
        **(materials_of_dataset(dataset) if ALBEDO in dataset else {}),
        error_parts=error_parts_of_dataset(dataset),
        sources=sources_of_dataset(dataset),
        outlines=outlines_of_dataset(dataset),
        terrain=terrain_of_dataset(dataset),
    )


def terrain_of_dataset(dataset):
    """Horizon of distant terrain, None where the file has none."""
    if TERRAIN not in dataset:
        return None
    return TerrainHorizon(dataset[TERRAIN].values, str(dataset.attrs["terrain_source"]))


def error_parts_of_dataset(dataset):
    """Parts of the standard errors, None where the file does not tell."""
    if "direct_points" not in dataset:
        return None
    return ErrorParts(**{name: dataset[name].values for name in ERROR_PARTS})


def sources_of_dataset(dataset):
    """Light of the traced sources: dict of SourceLight, empty in files that were traced for isotropic skies only."""
    return {
        name: SourceLight(**{field: dataset[source.variable(field)].values for field in SOURCE_LIGHT})
        for name, source in SOURCES.items()
        if source.variable("relative") in dataset
    }


def outlines_of_dataset(dataset):
    """Shapes of the surfaces; None in files written before they were kept."""
    return Outlines(*(dataset[name].values for name in OUTLINES)) if set(OUTLINES) <= set(dataset) else None


def materials_of_dataset(dataset):
    """Albedos and materials of the surfaces; files of older versions do not have them."""
    return {
        "albedo": dataset[ALBEDO].values,
        "material": [str(text) for text in dataset[MATERIAL].values],
        "albedos": json.loads(dataset.attrs["albedos"]),
    }
