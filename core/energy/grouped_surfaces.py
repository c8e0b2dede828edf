"""The surfaces of a city that carry modules, in the order of their groups, with their light for any
weather.
"""

from typing import NamedTuple

import numpy as np

from ..sky.sky_models import sources_of
from .check_inputs import check_sky, check_transfer
from .counted_area import Groups, find_counted_area, find_groups, find_lit_share
from .power import diffuse_incidence_factors
from .sum_block import Block


class GroupedSurfaces(NamedTuple):
    """The n surfaces of a Transfer that carry modules."""

    groups: Groups  # g of them
    rows: np.ndarray  # (n,) int, surfaces of the Transfer, group by group
    group: np.ndarray  # (n,) int, ascending
    block: Block  # their light and how modules take it, float32


def group_surfaces(transfer, system, sky, source):
    """The surfaces of a Transfer that carry modules, by group: GroupedSurfaces.

    Parameters
    ----------
    transfer : Transfer
    system : PvSystem
    sky : str
        Model of the sky; the Transfer must have its traced sources.
    source : str
        The file, for messages.

    Raises
    ------
    InputError
        The Transfer is invalid, or was traced for another sky.
    """
    check_transfer(transfer)
    check_sky(transfer, sky, source)
    counted = find_counted_area(transfer, system)
    groups = find_groups(counted, transfer.surfaces.area)
    rows = np.flatnonzero(counted.eligible)
    group = groups.weight[rows].argmax(axis=1) if len(rows) else np.zeros(0, int)
    order = np.argsort(group, kind="stable")
    rows = rows[order]
    taken = diffuse_incidence_factors(transfer.surfaces.surface_tilt[rows], system, sources_of(sky))
    block = Block.take(
        transfer,
        rows,
        group_weight=np.zeros((len(rows), 0)),
        iam=taken.astype(np.float32),
        mounting=np.zeros(len(rows), int),
        lit_share=find_lit_share(transfer, system)[rows],
    )
    return GroupedSurfaces(groups, rows, group[order], block)
