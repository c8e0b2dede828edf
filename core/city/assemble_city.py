"""Join the contents of files into one City: clean rings, one LoD per building, no duplicates,
unique identifiers.
"""

import re
from collections import Counter, defaultdict

import numpy as np

from ..settings.errors import InputError
from ..settings.progress import silent
from ..settings.tolerances import GEOMETRY
from .choose_levels import choose_levels, commonest_reason
from .city import City, ImportReport, free_name, number_names, starts_of
from .judge_turning import judge_turning
from .orient_shells import orient_shells, turn_over
from .polygons import clean_rings, measure_polygons
from .repair_polygons import repair_polygons
from .strays import find_strays


def assemble_city(contents, crs, lod=None, orient="auto", report_share=silent):
    """Join the contents of files into one City.

    Parameters
    ----------
    contents : list of FileContent
        Points in metres of one common coordinate reference system, x east, y north, z up.
    crs : str or None
    lod : str, optional
        Level of detail; by default the best 2.x of each building.
    orient : {'auto', 'as-drawn'}
        Turn over polygons that face into their building, or keep all as drawn.
    report_share : callable, optional
        Called after each step with the share of the time, as measured with up to a million
        polygons.

    Returns
    -------
    City

    Raises
    ------
    InputError
        If an option is unknown, no building has a usable polygon, or none has the requested level
        of detail.
    """
    # Options are checked before anything is joined.
    if orient not in ("auto", "as-drawn"):
        raise InputError("--orient", f"{orient!r} is unknown", "give auto or as-drawn")
    lod = None if lod is None else str(lod).strip()
    if lod is not None and not re.fullmatch(r"[0-4](\.\d)?", lod):
        raise InputError(
            "--lod", f"{lod!r} is not a level of detail", "give 1, 2, 3, or for example 2.2"
        )
    # What the files said already: counts, levels of detail met, what was skipped.
    report = ImportReport(
        files=[str(content.path) for content in contents],
        part_count=sum(content.part_count for content in contents),
        notes=[note for content in contents for note in content.notes],
    )
    # Buildings that an earlier file has point by point are dropped, and names made unique.
    _tell_buildings_apart(contents, report)
    report.building_count = sum(len(content.buildings) for content in contents)
    met = Counter(
        lod for content in contents for polygon in content.polygons for lod in polygon.lods
    )
    report.lods_met = dict(sorted(met.items()))
    for content in contents:
        for reason, identifiers in content.skipped.items():
            report.skip(reason, identifiers)
    report_share(0.1)
    # Levels of detail are chosen, polygons mended, strays left out, and faces turned outwards.
    chosen = choose_levels(contents, lod, report)
    report_share(0.2)
    # The chosen polygons as one City, and whether each was drawn as a surface, solid or
    # multisurface: of a building that is drawn in two of these ways one is kept.
    city, sources = _flatten(contents, chosen, crs, report)
    report_share(0.35)
    city = repair_polygons(city, sources, report)
    city = city.take(find_strays(city, report))
    report_share(0.65)
    # Where nothing is left the city is refused, with the commonest reason.
    if not len(city):
        raise InputError(
            contents[0].path,
            f"no building has a usable polygon: {commonest_reason(report)}",
            "correct it, or export the file again",
        )
    # Normals decide what a face sees: they must point out of the building.
    if orient == "auto":
        _orient(city, report)
    report_share(1.0)
    city.colours = _join_colours(contents, report)
    return city


def _join_colours(contents, report):
    """Colours of the materials of all files; None for a name with different colours in different
    files.
    """
    colours, doubtful = {}, set()
    for content in contents:
        for name, colour in content.colours.items():
            if colours.get(name) is not None and colour not in (None, colours[name]):
                doubtful.add(name)
            colours[name] = colours.get(name) or colour
    report.note(
        "materials have different colours in different files; none is used", sorted(doubtful)
    )
    return colours | dict.fromkeys(doubtful)


def _tell_buildings_apart(contents, report):
    """Leave out a building that is identical, point by point, to an earlier one, as of a
    neighbouring tile; others of one name in a file get a number.

    Contents are changed in place, and the report tells both.
    """
    seen = set()
    # Buildings of a file in order: the polygons of each, and a number that stands for all its
    # points and levels of detail.
    for content in contents:
        drawn, kept, taken, used = defaultdict(list), {}, dict.fromkeys(content.buildings, 1), set()
        for polygon in content.polygons:
            drawn[polygon.building].append(polygon)
        for building, name in enumerate(content.buildings):
            rings = [ring for polygon in drawn[building] for ring in polygon.rings]
            shape = hash(
                tuple(
                    (polygon.lods, *(ring.tobytes() for ring in polygon.rings))
                    for polygon in drawn[building]
                )
            )
            # Same name and same points: the neighbour's tile had it. Same name alone: it gets a
            # number.
            if name and (name, shape) in seen:
                starts = starts_of([len(polygon.rings) for polygon in drawn[building]])
                points = np.concatenate([np.empty((0, 3)), *rings])
                area, _ = measure_polygons(points, starts_of(list(map(len, rings))), starts)
                report.skip("building already read", [name], area.sum())
                continue
            seen.add((name, shape))
            kept[building] = free_name(name, taken) if name and name in used else name
            used.add(name)
        again = [name for building, name in kept.items() if name != content.buildings[building]]
        report.note(
            f"buildings of {content.path} have the name of an earlier one, number added", again
        )
        content.keep_buildings(kept)


