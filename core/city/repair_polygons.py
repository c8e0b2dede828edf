"""Repair polygons of a city, remove unusable and duplicate ones, and report them."""

import itertools
from dataclasses import replace

import numpy as np
import shapely

from ..settings.tolerances import GEOMETRY
from .city import number_names, starts_of
from .polygons import measure_polygons, measure_rings, plane_axes, polygon_bounds
from .tangled_rings import FEWEST_CORNERS, MOST_CROSSINGS, is_tangled
from .unite_holes import unite_holes


def repair_polygons(city, sources, report):
    """Usable polygons, each once.

    Parameters
    ----------
    city : City
    sources : list of str, (n,)
        Geometry each polygon belongs to: surface, solid or multisurface.
    report : ImportReport
        Extended by what was repaired and skipped.

    Returns
    -------
    City
    """
    untangled = _find_untangled(city, report)
    city, sources = city.take(untangled), np.array(sources)[untangled]
    city, rows = unite_holes(_exchange_rings(_drop_holes(city, report), report), report)
    usable = _find_usable(city, report)
    city, sources = city.take(usable), sources[rows[usable]]
    city = city.take(_find_first_geometry(city, sources, report))
    city = city.take(_find_singles(city, report))
    _note_bent(city, report)
    return city


def _find_untangled(city, report):
    """Polygons whose rings do not cross themselves very often: (n,) bool."""
    area, normal = measure_polygons(*city.shape)
    polygon = np.repeat(np.arange(len(city)), np.diff(city.polygon_start))
    kept = np.ones(len(city), bool)
    for ring in np.flatnonzero(np.diff(city.ring_start) >= FEWEST_CORNERS):
        # Seen along the normal of the polygon, as everything after this sees it.
        corners = city.points[city.ring_start[ring] : city.ring_start[ring + 1]]
        axes = np.concatenate(plane_axes(normal[polygon[ring]][None]))
        kept[polygon[ring]] &= not is_tangled((corners - corners[0]) @ axes.T)
    reason = f"crosses itself more than {MOST_CROSSINGS:,} times"
    report.skip(reason, city.names_of(~kept), np.maximum(area[~kept], 0.0).sum())
    return kept


def _drop_holes(city, report):
    """Remove holes without area."""
    count, area = (
        np.diff(city.ring_start),
        np.linalg.norm(measure_rings(city.points, city.ring_start), axis=1),
    )
    drop = (count < 3) | ~(area > GEOMETRY.area)
    drop[city.polygon_start[:-1]] = False
    polygon = np.repeat(np.arange(len(city)), np.diff(city.polygon_start))
    kept = np.bincount(polygon[~drop], minlength=len(city))
    report.repair(
        "hole without area removed", [city.surface_id[i] for i in np.unique(polygon[drop])]
    )
    points, ring_start = city.points[np.repeat(~drop, count)], starts_of(count[~drop])
    return replace(city, points=points, ring_start=ring_start, polygon_start=starts_of(kept))


def _exchange_rings(city, report):
    """Put the largest ring of a polygon first if the given outline lies within it.

    Some producers write a court as the outline of its house, and the house as the hole. The largest
    ring then is the outline, in its own direction, and the ring that stood first is a hole.
    """
    points, ring_start, polygon_start = city.shape
    # Area of each ring; only polygons are looked at that have a larger ring than the first.
    vectors = measure_rings(points, ring_start)
    area = np.linalg.norm(vectors, axis=1)
    exchanged, order = np.zeros(len(city), bool), np.arange(len(area))
    outline = area[polygon_start[:-1]]
    for polygon in np.flatnonzero(
        (outline > 0) & (np.maximum.reduceat(area, polygon_start[:-1]) > outline)
    ):
        first, last = polygon_start[polygon : polygon + 2]
        largest = first + int(np.argmax(area[first:last]))
        # Both seen along the area vector of the largest.
        axes = np.concatenate(plane_axes(vectors[largest][None] / area[largest]))
        rings = [points[ring_start[ring] : ring_start[ring + 1]] for ring in (first, largest)]
        small, large = (
            shapely.make_valid(shapely.Polygon((ring - rings[1][0]) @ axes.T)) for ring in rings
        )
        # All but a thousandth of the given outline must lie in its hole.
        if small.area > 0 and small.intersection(large).area >= 0.999 * small.area:
            order[[first, largest]] = largest, first
            exchanged[polygon] = True
    if not exchanged.any():
        return city
    report.repair("outline and hole exchanged", city.names_of(exchanged))
    # The rings in their new order.
    pieces = [points[ring_start[ring] : ring_start[ring + 1]] for ring in order]
    return replace(
        city, points=np.concatenate(pieces), ring_start=starts_of(list(map(len, pieces)))
    )


