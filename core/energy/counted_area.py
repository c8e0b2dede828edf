"""Which surfaces carry modules, on how much of their area, and in which group of kind and orientation they count."""

from dataclasses import dataclass

import numpy as np

from ..city.classify import SMALLEST_ELIGIBLE_AREA, classify
from ..city.racks import find_racked_roofs

KINDS = ("facade", "roof", "rack")  # of groups, in this order
ORIENTATIONS = ("north", "east", "south", "west")
MOST_COVERED = 0.5  # share of a surface: if more of it is covered, it lies inside and carries no modules
STEEPEST_UNDERSIDE = 165.0  # [°] of tilt; beyond it a surface is a ceiling, without an orientation


@dataclass
class CountedArea:
    """The area that counts, of n surfaces."""

    kind: np.ndarray  # (n,) str; facade also where overhangs count as such
    orientation: np.ndarray  # (n,) str
    eligible: np.ndarray  # (n,) bool
    flat_roof: np.ndarray  # (n,) bool: would be eligible, were it not level; without racks, not among the eligible
    open_area: np.ndarray  # (n,) [m²] not inside or under buildings
    counted_area: np.ndarray  # (n,) [m²] open area of eligible surfaces and flat roofs, or all of it; 0 of others
    module_area: np.ndarray  # (n,) [m²] of it, without windows and edges (usable share)


def find_counted_area(transfer, system):
    """Area that counts for groups, power and energy.

    Parameters
    ----------
    transfer : Transfer
    system : PvSystem
        Its settings `hidden_walls`, `overhangs` and `usable` are used.

    Returns
    -------
    CountedArea
    """
    surfaces = transfer.surfaces
    kind, orientation, eligible = np.array(surfaces.kind), np.array(surfaces.orientation), np.array(surfaces.eligible)
    if system.overhangs:  # walls that lean outward are facades, as in the paper
        tilt, thematic = np.asarray(surfaces.surface_tilt), np.asarray(surfaces.thematic, str)
        chosen = np.flatnonzero((kind == "downward") & (tilt < STEEPEST_UNDERSIDE) & (thematic != "GroundSurface"))
        upright, azimuth = np.full(len(chosen), 90.0), surfaces.surface_azimuth[chosen]
        found = classify(surfaces.area[chosen], upright, azimuth, thematic[chosen])
        kind[chosen], orientation[chosen], eligible[chosen] = found
    area, covered = np.asarray(surfaces.area, float), np.asarray(transfer.covered_share, float)
    open_area = area * (1.0 - np.minimum(covered, 1.0))
    closure = np.asarray(surfaces.thematic, str) == "ClosureSurface"
    carries_racks = find_racked_roofs(surfaces.surface_id, surfaces.kind)
    flat_roof = (kind == "flat") & ~eligible & (area >= SMALLEST_ELIGIBLE_AREA) & ~closure & ~carries_racks
    if system.hidden_walls == "leave-out":
        eligible &= covered <= MOST_COVERED
        flat_roof &= covered <= MOST_COVERED
        counted_area = open_area
    else:
        counted_area = area
    counted_area = np.where(eligible | flat_roof, counted_area, 0.0)
    share = np.array([system.usable.get(name, 1.0) for name in kind.tolist()])
    return CountedArea(kind, orientation, eligible, flat_roof, open_area, counted_area, counted_area * share)


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
    return [*KINDS, kind].index(kind), [*ORIENTATIONS, orientation].index(orientation), pair
