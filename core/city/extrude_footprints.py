"""Outlines with heights become a City: prisms with flat roofs (LoD1), or roofs of a named shape
(LoD2).

All is done in arrays: walls are made of all edges at once. Only outlines that cross themselves, and
roofs with a shape, are looked at one by one.
"""

from dataclasses import dataclass, field
from itertools import chain, count

import numpy as np
import shapely
from scipy.spatial import cKDTree

from ..settings.errors import InputError
from ..settings.tolerances import GEOMETRY
from .city import City, free_name, number_names, starts_of
from .plan_geometry import list_runs
from .roof_shapes import draw_shaped
from .strays import find_strays
from .tangled_rings import FEWEST_CORNERS, is_tangled

FOOT = ("GroundSurface", "OuterCeilingSurface")  # class of the lower face: on the ground, above it


@dataclass
class Footprints:
    """Outlines of f buildings and parts of buildings, with their heights. Rings are closed."""

    points: np.ndarray  # (m, 2) float64, in the order and the units of the file, later [m]
    ring_start: np.ndarray  # (r + 1,) int64 into points
    polygon_start: np.ndarray  # (p + 1,) int64 into ring_start
    owner: np.ndarray  # (p,) int64, which of the f each polygon belongs to
    building_id: list  # (f,) str, the building; "" if it has no name
    part: list  # (f,) str, the part of it, "" if it is the whole
    bottom: np.ndarray  # (f,) float64 [m] above the ground
    top: np.ndarray  # (f,) float64 [m] above the ground, the roof included
    ground: np.ndarray  # (f,) float64 [m] of the ground, NaN where it is not known
    height_source: list  # (f,) str: the attribute that gives the height, or what stands for it
    above_sea: np.ndarray  # (f,) bool: the top is above the sea, not above the ground
    roofs: dict = field(default_factory=dict)  # row of the f -> roof_shapes.Roof
    attributes: list = field(default_factory=list)  # (f,) dict; [] without any
    # row of a part -> attributes of the outline of its building, dict
    outline_attributes: dict = field(default_factory=dict)


@dataclass
class _Polygons:
    """Polygons of a city, and the outline that each was made of."""

    points: np.ndarray  # (m, 3) float64 [m]
    ring_sizes: np.ndarray  # (r,) int
    rings: np.ndarray  # (n,) int, number of rings of each polygon
    outline: np.ndarray  # (n,) int
    thematic: np.ndarray  # (n,) object


