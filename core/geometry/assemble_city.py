"""From the contents of files to one City: clean rings, one LoD per building, no twins, unique identifiers."""

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from .choose_lod import check_lod, choose_lod
from .city import City, ImportReport
from .clean_rings import clean_rings, starts_of
from .measure_polygons import measure_polygons, measure_rings
from .orient_shells import orient_shells, turn_over

SMALLEST_AREA = 1e-6  # [m²] a square millimetre; below it a polygon has no direction
TWIN_SHARE = 0.95  # a solid no larger than this share's inverse of the boundary surfaces repeats them


@dataclass
class _Draft:
    """Polygons as flat arrays, still with what may be dropped."""

    polygons: list
    buildings: list  # (b,) ids
    building: np.ndarray  # (n,) int64
    points: np.ndarray
    ring_start: np.ndarray
    polygon_start: np.ndarray
    names: list  # (n,) unique surface ids


def assemble_city(contents, crs, lod=None):
    """Join the contents of files into one City.

    Parameters
    ----------
    contents : list of FileContent
        Points in metres of one common coordinate reference system, x east, y north, z up.
    crs : str or None
    lod : str, optional
        Level of detail; the best of 2.x of each building by default.

    Returns
    -------
    City

    Raises
    ------
    InputError
        Nothing is left: no building has a polygon, or none has the wanted level of detail.
    """
    lod = check_lod(lod)
    report = _start_report(contents)
    drop_repeated_buildings(contents, report)
    chosen = _choose(contents, lod, report)
    draft = _flatten(contents, chosen, report)
    draft = _drop_degenerate(_drop_holes(draft, report), report)
    draft = _drop_twins(draft, report)
    if not draft.polygons:
        raise InputError(contents[0].path, "no building has a polygon that can be used", "see `citypv inspect`")
    _orient(draft, report)
    return City(
        surface_id=draft.names,
        building_id=[draft.buildings[b] for b in draft.building],
        thematic=[polygon.thematic for polygon in draft.polygons],
        points=draft.points,
        ring_start=draft.ring_start,
        polygon_start=draft.polygon_start,
        crs=crs,
        report=report,
    )


def _start_report(contents):
    report = ImportReport(files=[str(content.path) for content in contents])
    report.building_count = sum(len(content.buildings) for content in contents)
    report.part_count = sum(content.part_count for content in contents)
    met = Counter(lod for content in contents for polygon in content.polygons for lod in polygon.lods())
    report.lods_met = dict(sorted(met.items()))
    for content in contents:
        report.notes += content.notes
        for reason, identifiers in content.skipped.items():
            report.skipped.setdefault(reason, []).extend(identifiers)
    return report


def drop_repeated_buildings(contents, report):
    """Leave out a building that an earlier file (a neighbouring tile) gave point for point."""
    seen = {}
    for content in contents:
        by_building = {}
        for polygon in content.polygons:
            by_building.setdefault(polygon.building, []).append(polygon)
        repeated = set()
        for building, polygons in by_building.items():
            name = content.buildings[building]
            shape = tuple(ring.tobytes() for polygon in polygons for ring in polygon.rings) if name else None
            earlier = seen.setdefault(name, (content, hash(shape)))
            if name and earlier[0] is not content and earlier[1] == hash(shape):
                repeated.add(building)
                report.skipped.setdefault("building given by an earlier file already", []).append(name)
        if repeated:
            content.polygons = [polygon for polygon in content.polygons if polygon.building not in repeated]


