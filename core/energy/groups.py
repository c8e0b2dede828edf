"""Groups of eligible surfaces: kind × orientation."""

from dataclasses import dataclass

import numpy as np

KINDS = ("facade", "roof")
ORIENTATIONS = ("north", "east", "south", "west")


@dataclass
class Groups:
    """The groups that have eligible surfaces."""

    names: list  # (g,) of (kind, orientation)
    count: np.ndarray  # (g,) surfaces
    area: np.ndarray  # (g,) [m²]
    weight: np.ndarray  # (n, g) share of each surface in its group's area


def find_groups(surfaces):
    """Group the eligible surfaces by kind and orientation.

    Parameters
    ----------
    surfaces : Surfaces

    Returns
    -------
    Groups
    """
    kind, orientation = np.asarray(surfaces.kind), np.asarray(surfaces.orientation)
    eligible, area = np.asarray(surfaces.eligible, bool), np.asarray(surfaces.area, float)
    pairs = sorted(set(zip(kind[eligible].tolist(), orientation[eligible].tolist(), strict=True)), key=rank_group)
    members = [eligible & (kind == name) & (orientation == side) for name, side in pairs]
    total = np.array([area[member].sum() for member in members])
    weight = np.zeros((len(area), len(pairs)))
    for column, member in enumerate(members):
        weight[member, column] = area[member] / total[column]
    return Groups(pairs, np.array([member.sum() for member in members], int), total, weight)


def rank_group(pair):
    """Facades before roofs, then north, east, south, west; other names follow in the alphabet's order."""
    kind, orientation = pair
    return (
        KINDS.index(kind) if kind in KINDS else len(KINDS),
        ORIENTATIONS.index(orientation) if orientation in ORIENTATIONS else len(ORIENTATIONS),
        pair,
    )