def extrude_footprints(contents, crs, report, ground_height=None):
    """City of the footprints of some files.

    Parameters
    ----------
    contents : list of FileContent
        With footprints [m], x east, y north.
    crs : str or None
    report : ImportReport
        Is added to.
    ground_height : callable, optional
        Of places, (k, 2) float64 [m]: heights of the ground, (k,) float64 [m], NaN where it is not
        known. Instead of the ground that the files give.

    Returns
    -------
    City

    Raises
    ------
    InputError
        No outline has an area, or all of it ends below the terrain.
    """
    # All files as one table of buildings and parts, each with a name.
    tables = [content.footprints for content in contents]
    first = starts_of([len(table.building_id) for table in tables])
    names = _name_buildings(contents, report)
    part = [*chain.from_iterable(table.part for table in tables)]
    source = [*chain.from_iterable(table.height_source for table in tables)]
    bottom, top, ground, above_sea = (
        np.concatenate([getattr(table, name) for table in tables])
        for name in ("bottom", "top", "ground", "above_sea")
    )
    roofs = {
        before + row: roof
        for before, table in zip(first, tables, strict=False)
        for row, roof in table.roofs.items()
    }
    # Outlines that can be used, each once, exteriors counter-clockwise seen from above.
    shapes, owner = [], []
    for before, table in zip(first, tables, strict=False):
        drawn, rows = _draw_outlines(table, names[before:], report)
        shapes.append(drawn)
        owner.append(before + rows)
    shapes, owner = np.concatenate(shapes), np.concatenate(owner)
    kept = _find_singles(shapes, owner, (bottom, top), names, report)
    shapes, owner = shapes[kept], owner[kept]
    if not len(shapes):
        raise InputError(contents[0].path, "no outline has an area", "correct it")
    # Buildings one after the other, in the order of their first outline.
    building = number_names(names)
    order = np.argsort(building[owner], kind="stable")
    shapes, owner = shapes[order], owner[order]
    _note_overlaps(shapes, owner, (bottom, top), names, report)
    # They stand on the ground, the parts of a building at one height.
    foot = _find_feet(shapes, building[owner], ground[owner], ground_height)
    low, high = foot + bottom[owner], foot + top[owner]
    if above_sea.any():
        # Heights above the sea end where they say, or 1 m above the bottom where the ground is not
        # yet known. What ends below the terrain is left out.
        tops = foot + bottom[owner] + 1.0 if ground_height is None else top[owner]
        high = np.where(above_sea[owner], tops, high)
        sunk = high <= low
        report.skip("ends below the terrain", [names[row] for row in owner[sunk]])
        shapes, owner, low, high = shapes[~sunk], owner[~sunk], low[~sunk], high[~sunk]
        if not len(shapes):
            raise InputError(
                contents[0].path, "all of it ends below the terrain", "correct --height"
            )
    # Each outline becomes walls, floor and roof: a shaped roof where the file tells one that fits,
    # else a level one.
    own = {k: roofs[row] for k, row in enumerate(owner.tolist()) if row in roofs}
    drawn, shaped = _extrude(shapes, (low, high, bottom[owner] > 0), own)
    _note_roofs(len(own), len(shaped), report)
    building_id = [names[row] for row in owner[drawn.outline]]
    lods = np.where(np.isin(drawn.outline, shaped), "2", "1").tolist()
    # What has a shaped roof is LoD 2, a block LoD 1.
    city = City(
        surface_id=_number_surfaces(building_id),
        building_id=building_id,
        thematic=drawn.thematic.tolist(),
        points=drawn.points,
        ring_start=starts_of(drawn.ring_sizes),
        polygon_start=starts_of(drawn.rings),
        crs=crs,
        report=report,
        lod=lods,
        part=[part[row] for row in owner[drawn.outline]],
        height_source=[source[row] for row in owner[drawn.outline]],
        attributes=_list_told(tables, names, part),
    )
    # The report counts buildings by what told their height.
    report.building_count = len(set(building[owner]))
    report.part_count = sum(bool(part[row]) for row in np.unique(owner))
    told = dict(zip((names[row] for row in owner), (source[row] for row in owner), strict=True))
    report.height_sources = {
        name: [*told.values()].count(name) for name in sorted({*told.values()})
    }
    report.lods_met = {lod: lods.count(lod) for lod in sorted(set(lods))}
    report.lods_chosen = dict(report.lods_met)
    # Buildings at heights that none around them has are left out.
    return city.take(find_strays(city, report))


def _list_told(tables, names, part):
    """What the files tell of buildings and parts: dict as of City."""
    told, first = {}, 0
    for table in tables:
        for row, own in enumerate(table.attributes, start=first):
            outline = table.outline_attributes.get(row - first)
            if outline:
                told.setdefault((names[row], ""), {"attributes": outline})
            if own:
                told[names[row], part[row]] = {"attributes": own}
        first += len(table.building_id)
    return told


def _name_buildings(contents, report):
    """Names of the buildings of all rows; rows of one file with one name are parts of one building,
    or get a number.
    """
    names, taken, number = [], {}, count(1)
    for content in contents:
        table, own, again = content.footprints, {}, []
        for name, part in zip(table.building_id, table.part, strict=True):
            wanted = name or f"building_{next(number)}"
            if part and wanted in own:
                names.append(own[wanted])
                continue
            free = wanted
            if wanted in taken:
                free = free_name(wanted, taken)
                again.append(free)
            taken.setdefault(free, 1)
            own[wanted] = free
            names.append(free)
        report.note(
            f"buildings of {content.path} have the name of an earlier one, number added", again
        )
    return names