def _find_usable(city, report):
    """Polygons with an area: (n,) bool."""
    area, _ = measure_polygons(*city.shape)
    # Why a polygon has no area: too few points, a line, or holes larger than itself.
    few = np.diff(city.ring_start)[city.polygon_start[:-1]] < 3
    flat = ~few & ~(area > GEOMETRY.area)
    eaten = flat & (area < -GEOMETRY.area)
    beside = "holes larger than their outline, beside it"
    for reason, mask in (
        ("fewer than three points", few),
        ("no area", flat & ~eaten),
        (beside, eaten),
    ):
        report.skip(reason, city.names_of(mask), np.maximum(area[mask], 0.0).sum())
    return ~(few | flat)


def _find_first_geometry(city, sources, report):
    """All but the Solid (or MultiSurface) that duplicates the boundary surfaces of its building:
    (n,) bool.
    """
    area, _ = measure_polygons(*city.shape)
    building, keep = number_names(city.building_id), np.ones(len(area), bool)
    order = ("surface", "solid", "multisurface")
    size = {source: np.bincount(building, area * (sources == source)) for source in order}
    for better, worse in itertools.combinations(order, 2):
        # A solid is a duplicate if the boundary surfaces have at least 95 % of its area.
        twin = (size[better] > 0) & (size[worse] > 0) & (size[better] >= 0.95 * size[worse])
        keep &= ~((sources == worse) & twin[building])
    reason = "second geometry of the same building (Solid beside its surfaces)"
    report.skip(reason, city.names_of(~keep), area[~keep].sum())
    return keep


def _find_singles(city, report):
    """All but polygons that their building has already, with the same corners and facing the same
    side: (n,) bool.
    """
    area, normal = measure_polygons(*city.shape)
    # Rough marks first: building, number of corners, middle, area and side; only polygons that
    # share them are compared corner by corner.
    same_place = GEOMETRY.computed
    middles = np.round(0.5 * sum(polygon_bounds(*city.shape)) / same_place)
    size = np.diff(city.ring_start[city.polygon_start])
    sides = np.round(area / same_place), np.round(normal / 0.01)
    rough = np.column_stack([number_names(city.building_id), size, middles, *sides])
    _, group, uses = np.unique(rough, axis=0, return_inverse=True, return_counts=True)
    seen, keep = set(), np.ones(len(size), bool)
    for k in np.flatnonzero(uses[group.reshape(-1)] > 1):
        corners = city.points[
            city.ring_start[city.polygon_start[k]] : city.ring_start[city.polygon_start[k + 1]]
        ]
        cells = np.round(corners / same_place).astype(np.int64)
        key = group.reshape(-1)[k], cells[np.lexsort(cells.T)].tobytes()
        keep[k] = key not in seen
        seen.add(key)
    report.skip("duplicate polygon in its building", city.names_of(~keep), area[~keep].sum())
    return keep


def _note_bent(city, report, *, most_bent=0.05):
    """Report polygons that are not planar; they are triangulated as drawn."""
    _, normal = measure_polygons(*city.shape)
    polygon = np.repeat(np.arange(len(city)), np.diff(city.ring_start[city.polygon_start]))
    first = city.ring_start[city.polygon_start[:-1]]
    height = np.einsum("ij,ij->i", city.points - city.points[first][polygon], normal[polygon])
    low, high = polygon_bounds(height, city.ring_start, city.polygon_start)
    # Polygons whose corners deviate more from the mean plane, peak to peak, are reported [m].
    bent = high - low > most_bent
    report.repair(
        f"bent by more than {100 * most_bent:.0f} cm, triangulated as drawn", city.names_of(bent)
    )
