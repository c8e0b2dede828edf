"""Groups of eligible surfaces: kind × orientation."""

from dataclasses import dataclass

import numpy as np

KINDS = ("facade", "roof", "rack")
ORIENTATIONS = ("north", "east", "south", "west")


@dataclass
class Groups:
    """The groups that have eligible surfaces."""

    names: list  # (g,) of (kind, orientation)
    count: np.ndarray  # (g,) surfaces
    area: np.ndarray  # (g,) [m²] counted area
    weight: np.ndarray  # (n, g) area of each surface over the group's counted area


def find_groups(counted, area):
    """Group the eligible surfaces by kind and orientation.

    Results are means over whole polygons, with zero for covered parts; weighted with A / Σ A · (1 − covered_share) they
    become means over the open area of the group.

    Parameters
    ----------
    counted : CountedArea
    area : numpy.ndarray, (n,)
        Whole area of the surfaces [m²].

    Returns
    -------
    Groups
    """
    kind, orientation, eligible = counted.kind, counted.orientation, counted.eligible
    pairs = sorted(set(zip(kind[eligible].tolist(), orientation[eligible].tolist(), strict=True)), key=rank_group)
    members = [eligible & (kind == name) & (orientation == side) for name, side in pairs]
    total = np.array([counted.counted_area[member].sum() for member in members])
    weight = np.zeros((len(kind), len(pairs)))
    for column, member in enumerate(members):
        weight[member, column] = np.asarray(area)[member] / total[column]
    return Groups(pairs, np.array([member.sum() for member in members], int), total, weight)


def rank_group(pair):
    """Facades before roofs and racks, then north, east, south, west; other names follow in the alphabet's order."""
    kind, orientation = pair
    return (
        KINDS.index(kind) if kind in KINDS else len(KINDS),
        ORIENTATIONS.index(orientation) if orientation in ORIENTATIONS else len(ORIENTATIONS),
        pair,
    )
