"""Find polygons whose file has exchanged outline and hole, and put the larger ring first."""

from dataclasses import dataclass, replace

import numpy as np
import shapely

from .measure_polygons import measure_polygons, measure_rings, polygon_bounds, starts_of
from .triangulate import plane_axes

WITHIN = 0.999  # share of the given outline that must lie in its hole


def exchange_rings(points, ring_start, polygon_start):
    """Put the largest ring of a polygon first if the given outline lies within it.

    Some producers write a court as the outline of its house, and the house as the hole. The largest ring then is the
    outline, in its own direction, and the ring that stood first is a hole.

    Parameters
    ----------
    points : array, (m, 3) float64 [m]
    ring_start : array, (r + 1,) int64
    polygon_start : array, (n + 1,) int64

    Returns
    -------
    points : array, (m, 3) float64
    ring_start : array, (r + 1,) int64
    exchanged : array, (k,) int64
        Indices of the polygons.
    """
    vectors = measure_rings(points, ring_start)
    area = np.linalg.norm(vectors, axis=1)
    exchanged, order = [], np.arange(len(area))
    for polygon in np.flatnonzero(np.diff(polygon_start) > 1):
        first, last = polygon_start[polygon : polygon + 2]
        largest = first + int(np.argmax(area[first:last]))
        if largest > first and area[first] > 0 and _lies_within(points, ring_start, first, largest, vectors[largest]):
            order[[first, largest]] = largest, first
            exchanged.append(polygon)
    if not exchanged:
        return points, ring_start, np.zeros(0, np.int64)
    pieces = [points[ring_start[ring] : ring_start[ring + 1]] for ring in order]
    return np.concatenate(pieces), starts_of([len(piece) for piece in pieces]), np.array(exchanged, np.int64)


def _lies_within(points, ring_start, inner, outer, vector):
    """Whether one ring lies within another, seen along the area vector of the outer one."""
    right, upward = plane_axes(vector[None] / np.linalg.norm(vector))
    origin = points[ring_start[outer]]
    rings = [points[ring_start[ring] : ring_start[ring + 1]] - origin for ring in (inner, outer)]
    small, large = (shapely.make_valid(shapely.Polygon(ring @ np.concatenate([right, upward]).T)) for ring in rings)
    return small.area > 0 and small.intersection(large).area >= WITHIN * small.area


SMALLEST_AREA = 1e-6  # [m²] a square millimetre; smaller polygons have no reliable normal
TWIN_SHARE = 0.95  # a solid is a duplicate if the boundary surfaces have at least this share of its area
SAME = 1e-4  # [m] corners closer than this are the same
EATEN = "holes larger than their outline, beside it"
BENT = 0.05  # [m] deviation from the mean plane, peak to peak, from which a polygon is reported


@dataclass
class Draft:
    """Polygons as flat arrays, before unusable ones are removed."""

    polygons: list
    buildings: list  # (b,) ids
    building: np.ndarray  # (n,) int64
    points: np.ndarray  # (m, 3) float64 [m]
    ring_start: np.ndarray  # (r + 1,) int64
    polygon_start: np.ndarray  # (n + 1,) int64
    names: list  # (n,) unique surface ids

    def shape(self):
        """Arguments of the measuring functions."""
        return self.points, self.ring_start, self.polygon_start


def mend_polygons(draft, report):
    """Usable polygons, each once.

    Parameters
    ----------
    draft : Draft
    report : ImportReport
        Extended by what was repaired and skipped.

    Returns
    -------
    Draft
    """
    draft = _exchange(_drop_holes(draft, report), report)
    draft = _drop_degenerate(draft, report)
    draft = _drop_doubles(_drop_twins(draft, report), report)
    _note_bent(draft, report)
    return draft


def _drop_holes(draft, report):
    """Remove holes without area."""
    count, area = np.diff(draft.ring_start), np.linalg.norm(measure_rings(draft.points, draft.ring_start), axis=1)
    is_hole = np.ones(len(count), bool)
    is_hole[draft.polygon_start[:-1]] = False
    drop = is_hole & ((count < 3) | ~(area > SMALLEST_AREA))
    if not drop.any():
        return draft
    polygon = np.repeat(np.arange(len(draft.polygons)), np.diff(draft.polygon_start))
    report.repair("hole without area removed", [draft.names[i] for i in np.unique(polygon[drop])])
    return replace(
        draft,
        points=draft.points[np.repeat(~drop, count)],
        ring_start=starts_of(count[~drop]),
        polygon_start=starts_of(np.bincount(polygon[~drop], minlength=len(draft.polygons))),
    )


