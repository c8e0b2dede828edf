"""Which level of detail of each part of a building is taken: one that has its walls and its roof.

Files hold levels in any mixture: a part in LoD2 beside one in LoD1, single roofs of a better level,
antennas alone. So a level is chosen for each part, from its body without installations. It must not
lack walls or much of the roof that a level after it has. Installations follow the body that they
belong to.
"""

from collections import Counter, defaultdict
from dataclasses import dataclass

import numpy as np
import shapely

from ..settings.errors import InputError
from .city import starts_of
from .polygons import measure_rings

SHAPELESS = "building without "  # begins the reasons why a building was left out


def rank_lod(lod):
    """Preference: the highest 2.x, then 3.x, 1.x, and the outer shell of 4; 0 is a footprint and
    never chosen.

    Returns
    -------
    tuple
        The largest is preferred.
    """
    whole, _, part = lod.partition(".")
    return {"2": 4, "3": 3, "1": 2, "4": 1}.get(whole, 0), int(part or 0)


def _list_levels(lods, wanted=None):
    """Levels of detail that may be taken, the preferred one first.

    Parameters
    ----------
    lods : collection of str
        Levels of a part; "" is geometry of a format without levels, and matches every request.
    wanted : str, optional
        ``"2"`` takes every 2.x, ``"2.2"`` exactly that.

    Returns
    -------
    list of str
    """
    if wanted is None:
        levels = [lod for lod in lods if lod == "" or rank_lod(lod)[0] > 0]
    else:
        levels = [lod for lod in lods if lod in ("", wanted) or lod.split(".")[0] == wanted]
    return sorted(levels, key=rank_lod, reverse=True)


def choose_levels(contents, wanted, report):
    """Polygons to keep, each with the one level of detail that is taken.

    Parameters
    ----------
    contents : list of FileContent
        Points in metres, z up. `lods` of the polygons that are kept become the one that was taken.
    wanted : str or None
        As of `_list_levels`.
    report : ImportReport
        What was taken and left out is added.

    Returns
    -------
    list of (FileContent, Polygon)

    Raises
    ------
    InputError
        Nothing can be taken.
    """
    chosen, kept_lods, passed_over = [], Counter(), defaultdict(list)
    for content in contents:
        kept = _choose_in_file(content, wanted, report, passed_over)
        kept_lods.update(polygon.lods[0] for polygon in kept)
        chosen += [(content, polygon) for polygon in kept]
    for (better, taken), names in passed_over.items():
        words = f"buildings or parts lack walls or some of the roof in LoD {better}"
        report.note(f"{words}; LoD {taken or 'without a number'} was taken", names)
    report.lods_chosen = dict(sorted(kept_lods.items()))
    if not chosen:
        _refuse_empty(contents, wanted, report)
    return chosen