def _choose(contents, wanted, report):
    """Polygons to keep: list of (content, polygon)."""
    chosen, kept_lods = [], Counter()
    for content in contents:
        lods = [set() for _ in content.buildings]
        for polygon in content.polygons:
            lods[polygon.building].update(polygon.lods())
        choice = [choose_lod(of_building, wanted) for of_building in lods]
        for of_building, lod, name in zip(lods, choice, content.buildings, strict=True):
            if lod is None:
                reason = f"building without LoD {wanted}" if of_building and wanted else "building without a shape"
                report.skipped.setdefault(reason, []).append(name)
        kept = [polygon for polygon in content.polygons if choice[polygon.building] in polygon.lods()]
        kept_lods.update(choice[polygon.building] for polygon in kept)
        chosen += [(content, polygon) for polygon in kept]
        _note_lost_parts(content, kept, choice, report)
    report.lods_chosen = dict(sorted(kept_lods.items()))
    if not chosen:
        _refuse_empty(contents, wanted, report)
    return chosen


def _note_lost_parts(content, kept, choice, report):
    parts = {(polygon.building, polygon.part) for polygon in content.polygons if polygon.part}
    parts -= {(polygon.building, polygon.part) for polygon in kept}
    for building, part in sorted(parts):
        if choice[building] is not None:
            reason = "building part without the LoD of its building"
            report.skipped.setdefault(reason, []).append(f"{content.buildings[building]} part {part}")


def _refuse_empty(contents, wanted, report):
    path = contents[0].path if len(contents) == 1 else f"{len(contents)} files, {contents[0].path} …"
    if not report.building_count:
        raise InputError(path, "no buildings in it", "give a file that holds buildings")
    met = ", ".join(report.lods_met) or "none"
    if wanted:
        raise InputError(path, f"no building has LoD {wanted} (met: {met})", "choose one that was met with --lod")
    raise InputError(path, f"no building has a shape that can be used (LoD met: {met})", "give a file with LoD 1 to 3")


def _flatten(contents, chosen, report):
    numbers, names = {}, []
    for position, content in enumerate(contents):
        for index, name in enumerate(content.buildings):
            numbers[position, index] = len(names)
            names.append(name or f"building_{len(names) + 1}")
    position = {id(content): k for k, content in enumerate(contents)}
    polygons = [polygon for _, polygon in chosen]
    building = np.array([numbers[position[id(content)], polygon.building] for content, polygon in chosen], np.int64)
    rings = [ring for polygon in polygons for ring in (polygon.rings if not polygon.flipped else _turned(polygon))]
    polygon_start = starts_of([len(polygon.rings) for polygon in polygons])
    points, ring_start, changed = clean_rings(rings, polygon_start)
    surface_names = _name_surfaces(polygons, building, names, report)
    for reason, indices in changed.items():
        if len(indices):
            report.repaired.setdefault(reason, []).extend(surface_names[i] for i in indices)
    turned = [name for name, polygon in zip(surface_names, polygons, strict=True) if polygon.flipped]
    if turned:
        report.repaired["turned over, as its OrientableSurface says"] = turned
    return _Draft(polygons, names, building, points, ring_start, polygon_start, surface_names)


def _turned(polygon):
    return [ring[::-1] for ring in polygon.rings]


def _name_surfaces(polygons, building, buildings, report):
    """Unique surface ids: the file's own, else the building's with a number."""
    taken, names, within, repeated = set(), [], Counter(), []
    own = {polygon.surface_id for polygon in polygons}
    for polygon, b in zip(polygons, building, strict=True):
        name = polygon.surface_id
        within[b] += 1
        if not name:
            name = f"{buildings[b]}_{within[b]}"
        if name in taken or (not polygon.surface_id and name in own):
            first, k = name, 2
            while (name := f"{first}~{k}") in taken or name in own:
                k += 1
            repeated.append(name)
        taken.add(name)
        names.append(name)
    if repeated:
        report.repaired["identifier given twice, number added"] = repeated
    return names


