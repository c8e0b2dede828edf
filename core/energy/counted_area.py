"""Which surfaces carry modules, and on how much of their area."""

from dataclasses import dataclass

import numpy as np

from ..city.classify import SMALLEST_ELIGIBLE_AREA, classify
from ..racks.rack_names import find_racked_roofs

HALF = 0.5  # of a surface: if more of it is covered, it carries no modules
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
    if system.overhangs:
        take_overhangs(surfaces, kind, orientation, eligible)
    area, covered = np.asarray(surfaces.area, float), np.asarray(transfer.covered_share, float)
    open_area = area * (1.0 - np.minimum(covered, 1.0))
    closure = np.asarray(surfaces.thematic, str) == "ClosureSurface"
    carries_racks = find_racked_roofs(surfaces.surface_id, surfaces.kind)
    flat_roof = (kind == "flat") & ~eligible & (area >= SMALLEST_ELIGIBLE_AREA) & ~closure & ~carries_racks
    if system.hidden_walls == "leave-out":
        eligible &= covered <= HALF
        flat_roof &= covered <= HALF
        counted_area = open_area
    else:
        counted_area = area
    counted_area = np.where(eligible | flat_roof, counted_area, 0.0)
    share = np.array([system.usable.get(name, 1.0) for name in kind.tolist()])
    return CountedArea(kind, orientation, eligible, flat_roof, open_area, counted_area, counted_area * share)


def take_overhangs(surfaces, kind, orientation, eligible):
    """Classify walls that lean outward as facades, as in the paper; changes kind, orientation, eligible in place."""
    tilt, thematic = np.asarray(surfaces.surface_tilt), np.asarray(surfaces.thematic, str)
    chosen = np.flatnonzero((kind == "downward") & (tilt < STEEPEST_UNDERSIDE) & (thematic != "GroundSurface"))
    upright = np.full(len(chosen), 90.0)
    found = classify(surfaces.area[chosen], upright, surfaces.surface_azimuth[chosen], thematic[chosen])
    kind[chosen], orientation[chosen], eligible[chosen] = found