def _draw_outlines(table, names, report):
    """Polygons of a table without those that have no area, mended where they cross themselves:
    (k,) of shapely.Polygon, counter-clockwise, and the row of each, (k,) int.
    """
    shapes = shapely.from_ragged_array(
        shapely.GeometryType.POLYGON, table.points, (table.ring_start, table.polygon_start)
    )
    owner, broken = np.asarray(table.owner), np.flatnonzero(~shapely.is_valid(shapes))
    # Rings that cross themselves thousands of times are not mended but left out.
    tangled = [
        k
        for k in broken
        if shapely.get_num_coordinates(shapes[k]) > FEWEST_CORNERS
        and any(is_tangled(ring) for ring in _rings_of(shapes[k]))
    ]
    report.skip("outline crosses itself too often", [names[owner[k]] for k in tangled])
    broken = np.setdiff1d(broken, tangled)
    # Other broken outlines are mended by shapely; only their polygons are kept, beside the sound
    # ones.
    pieces, piece = shapely.get_parts(shapely.make_valid(shapes[broken]), return_index=True)
    flat = shapely.get_type_id(pieces) == shapely.GeometryType.POLYGON
    report.repair(
        "outline crosses or touches itself: mended",
        list(dict.fromkeys(names[owner[k]] for k in broken)),
    )
    sound = np.setdiff1d(np.arange(len(shapes)), np.concatenate([broken, tangled]).astype(int))
    shapes = np.concatenate([shapes[sound], pieces[flat]])
    owner = np.concatenate([owner[sound], owner[broken[piece[flat]]]])
    order = np.argsort(owner, kind="stable")
    shapes, owner = shapes[order], owner[order]
    # Corners closer than a millimetre are one; what has no area then is left out.
    shapes = _merge_corners(shapes)
    small = (shapely.area(shapes) <= GEOMETRY.area) | ~shapely.is_valid(shapes)
    report.skip("outline without an area", [names[row] for row in owner[small]], 0.0)
    shapes = shapes[~small]
    # A strip whose area is less than 5 cm times its edge is thinner than 10 cm: it is noted, and
    # kept as drawn.
    thin = shapely.area(shapes) < 0.05 * shapely.length(shapes)
    report.note(
        "outlines are thinner than 10 cm; read as drawn",
        [names[row] for row in owner[~small][thin]],
    )
    return shapely.orient_polygons(shapes), owner[~small]


def _merge_corners(shapes, *, least=1e-3):
    """Outlines without corners closer than a millimetre to the one before; GEOS refuses rings of
    which nothing is left, and these stay.
    """
    try:
        return shapely.remove_repeated_points(shapes, least)
    except shapely.errors.GEOSException:
        if len(shapes) == 1:
            return shapes
    half = len(shapes) // 2
    return np.concatenate([_merge_corners(shapes[:half]), _merge_corners(shapes[half:])])


def _rings_of(shape):
    return [np.asarray(ring.coords)[:-1] for ring in (shape.exterior, *shape.interiors)]


def _find_singles(shapes, owner, heights, names, report):
    """All but outlines that are drawn twice at the same heights: (k,) bool."""
    # Shapes count as equal to a millimetre, wherever their rings begin.
    bottom, top = heights
    keys = shapely.to_wkb(shapely.normalize(shapely.set_precision(shapes, 1e-3, mode="pointwise")))
    seen, kept = set(), np.ones(len(shapes), bool)
    for k, key in enumerate(zip(keys, bottom[owner].tolist(), top[owner].tolist(), strict=True)):
        kept[k] = key not in seen
        seen.add(key)
    report.skip(
        "outline already read",
        [names[row] for row in owner[~kept]],
        shapely.area(shapes[~kept]).sum(),
    )
    return kept