def _exchange(draft, report):
    """Make the largest ring the outline where a file has exchanged outline and hole."""
    points, ring_start, exchanged = exchange_rings(*draft.shape())
    report.repair("outline and hole exchanged", [draft.names[i] for i in exchanged])
    return replace(draft, points=points, ring_start=ring_start) if len(exchanged) else draft


def _drop_degenerate(draft, report):
    """Remove polygons without area."""
    count = np.diff(draft.ring_start)
    area, _ = measure_polygons(*draft.shape())
    few = count[draft.polygon_start[:-1]] < 3
    flat = ~few & ~(area > SMALLEST_AREA)
    eaten = flat & (area < -SMALLEST_AREA)
    for reason, mask in (("fewer than three points", few), ("no area", flat & ~eaten), (EATEN, eaten)):
        if mask.any():
            report.skip(reason, _names(draft, mask), np.maximum(area[mask], 0.0).sum())
    return _keep(draft, ~(few | flat))


def _drop_twins(draft, report):
    """Remove the Solid (or MultiSurface) that duplicates the boundary surfaces of its building."""
    area, _ = measure_polygons(*draft.shape())
    order = ("surface", "solid", "multisurface")
    rank = np.array([order.index(polygon.source) for polygon in draft.polygons], np.int64)
    keep = np.ones(len(rank), bool)
    size = [np.bincount(draft.building[rank == k], area[rank == k], len(draft.buildings)) for k in range(3)]
    for better, worse in ((0, 1), (0, 2), (1, 2)):
        twin = (size[better] > 0) & (size[worse] > 0) & (size[better] >= TWIN_SHARE * size[worse])
        keep &= ~((rank == worse) & twin[draft.building])
    if not keep.all():
        reason = "second geometry of the same building (Solid beside its surfaces)"
        report.skip(reason, _names(draft, ~keep), area[~keep].sum())
    return _keep(draft, keep)


def _drop_doubles(draft, report):
    """Remove a polygon that its building has already, with the same corners and facing the same side."""
    area, normal = measure_polygons(*draft.shape())
    bounds = [polygon_bounds(axis, draft.ring_start, draft.polygon_start) for axis in draft.points.T]
    size = np.diff(draft.ring_start[draft.polygon_start])
    middles = [np.round(0.5 * (low + high) / SAME) for low, high in bounds]
    rough = np.column_stack([draft.building, size, *middles, np.round(area / SAME), np.round(normal / 0.01)])
    _, group, uses = np.unique(rough, axis=0, return_inverse=True, return_counts=True)
    seen, keep = set(), np.ones(len(size), bool)
    for k in np.flatnonzero(uses[group.reshape(-1)] > 1):
        corners = draft.points[draft.ring_start[draft.polygon_start[k]] : draft.ring_start[draft.polygon_start[k + 1]]]
        cells = np.round(corners / SAME).astype(np.int64)
        key = group.reshape(-1)[k], cells[np.lexsort(cells.T)].tobytes()
        keep[k] = key not in seen
        seen.add(key)
    if not keep.all():
        report.skip("duplicate polygon in its building", _names(draft, ~keep), area[~keep].sum())
    return _keep(draft, keep)


def _note_bent(draft, report):
    """Report polygons that are not planar; they are triangulated as drawn."""
    if not draft.polygons:
        return
    _, normal = measure_polygons(*draft.shape())
    polygon = np.repeat(np.arange(len(draft.polygons)), np.diff(draft.ring_start[draft.polygon_start]))
    first = draft.ring_start[draft.polygon_start[:-1]]
    height = np.einsum("ij,ij->i", draft.points - draft.points[first][polygon], normal[polygon])
    bent = np.maximum.reduceat(height, first) - np.minimum.reduceat(height, first) > BENT
    if bent.any():
        report.repair(f"bent by more than {100 * BENT:.0f} cm, triangulated as drawn", _names(draft, bent))


def _names(draft, mask):
    return [draft.names[i] for i in np.flatnonzero(mask)]


def _keep(draft, mask):
    if mask.all():
        return draft
    rings = np.diff(draft.polygon_start)
    ring_mask = np.repeat(mask, rings)
    point_mask = np.repeat(ring_mask, np.diff(draft.ring_start))
    kept = np.flatnonzero(mask)
    return Draft(
        polygons=[draft.polygons[i] for i in kept],
        buildings=draft.buildings,
        building=draft.building[mask],
        points=draft.points[point_mask],
        ring_start=starts_of(np.diff(draft.ring_start)[ring_mask]),
        polygon_start=starts_of(rings[mask]),
        names=[draft.names[i] for i in kept],
    )
