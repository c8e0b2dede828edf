"""Read transfer.nc."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files.open_netcdf import open_netcdf
from ..horizon.horizon import TerrainHorizon
from ..light.transfer import ErrorParts, SourceLight, Transfer, record_of_dict
from ..scene.outline_surfaces import Outlines
from ..scene.scene import Site, Surfaces
from ..sky.light_sources import SOURCES
from ..sun.suns import Suns
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
    TEXTS,
    TRACED_AS,
)

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