def _note_overlaps(shapes, owner, heights, names, report):
    """Tell of outlines that lie on outlines of other buildings at the same height."""
    one, other = shapely.STRtree(shapes).query(shapes, "intersects")
    apart = one < other
    one, other = one[apart], other[apart]
    bottom, top = (height[owner] for height in heights)
    level = np.minimum(top[one], top[other]) > np.maximum(bottom[one], bottom[other])
    building = number_names(names)[owner]
    level &= building[one] != building[other]
    one, other = one[level], other[level]
    size = shapely.area(shapes)
    common = shapely.area(shapely.intersection(shapes[one], shapes[other]))
    # Less than a hundredth of the smaller one is the accuracy of drawing.
    lying = common > 0.01 * np.minimum(size[one], size[other])
    smaller = np.where(size[one] < size[other], one, other)[lying]
    report.note(
        "outlines lie partly on others; both are read as drawn, and what lies inside another "
        "counts "
        "as covered",
        list(dict.fromkeys(names[owner[k]] for k in smaller)),
    )


def _find_feet(shapes, building, ground, ground_height):
    """Height on which each outline stands [m], (k,) float64: the lowest ground of its building; 0
    where no ground is known.
    """
    ground = np.array(ground)
    if ground_height is not None:
        places, shape = shapely.get_coordinates(shapes, return_index=True)
        heights = np.nan_to_num(ground_height(places), nan=np.inf)
        lowest = np.full(len(shapes), np.inf)
        np.minimum.at(lowest, shape, heights)
        ground = np.where(np.isfinite(lowest), lowest, ground)
    known = np.isfinite(ground)
    # Ground that is known under less than half of the buildings is not used.
    if 2 * known.sum() < len(ground):
        return np.zeros(len(ground))
    middles = shapely.get_coordinates(shapely.centroid(shapes))
    _, nearest = cKDTree(middles[known]).query(middles)
    ground = np.where(known, ground, ground[known][nearest])
    lowest = np.full(building.max() + 1, np.inf)
    np.minimum.at(lowest, building, ground)
    return lowest[building]


def _extrude(shapes, heights, roofs):
    """Polygons of all outlines between two heights.

    Parameters
    ----------
    shapes : (k,) of shapely.Polygon
    heights : tuple
        Of the foot and of the top of each, (k,) float64 [m], and whether its foot is above the
        ground, (k,) bool.
    roofs : dict
        Number of an outline -> Roof.

    Returns
    -------
    _Polygons
        In the order of the outlines: ground, roof, walls.
    list of int
        Outlines that have the roof that was asked for.
    """
    (low, high, hangs), shaped, pieces = heights, [], []
    for k, roof in roofs.items():
        drawn = draw_shaped(shapes[k], low[k], high[k], roof)
        if drawn is not None:
            shaped.append(k)
            pieces.append(_collect(drawn, k))
            pieces[-1].thematic[0] = FOOT[int(hangs[k])]
    plain = np.setdiff1d(np.arange(len(shapes)), shaped)
    if len(plain):
        pieces.insert(0, _draw_blocks(shapes[plain], plain, (low, high, hangs)))
    return (pieces[0] if len(pieces) == 1 else _sort_by_outline(pieces)), shaped