def _choose_in_file(content, wanted, report, passed_over):
    """Polygons of one file to keep, each with the one level of detail that is taken, of those that
    `wanted` allows: "2" all 2.x, "2.2" this one, None any.

    Levels that were passed over, for one after them that has more of the shape, are added to
    `passed_over`: (preferred, taken) -> names of parts; what is left out to the report.
    """
    # Bodies and installations of each part; a building that has nothing but installations is made
    # of them.
    units, installed = defaultdict(list), defaultdict(list)
    for polygon in content.polygons:
        (installed if polygon.installation else units)[polygon.building, polygon.part].append(
            polygon
        )
    bodies = {building for building, _ in units}
    for unit in [unit for unit in installed if unit[0] not in bodies]:
        units[unit] = installed.pop(unit)
    # Of each part the levels that it has, best first; where there are several, the first that is
    # whole: that has most of the roof, and much of the walls, of every level after it.
    levels = {unit: _list_levels(_lods_of(polygons), wanted) for unit, polygons in units.items()}
    taken = {unit: some[0] for unit, some in levels.items() if some}
    several = {
        unit: _measure_levels(units[unit], some) for unit, some in levels.items() if len(some) > 1
    }
    for unit, measured in several.items():
        taken[unit] = next(lod for lod in levels[unit] if _is_whole(lod, measured, levels[unit]))
    # Parts of one building that would be taken from different levels may draw the same thing twice:
    # the lower level's are left out, or drawn in their best level where that was passed over.
    of_building, again = defaultdict(list), set()
    for unit in taken:
        of_building[unit[0]].append(unit)
    for together in of_building.values():
        if len({taken[unit] for unit in together}) > 1:
            again |= _find_redrawn(together, units, levels, taken)
    taken = {unit: lod for unit, lod in taken.items() if unit not in again}
    # What was passed over and what is missing is told.
    for unit, lod in taken.items():
        if lod != levels[unit][0]:
            passed_over[levels[unit][0], lod].append(_name_unit(content, unit))
    drawn = {building for building, _ in units}
    for building, name in enumerate(content.buildings):
        if building not in of_building:
            missing = f"LoD {wanted}" if building in drawn and wanted else "a 3D shape"
            report.skip(f"{SHAPELESS}{missing}: casts no shadow, has no results", [name])
    lost = sorted(unit for unit in units if unit[1] and not levels[unit] and unit[0] in of_building)
    report.skip(
        "building part without the LoD of its building",
        [_name_unit(content, unit) for unit in lost],
    )
    # An installation is drawn in the level of its own body, else of its building; without that
    # level it is left out.
    of_body = {unit[0]: lod for unit, lod in taken.items()}
    level = {unit: taken.get(unit, of_body[unit[0]]) for unit in installed if unit[0] in of_body}
    follows = {unit: _follow(lod, installed[unit], wanted) for unit, lod in level.items()}
    alone = [unit for unit, lod in follows.items() if lod is None]
    report.skip(
        "installation without the LoD of its building",
        [_name_unit(content, unit) for unit in alone],
    )
    # The polygons of the chosen levels, each in its one level.
    kept = []
    for polygon in content.polygons:
        unit = polygon.building, polygon.part
        lod = (follows if polygon.installation and unit in installed else taken).get(unit)
        if lod in polygon.lods:
            polygon.lods = (lod,)
            kept.append(polygon)
    return kept


def _name_unit(content, unit):
    building, part = unit
    return f"{content.buildings[building] or 'unnamed building'}{f' part {part}' if part else ''}"


def _lods_of(polygons):
    return {lod for polygon in polygons for lod in polygon.lods}


def _follow(level, polygons, wanted):
    """Level of installations beside a body of a level: the same, else one of the same whole number,
    else None.
    """
    lods = _lods_of(polygons)
    if level in lods:
        return level
    same = [
        lod
        for lod in _list_levels(lods, wanted)
        if level and lod.split(".")[0] == level.split(".")[0]
    ]
    return same[0] if same else None


def _measure_levels(polygons, levels):
    """Area of walls and area in plan [m²] of each level of one part: dict of (float, float).

    Polygons may face either way, and roofs be drawn with or without what is below them: what counts
    in plan is the larger one of all that faces up and all that faces down.
    """
    rings = [ring for polygon in polygons for ring in polygon.rings]
    size = np.array([len(polygon.rings) for polygon in polygons])
    vectors = measure_rings(
        np.concatenate([np.empty((0, 3)), *rings]), starts_of([len(ring) for ring in rings])
    )
    first = starts_of(size)[:-1]
    length = np.linalg.norm(vectors, axis=1)
    # Holes are subtracted whichever way they run.
    share = np.divide(
        vectors[first, 2], length[first], out=np.zeros(len(first)), where=length[first] > 0
    )
    area = 2 * length[first] - np.add.reduceat(length, first)
    measured = {}
    for lod in levels:
        own = np.array([lod in polygon.lods for polygon in polygons])
        flat = np.abs(share) > 0.5  # tilted by less than 60°, else it is a wall
        plan = max((area * share * sign)[own & flat & (share * sign > 0)].sum() for sign in (1, -1))
        measured[lod] = float(area[own & ~flat].sum()), float(plan)
    return measured


