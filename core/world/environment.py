"""An environment: the eligible surfaces of a traced city, ready to be placed anywhere on Earth."""

from dataclasses import dataclass, replace

import numpy as np

from ..energy.check_inputs import check_transfer
from ..energy.counted_area import find_counted_area
from ..energy.diffuse_incidence import diffuse_incidence_factors
from ..energy.fill_behind import order_neighbours
from ..energy.groups import find_groups
from ..energy.sum_block import Block, take_block
from ..settings.errors import InputError
from ..sky.light_sources import name_untraced, sources_of
from ..sun.match_sky_grid import SkyTriangles, triangulate_sky
from .group_errors import GroupErrors, find_group_errors

SINGLE = np.float32


@dataclass
class Environment:
    """The n eligible surfaces of a city in the order of their g groups, traced for the s directions of a sky grid."""

    name: str
    source: str  # file, or "closed form"
    groups: list  # (g,) of (kind, orientation)
    group_count: np.ndarray  # (g,) surfaces
    group_area: np.ndarray  # (g,) [m²] counted area
    first: np.ndarray  # (g + 1,) int64, first surface of each group, and n
    weight: np.ndarray  # (n,) float64, area over the counted area of the group
    block: Block  # of the n surfaces, float32
    sources: np.ndarray  # (2 k + 1, n) float32: view of k traced sources, their reflected light; sky view factor
    sky: SkyTriangles
    errors: GroupErrors | None = None  # of all surfaces, also where they are merged


def build_environment(name, source, transfer, system, sky_model="isotropic"):
    """Prepare the eligible surfaces of a Transfer.

    Parameters
    ----------
    name, source : str
    transfer : Transfer
        Traced with a sky grid.
    system : PvSystem
    sky_model : str
        Of `sky_models.MODELS`; the Transfer must have its traced sources.

    Returns
    -------
    Environment

    Raises
    ------
    InputError
        If the Transfer was traced for other suns, was interrupted, has no eligible surfaces, or holds at its own place
        only.
    """
    check_sky_grid(source, transfer)
    check_portable(source, transfer)
    check_transfer(transfer)
    sources = sources_of(sky_model)
    missing = name_untraced(sky_model, transfer.sources)
    if missing:
        raise InputError(
            source,
            f"was traced without the light of {missing}, which --sky {sky_model} needs",
            "trace it again, or give --sky isotropic",
        )
    counted = find_counted_area(transfer, system)
    groups = find_groups(counted, transfer.surfaces.area)
    if not groups.names:
        raise InputError(source, "has no eligible roof or facade", "give an environment with buildings")
    rows = np.flatnonzero(counted.eligible)
    member = groups.weight[rows].argmax(axis=1)
    order = np.argsort(member, kind="stable")
    rows, member = rows[order], member[order]
    sky = triangulate_sky(transfer.suns)
    block = take_block(
        transfer,
        rows,
        group_weight=np.zeros((len(rows), 0)),
        neighbours=order_neighbours(transfer.suns),
        reach=sky.reach,
        dtype=SINGLE,
        iam=diffuse_incidence_factors(transfer.surfaces.surface_tilt[rows], system, sources),
    )
    traced = [transfer.sources[one.name] for one in sources]
    views = [light.view_factor[rows] for light in traced]
    reflected = [light.relative[rows] - view for light, view in zip(traced, views, strict=True)]
    light = np.stack([*views, *reflected, transfer.sky_view_factor[rows]]).astype(SINGLE)
    weight = groups.weight[rows, member]
    first = np.searchsorted(member, np.arange(len(groups.names) + 1)).astype(np.int64)
    found = Environment(name, source, groups.names, groups.count, groups.area, first, weight, block, light, sky)
    return replace(found, errors=find_group_errors(transfer, found, rows, traced))


def check_sky_grid(source, transfer):
    """Refuse a Transfer that was not traced for the whole sky."""
    way = transfer.suns.way
    if not way.startswith("sky-grid"):
        raise InputError(
            source,
            f"was traced with --suns {way}, which holds for one latitude only",
            "trace it again: citypv simulate CITY --suns sky-grid:673 --out DIR",
        )
    if way != f"sky-grid:{len(transfer.suns)}":
        raise InputError(
            source,
            f"holds {len(transfer.suns)} directions of {way}: its run was interrupted",
            "trace it again to the end",
        )


def check_portable(source, transfer):
    """Refuse a Transfer with what belongs to one place: distant terrain, or months in leaf."""
    if transfer.terrain is not None:
        raise InputError(
            source,
            "was traced with --horizon: distant terrain belongs to one place",
            "trace it again without --horizon",
        )
    if transfer.bare is not None:
        raise InputError(
            source,
            "has trees that are in leaf in some months only, which differ from place to place",
            "trace it again with --leaf-months all, or none",
        )