def _draw_blocks(shapes, outline, heights):
    """Grounds, flat roofs and walls of outlines, whose numbers are `outline`; heights as of
    `_extrude`: _Polygons in the order of the outlines.
    """
    low, high, hangs = (height[outline] for height in heights)
    _, points, (ring_start, polygon_start) = shapely.to_ragged_array(shapes)
    sizes, rings = np.diff(ring_start.astype(np.int64)) - 1, np.diff(polygon_start.astype(np.int64))
    # Corners without the last of each ring, which repeats the first, and the one that follows each.
    corner = np.ones(len(points), bool)
    corner[ring_start[1:] - 1] = False
    start, end = points[corner], points[np.flatnonzero(corner) + 1]
    of_ring = np.repeat(np.arange(len(outline)), rings)
    owner = np.repeat(of_ring, sizes)
    # Each outline has its ground, its roof, and a wall for each corner, one after the other: two
    # times its rings and corners, and four corners for each wall.
    first = starts_of(np.bincount(owner, minlength=len(outline)))
    number, count = np.arange(len(start)), np.diff(first)[owner]
    before = first[owner]
    solid = np.empty((6 * len(start), 3))
    # The ground faces down: its rings run the other way round. Above the ground it is classified as
    # a ceiling.
    starts = starts_of(sizes)
    mirrored = np.repeat(starts[:-1] + starts[1:] - 1, sizes) - number
    floor, eaves, ground = low[owner], high[owner], number + 5 * before
    solid[ground, :2], solid[ground, 2] = start[mirrored], floor
    solid[ground + count, :2], solid[ground + count, 2] = start, eaves
    # Walls have the inside to the left of their edge.
    wall = 4 * number + 2 * (before + count)
    for place, (corners, height) in enumerate(
        ((start, floor), (end, floor), (end, eaves), (start, eaves))
    ):
        solid[wall + place, :2], solid[wall + place, 2] = corners, height
    # Sizes of rings likewise, and rings of polygons: of ground and roof all, of a wall one.
    own, ring = starts_of(rings)[of_ring], np.arange(len(sizes))
    ring_sizes = np.full(2 * len(sizes) + len(start), 4, np.int64)
    for shift in (0, rings[of_ring]):
        ring_sizes[ring + own + first[of_ring] + shift] = sizes
    rings_of = np.ones(2 * len(outline) + len(start), np.int64)
    thematic = np.full(len(rings_of), "WallSurface", object)
    face = 2 * np.arange(len(outline)) + first[:-1]
    rings_of[face], rings_of[face + 1] = rings, rings
    thematic[face] = np.array(FOOT, object)[hangs.astype(int)]
    thematic[face + 1] = "RoofSurface"
    return _Polygons(solid, ring_sizes, rings_of, np.repeat(outline, 2 + np.diff(first)), thematic)


def _collect(drawn, outline):
    """Polygons from a list of (class, rings)."""
    rings = [ring for _, own in drawn for ring in own]
    return _Polygons(
        np.concatenate(rings),
        np.array(list(map(len, rings))),
        np.array([len(own) for _, own in drawn]),
        np.full(len(drawn), outline),
        np.array([thematic for thematic, _ in drawn], object),
    )


def _sort_by_outline(blocks):
    """Polygons of several blocks as one, in the order of their outlines."""
    points, sizes, rings, outline, thematic = (
        np.concatenate([getattr(block, name) for block in blocks])
        for name in ("points", "ring_sizes", "rings", "outline", "thematic")
    )
    order = np.argsort(outline, kind="stable")
    _, ring = list_runs(starts_of(rings)[:-1][order], rings[order])
    _, point = list_runs(starts_of(sizes)[:-1][ring], sizes[ring])
    return _Polygons(points[point], sizes[ring], rings[order], outline[order], thematic[order])


def _number_surfaces(building_id):
    """Ids of surfaces: the building's with a number, from 1 on; buildings lie one after the
    other.
    """
    names, before, number = [], None, 0
    for name in building_id:
        number = number + 1 if name == before else 1
        before = name
        names.append(f"{name}_{number}")
    return names


def _note_roofs(wanted, drawn, report):
    """Tell of roofs that are flat, and of shapes that could not be drawn."""
    if drawn:
        report.notes.append(f"{drawn:,} roofs have the shape that their attributes give.")
    if wanted > drawn:
        report.notes.append(
            f"{wanted - drawn:,} roofs of a given shape are flat: their outline or their height "
            "does not allow it."
        )