def _is_whole(lod, measured, levels, *, roof=2 / 3, wall=0.3):
    """Whether a level has so much of the roof and of the walls as every level after it.

    Less than all is enough: eaves project in LoD3 only, and many files leave out the walls that
    neighbours share, or draw LoD1 as high as the ridge.
    """
    walls, plan = measured[lod]
    after = [measured[other] for other in levels[levels.index(lod) + 1 :]]
    return all(
        walls >= wall * other_walls and plan >= roof * other_plan
        for other_walls, other_plan in after
    )


def _find_redrawn(together, units, levels, taken):
    """Parts of one building that draw, in another level, what others of its parts draw better: set
    of those to leave out.

    Many files draw a whole building in LoD1, and its parts in LoD2. A tower in LoD1 on a podium in
    LoD2 stays: it covers other heights. A part whose better level was passed over is drawn in that
    after all, beside the others: its level in `taken` is changed.
    """
    again = set()
    # Parts with walls and of the higher level come first: those after them are held against them.
    drawn = {unit: _extent(units[unit], taken[unit]) for unit in together}
    order = sorted(
        together,
        key=lambda unit: (not drawn[unit].walls, *(-rank for rank in rank_lod(taken[unit])), unit),
    )
    for place, unit in enumerate(order):
        own = drawn[unit]
        others = [
            drawn[earlier]
            for earlier in order[:place]
            if earlier not in again and taken[earlier] != taken[unit]
        ]
        # Nothing stands before it in another level, or it has no plan: it stays.
        if not others or not own.plan.area:
            continue
        # Drawn again if most of its plan is covered by parts before it that have another level and
        # stay, and most of its height too, where it has any.
        covered = (
            own.plan.intersection(shapely.union_all([other.plan for other in others])).area
            > 0.5 * own.plan.area
        )
        near = [other for other in others if other.plan.intersects(own.plan)]
        shared = max(
            (min(own.high, other.high) - max(own.low, other.low) for other in near), default=0.0
        )
        # Left out if this was its best level; else it is drawn in that one.
        if covered and (not own.walls or shared > 0.5 * (own.high - own.low)):
            if taken[unit] == levels[unit][0]:
                again.add(unit)
            else:
                taken[unit] = levels[unit][0]
    return again


@dataclass
class _Extent:
    """Where one part is."""

    plan: object  # shapely geometry of what it covers in plan
    low: float  # [m]
    high: float  # [m]
    walls: bool  # whether it has any


def _extent(polygons, lod):
    polygons = [
        polygon for polygon in polygons if lod in polygon.lods and len(polygon.rings[0]) > 2
    ]
    walls, _ = _measure_levels(polygons, [lod])[lod] if polygons else (0.0, 0.0)
    plan = shapely.union_all(
        [shapely.Polygon(polygon.rings[0][:, :2]).buffer(0) for polygon in polygons]
    )
    heights = np.concatenate([np.zeros(0), *(polygon.rings[0][:, 2] for polygon in polygons)])
    return _Extent(plan, heights.min(initial=np.inf), heights.max(initial=-np.inf), walls > 0)


def _refuse_empty(contents, wanted, report):
    path = (
        contents[0].path if len(contents) == 1 else f"{len(contents)} files, {contents[0].path} …"
    )
    if not report.building_count:
        trees = sum(len(content.trees) for content in contents)
        problem = (
            f"contains no buildings, only vegetation ({trees:,})" if trees else "no buildings in it"
        )
        raise InputError(path, problem, "give the file with the buildings")
    problem = f"no building has {f'LoD {wanted}' if wanted else 'a usable shape'}"
    if not report.lods_met and (why := commonest_reason(report)):
        raise InputError(path, f"{problem}: {why}", "correct it, or export the file again")
    raise InputError(
        path,
        f"{problem} (LoD met: {', '.join(report.lods_met) or 'none'})",
        "choose one of these with --lod" if wanted else "give a file with LoD 1 to 3",
    )


def commonest_reason(report):
    """The commonest reason why something was left out, with its number and an example; "" if
    nothing was: str.
    """
    reasons = {why: names for why, names in report.skipped.items() if not why.startswith(SHAPELESS)}
    if not reasons:
        return ""
    reason, names = max(reasons.items(), key=lambda item: len(item[1]))
    return f"{reason} ({len(names)}, for example {names[0]!r})"
