"""Which surfaces carry modules, on how much of their area, in which group they count, and why
others carry none.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..city.city import number_names, whole_of_cell
from ..city.classify import ORIENTATIONS, PAPER, SMALLEST_ELIGIBLE_AREA, classify
from ..city.find_twins import find_twins
from ..city.racks import RACK, find_racked_roofs, orient_racks
from ..modules.lay_city import OPENINGS, lay_city
from ..modules.lay_modules import ModuleLayout
from ..settings.errors import InputError
from .pv_system import KINDS

# share of a surface: if more of it is covered or has no room, it carries no modules
MOST_COVERED = 0.5
REASONS = {  # why a surface carries no modules: key in tables, words; the first that holds
    "ground": "ground, or under its building",
    "closure": "closes a building towards its neighbour",
    "underside": "faces down",
    "overhang": "leans outward by more than 1°",
    "racks": "racks stand on it and count in its place",
    "covered": "more than half covered by a neighbour, inside a building, or below the ground",
    "no-room": "more than half covered, or with another face too close before it",
    "small": "smaller than 6.25 m²",
    "direction": "steep, or more than 30° off north, east, south and west",
    "twin": "drawn twice",
    "usable": "of it nothing is usable (--usable, --facades)",
    "opening": "a window or a door",
    "narrow": "no module fits between edges, windows and what is covered",
    "left-out": "left out by the user (--leave-out)",
    "low-hours": "fewer full load hours than asked for (--least-hours)",
}
# of these, what modules in rows leave empty
OF_ROWS = ("opening", "narrow")
# of these, what takes modules off surfaces that count: they stay in groups, not in sums
CHOSEN = ("left-out", "low-hours")
# area without modules, by reason; and parts of surfaces that carry modules on the rest
LEFT_OUT = REASONS | {"parts": "covered, or without room, of surfaces with modules on the rest"}


@dataclass
class CountedArea:
    """The area that counts, of n surfaces, and why others carry no modules."""

    kind: np.ndarray  # (n,) str; facade also where overhangs count as such
    orientation: np.ndarray  # (n,) str
    eligible: np.ndarray  # (n,) bool
    open_area: np.ndarray  # (n,) [m²] not inside or under buildings, with room for modules
    # (n,) [m²] open area, or all of it, of eligible surfaces, and of level roofs where the paper's
    # sectors leave these beside them; 0 of others
    counted_area: np.ndarray
    # (n,) modules on it, of cells and with usable shares no whole numbers
    module_count: np.ndarray
    module_area: np.ndarray  # (n,) [m²] of these modules
    kwp: np.ndarray  # (n,) [kWp] of these modules
    area_kwp: np.ndarray  # (n,) [kWp] if modules covered every square metre of it
    reason: np.ndarray  # (n,) str, of `REASONS`; "" exactly where kwp is above zero
    reason_note: np.ndarray  # (n,) str, words of the user on it
    layout: ModuleLayout | None  # where the modules lie; None: every square metre carries them

    @property
    def summed(self):
        """Surfaces whose area, power and energy are in sums: (n,) bool."""
        return (self.counted_area > 0) & ~np.isin(self.reason, CHOSEN)


def find_counted_area(transfer, system, *, steepest_underside=165.0):
    """Area that counts for groups, power and energy.

    Parameters
    ----------
    transfer : Transfer
    system : PvSystem
        Its settings `hidden_walls`, `clearance`, `overhangs`, `sectors` (of overhangs) and `usable`
        are used, and its layout where the Transfer has outlines.

    Returns
    -------
    CountedArea

    Raises
    ------
    InputError
        The Transfer knows the room for modules for other clearances.
    """
    surfaces, area = transfer.surfaces, np.asarray(transfer.surfaces.area, float)
    kind, orientation, eligible = (
        np.array(surfaces.kind),
        np.array(surfaces.orientation),
        np.array(surfaces.eligible),
    )
    tilt, thematic = np.asarray(surfaces.surface_tilt), np.asarray(surfaces.thematic, str)
    # Walls that lean outward are facades where asked for, as in the paper.
    if system.overhangs:
        # `steepest_underside`: [°] of tilt; beyond it a surface is a ceiling, without an
        # orientation.
        chosen = (kind == "downward") & (tilt < steepest_underside) & (thematic != "GroundSurface")
        upright = np.where(chosen, 90.0, tilt)
        kinds = classify(area, upright, surfaces.surface_azimuth, thematic, system.sectors)
        pairs = zip(kinds, (kind, orientation, eligible), strict=True)
        kind, orientation, eligible = (np.where(chosen, one, own) for one, own in pairs)
    # Surfaces mostly covered or mostly without room, unless hidden walls shall count, and roofs
    # under racks carry nothing.
    covered, whole = np.asarray(transfer.covered_share, float), system.hidden_walls == "count"
    taken = np.minimum(covered + _share_without_room(transfer, system), 1.0)
    hidden = (taken > MOST_COVERED) & (not whole)
    racked = find_racked_roofs(surfaces.surface_id, kind)
    # Level roofs stand beside what the paper's sectors count.
    level = (kind == "flat") & (thematic != "ClosureSurface") & (area >= SMALLEST_ELIGIBLE_AREA)
    carries = (eligible | (level & (system.sectors == PAPER))) & ~hidden & ~racked
    # Whether the sectors count a surface of its shape, however small.
    large = np.full(len(area), SMALLEST_ELIGIBLE_AREA), np.where(kind == "facade", 90.0, tilt)
    facing = classify(*large, surfaces.surface_azimuth, thematic, system.sectors)[2]
    usable = system.share_usable(replace(surfaces, kind=kind))
    # Area that is open, and area that counts: the open part of what carries modules, or all of it
    # where hidden walls count.
    open_area = area * (1.0 - taken)
    counted_area = np.where(carries, area if whole else open_area, 0.0)
    module, layout = system.module, None
    module_area, count = counted_area, counted_area / module.area
    # Modules are laid in rows where these are wanted and the outlines known; else every square
    # metre carries modules, whose number need not be whole.
    if system.layout is not None and system.layout.rows and transfer.shapes_known:
        layout, count = lay_city(
            replace(surfaces, kind=kind),
            transfer.outlines,
            carries & (usable > 0),
            system.layout,
            hidden=taken,
            taken=None if whole else transfer.taken_at(system.clearance),
        )
        module_area = count * system.layout.area
    fits = count > 0
    # Why a surface carries no modules: the first reason that holds, "" if it carries them. A
    # surface that all this would let carry modules lies on another: twin.
    holds = {
        "": carries & (usable > 0) & fits,
        "usable": carries & (usable <= 0),
        "opening": carries & np.isin(thematic, OPENINGS),
        "narrow": carries,
        "ground": (kind == "ground") | (thematic == "GroundSurface"),
        "closure": thematic == "ClosureSurface",
        "underside": (kind == "downward") & (tilt >= steepest_underside),
        "overhang": kind == "downward",
        "racks": racked,
        "covered": hidden & (covered > MOST_COVERED),
        "no-room": hidden,
        "small": area < SMALLEST_ELIGIBLE_AREA,
        "direction": ~facing,
    }
    return CountedArea(
        kind=kind,
        orientation=orientation,
        eligible=eligible & carries,
        open_area=open_area,
        counted_area=counted_area,
        module_count=count * usable,
        module_area=module_area * usable,
        kwp=count * usable * module.nominal_power / 1000,
        area_kwp=counted_area * usable / module.area_of_kwp,
        reason=np.select(list(holds.values()), list(holds), "twin"),
        reason_note=np.full(len(area), ""),
        layout=layout,
    )


def _share_without_room(transfer, system):
    """Share of surfaces that is open but has no room for a module: (n,); 0 where nothing is known
    of it.
    """
    if transfer.no_room is None:
        return np.zeros(len(transfer.surfaces))
    if system.clearance not in transfer.clearances:
        raise InputError(
            "--clearance",
            f"{system.clearance:g} m was not traced",
            f"give {' or '.join(f'{length:g}' for length in transfer.clearances)}, or trace the "
            "city again",
        )
    return transfer.no_room[:, transfer.clearances.index(system.clearance)]


def find_lit_share(transfer, system):
    """Share of each surface that its light falls on, and by which the sums of power are multiplied:
    (n,).

    Modules on the open part of a surface get its light: the mean over the whole surface divided by
    this share. Modules that are counted where it is covered, or has no room, are dark.
    """
    covered = np.asarray(transfer.covered_share, float)
    cramped = _share_without_room(transfer, system)
    # Much of the light of a surface that is mostly without room is that in the gap before it.
    dark = np.where(covered + cramped <= MOST_COVERED, cramped, 0.0)
    if transfer.left_out is not None:
        dark = np.maximum(dark, transfer.left_out)
    # Below a 64th the light of a surface is too uncertain to be divided by its lit share.
    return np.maximum(1.0 - covered - dark, 1 / 64)


def _note_other_clearance(transfer, clearance):
    """What the light of a Transfer is for another clearance than was traced: str, empty for the
    same.
    """
    traced = transfer.record.request.get("clearance") if transfer.record else None
    if transfer.left_out is None or traced in (None, clearance):
        return ""
    told = f"was traced for --clearance {traced:g}: places with less room than that are dark in it"
    if clearance < traced:
        told += f", also where they count with {clearance:g} m"
    else:
        told += f"; light on others that do not count with {clearance:g} m is in its means"
    return f"{told}. Trace the city again for what lies between"


def note_other_layout(transfer, request):
    """What is said of a Transfer whose shapes are not known, where rows are asked for: str."""
    if request.layout == "area" or transfer.shapes_known:
        return ""
    return (
        "does not tell which parts of surfaces are covered (versions before 0.3 did not keep their "
        "shapes): modules are counted by area, as with --layout area"
    )


def note_other_settings(transfer, request):
    """What is said of a Transfer that was traced for another clearance, or does not know the shapes
    that rows need: list of str.
    """
    notes = _note_other_clearance(transfer, request.clearance), note_other_layout(transfer, request)
    return [note for note in notes if note]


def classify_again(transfer, sectors):
    """The Transfer for other sectors than it was traced for: by tilt, azimuth and class, as those
    of its surfaces were.

    Ground and racks stay what they are. Surfaces drawn twice are found by the outlines, where they
    were kept. Those that become eligible may have been traced with a quarter of the rays, and keep
    their own errors.

    Parameters
    ----------
    transfer : Transfer
        Of version 0.2.0, or with a record of its sectors.
    sectors : str
        As of `classify`.

    Returns
    -------
    Transfer
        `transfer` itself where it was traced for these sectors.
    """
    asked = transfer.record.request if transfer.record else {}
    before, old = asked.get("sectors", PAPER), transfer.surfaces
    if before == sectors:
        return transfer
    kind, area = np.asarray(old.kind), np.asarray(old.area, float)
    rack, ground = kind == RACK, kind == "ground"
    if asked.get("grid_size"):  # a cell is eligible if the polygon it was cut from is
        whole = number_names([whole_of_cell(name) for name in old.surface_id])
        area = np.bincount(whole, area)[whole]
    shapes = area, old.surface_tilt, old.surface_azimuth, old.thematic
    _, orientation, eligible = classify(*shapes, sectors)
    orientation, eligible = np.where(ground, "none", orientation), eligible & ~ground
    known = classify(*shapes, before)[2]
    eligible = np.where(known, eligible & old.eligible, eligible & ~_find_drawn_twice(transfer))
    orientation = np.where(
        rack, orient_racks(old.surface_tilt, old.surface_azimuth, sectors), orientation
    )
    surfaces = replace(old, orientation=orientation, eligible=eligible | rack)
    return replace(
        transfer,
        surfaces=surfaces,
        bare=transfer.bare and replace(transfer.bare, surfaces=surfaces),
    )


def _find_drawn_twice(transfer):
    """Surfaces that lie on others which face the same way: (n,) bool; none where no outlines were
    kept.
    """
    surfaces, outlines = transfer.surfaces, transfer.outlines
    kind, twins = np.asarray(surfaces.kind), np.zeros(len(surfaces), bool)
    if outlines is not None:
        count = int((kind != RACK).sum())  # racks are last
        start = outlines.surface_start[: count + 1]
        shape = outlines.points.astype(float), outlines.ring_start[: start[-1] + 1], start
        receiving = ~np.isin(kind[:count], ("ground", "downward"))
        twins[:count] = find_twins(shape, surfaces.area[:count], surfaces.normal[:count], receiving)
    return twins


@dataclass
class Groups:
    """The groups that have eligible surfaces."""

    names: list  # (g,) of (kind, orientation)
    count: np.ndarray  # (g,) surfaces
    area: np.ndarray  # (g,) [m²] counted area
    weight: np.ndarray  # (n, g) area of each surface over the group's counted area


def find_groups(counted, area):
    """Group the eligible surfaces by kind and orientation.

    Results are means over whole polygons, with zero for covered parts; weighted with A / Σ open
    area they become means over the open area of the group.

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
    pairs = sorted(
        set(zip(kind[eligible].tolist(), orientation[eligible].tolist(), strict=True)),
        key=rank_group,
    )
    members = [eligible & (kind == name) & (orientation == side) for name, side in pairs]
    # weight  whole area of a surface over the open area of its group.
    total = np.array([counted.counted_area[member].sum() for member in members])
    weight = np.zeros((len(kind), len(pairs)))
    for column, member in enumerate(members):
        weight[member, column] = np.asarray(area)[member] / total[column]
    return Groups(pairs, np.array([member.sum() for member in members], int), total, weight)


def name_group(kind, orientation):
    """facade_south; flat and rack where there is no orientation."""
    return kind if orientation == "none" else f"{kind}_{orientation}"


def rank_group(pair):
    """Kinds in their order, then orientations clockwise from north; other names follow in the
    alphabet's order.
    """
    kind, orientation = pair
    return [*KINDS, kind].index(kind), [*ORIENTATIONS, orientation].index(orientation), pair