def _flatten(contents, chosen, crs, report):
    """City of the chosen polygons, (file, polygon) each, and the kind of geometry that each of them
    belongs to: list of str, surface, solid or multisurface.
    """
    first, buildings = {}, []
    # Names of all buildings, one list for all files; those without a name are numbered.
    for content in contents:
        first[id(content)] = len(buildings)
        buildings += [
            name or f"building_{len(buildings) + k}"
            for k, name in enumerate(content.buildings, start=1)
        ]
    # Rings one after the other, open and without repeated points, reversed where their surface says
    # so; starts tell where each begins.
    polygons = [polygon for _, polygon in chosen]
    rings = [
        ring[::-1] if polygon.flipped else ring for polygon in polygons for ring in polygon.rings
    ]
    polygon_start = starts_of([len(polygon.rings) for polygon in polygons])
    points, ring_start, changed = clean_rings(rings, polygon_start)
    building = [buildings[first[id(content)] + polygon.building] for content, polygon in chosen]
    # Of a building in two files, what the first one tells counts.
    attributes = {
        (buildings[first[id(content)] + number], str(part or "")): told
        for content in reversed(contents)
        for (number, part), told in content.attributes.items()
    }
    city = City(
        surface_id=_name_surfaces(polygons, building, report),
        building_id=building,
        thematic=[polygon.thematic for polygon in polygons],
        points=points,
        ring_start=ring_start,
        polygon_start=polygon_start,
        crs=crs,
        report=report,
        lod=[polygon.lods[0] for polygon in polygons],
        material=[polygon.material for polygon in polygons],
        part=[str(polygon.part or "") for polygon in polygons],
        attributes=attributes,
    )
    # The report names the surfaces whose rings were cleaned, and those that were reversed.
    for reason, indices in changed.items():
        report.repair(reason, [city.surface_id[i] for i in indices])
    flipped = "flipped, as specified by its OrientableSurface"
    report.repair(flipped, city.names_of([polygon.flipped for polygon in polygons]))
    return city, [polygon.source for polygon in polygons]


def _name_surfaces(polygons, building, report):
    """Unique surface ids: the file's own, else the building's with a number."""
    used, names, within, repeated = set(), [], Counter(), []
    taken = dict.fromkeys((polygon.surface_id for polygon in polygons), 1)
    for polygon, b in zip(polygons, building, strict=True):
        within[b] += 1
        name = polygon.surface_id
        if not name or name in used:
            wanted = name or f"{b}_{within[b]}"
            name = free_name(wanted, taken)
            repeated += [name] if name != wanted else []
        used.add(name)
        names.append(name)
    report.repair("duplicate identifier, number appended", repeated)
    return names


def _orient(city, report):
    """Turn over polygons of the city, in place, that face into their building, and tell it in the
    report.

    The shape of a shell tells what faces inwards; rays from both sides may spare a surface, and
    decide on loose ones; what remains doubtful stays as drawn. Roofs that face down and ground that
    faces up by their classes are told, and keep their class.
    """
    # What the shape of each shell says: watertight, open, loose, or doubtful.
    orientation = orient_shells(*city.shape, number_names(city.building_id))
    # Rays from both sides may veto that, and decide for loose surfaces.
    wanted, turned = judge_turning(city.shape, orientation, np.ones(len(city), bool))
    city.points = turn_over(*city.shape, turned)
    # The report tells the turned ones by how it was known, and what stayed as drawn although
    # doubtful.
    report.repair(
        "flipped: faced inwards in a watertight shell",
        city.names_of(turned & orientation.watertight),
    )
    report.repair(
        "flipped with its open shell",
        city.names_of(turned & ~orientation.watertight & ~orientation.loose),
    )
    report.repair(
        "flipped: faced inwards by rays from both sides", city.names_of(turned & orientation.loose)
    )
    spared = (
        "surfaces face inwards by the shape of their shell, but not by rays from both sides; kept "
        "as drawn"
    )
    doubtful = "surfaces form shells whose outside cannot be determined; kept as drawn"
    report.note(doubtful, city.names_of(orientation.doubtful))
    report.note(spared, city.names_of(wanted & ~turned & ~orientation.loose))
    # After turning: roofs that look down and ground that looks up contradict their class.
    _, normal = measure_polygons(*city.shape)
    thematic, upright = np.array(city.thematic), GEOMETRY.upright
    contrary = (thematic == "RoofSurface") & (normal[:, 2] < -upright)
    contrary |= (thematic == "GroundSurface") & (normal[:, 2] > upright)
    words = "surfaces face against their class: roofs that face down, or ground that faces up"
    report.note(words, city.names_of(contrary))