def _drop_holes(draft, report):
    """Take out holes without area."""
    count, area = np.diff(draft.ring_start), np.linalg.norm(measure_rings(draft.points, draft.ring_start), axis=1)
    is_hole = np.ones(len(count), bool)
    is_hole[draft.polygon_start[:-1]] = False
    drop = is_hole & ((count < 3) | ~(area > SMALLEST_AREA))
    if not drop.any():
        return draft
    polygon = np.repeat(np.arange(len(draft.polygons)), np.diff(draft.polygon_start))
    names = [draft.names[i] for i in np.unique(polygon[drop])]
    report.repaired.setdefault("hole without area taken out", []).extend(names)
    return replace(
        draft,
        points=draft.points[np.repeat(~drop, count)],
        ring_start=starts_of(count[~drop]),
        polygon_start=starts_of(np.bincount(polygon[~drop], minlength=len(draft.polygons))),
    )


def _drop_degenerate(draft, report):
    """Leave out polygons without area."""
    count = np.diff(draft.ring_start)
    area, _ = measure_polygons(draft.points, draft.ring_start, draft.polygon_start)
    few = count[draft.polygon_start[:-1]] < 3
    flat = ~few & ~(area > SMALLEST_AREA)
    for reason, mask in (("fewer than three points", few), ("no area", flat)):
        if mask.any():
            report.skipped.setdefault(reason, []).extend(draft.names[i] for i in np.flatnonzero(mask))
    return _keep(draft, ~(few | flat))


def _drop_twins(draft, report):
    """Leave out the Solid (or MultiSurface) that repeats the boundary surfaces of its building."""
    area, _ = measure_polygons(draft.points, draft.ring_start, draft.polygon_start)
    order = ("surface", "solid", "multisurface")
    rank = np.array([order.index(polygon.source) for polygon in draft.polygons], np.int64)
    keep = np.ones(len(rank), bool)
    size = [np.bincount(draft.building[rank == k], area[rank == k], len(draft.buildings)) for k in range(3)]
    for better, worse in ((0, 1), (0, 2), (1, 2)):
        twin = (size[better] > 0) & (size[worse] > 0) & (size[better] >= TWIN_SHARE * size[worse])
        keep &= ~((rank == worse) & twin[draft.building])
    if not keep.all():
        reason = "second drawing of the same building (Solid beside its surfaces)"
        report.skipped.setdefault(reason, []).extend(draft.names[i] for i in np.flatnonzero(~keep))
    return _keep(draft, keep)


def _orient(draft, report):
    """Turn over what faces into its building: where the shell is closed, and in open ones what has no class."""
    found = orient_shells(draft.points, draft.ring_start, draft.polygon_start, draft.building)
    named = np.array([bool(polygon.thematic) for polygon in draft.polygons])
    certain, likely = found.flip & found.closed, found.flip & ~found.closed & ~named
    draft.points = turn_over(draft.points, draft.ring_start, draft.polygon_start, certain | likely)
    for reason, mask in (("turned over: faced into its closed shell", certain), ("turned over, as its shell", likely)):
        if mask.any():
            report.repaired.setdefault(reason, []).extend(draft.names[i] for i in np.flatnonzero(mask))
    if found.doubtful.any():
        names = [draft.names[i] for i in np.flatnonzero(found.doubtful)]
        words = f"{len(names)} surfaces hang together in a way that tells no outside, and stay as drawn"
        report.notes.append(f"{words}: {', '.join(names[:5])}{' …' if len(names) > 5 else '.'}")


def _keep(draft, mask):
    if mask.all():
        return draft
    rings = np.diff(draft.polygon_start)
    ring_mask = np.repeat(mask, rings)
    point_mask = np.repeat(ring_mask, np.diff(draft.ring_start))
    kept = np.flatnonzero(mask)
    return _Draft(
        polygons=[draft.polygons[i] for i in kept],
        buildings=draft.buildings,
        building=draft.building[mask],
        points=draft.points[point_mask],
        ring_start=starts_of(np.diff(draft.ring_start)[ring_mask]),
        polygon_start=starts_of(rings[mask]),
        names=[draft.names[i] for i in kept],
    )
