"""Repair polygons of a city, remove unusable and duplicate ones, and report them."""

from dataclasses import dataclass, replace

import numpy as np
import shapely

from .polygons import measure_polygons, measure_rings, plane_axes, polygon_bounds, starts_of, take_shape

SMALLEST_AREA = 1e-6  # [m²] a square millimetre; smaller polygons have no reliable normal
TWIN_SHARE = 0.95  # a solid is a duplicate if the boundary surfaces have at least this share of its area
SAME = 1e-4  # [m] corners closer than this are the same
BENT = 0.05  # [m] deviation from the mean plane, peak to peak, from which a polygon is reported
WITHIN = 0.999  # share of the given outline that must lie in its hole


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

    def names_of(self, mask):
        """Names of the polygons of a mask (n,): list of str."""
        return [self.names[i] for i in np.flatnonzero(mask)]

    def keep(self, mask):
        """The polygons of a mask (n,): Draft."""
        if mask.all():
            return self
        points, ring_start, polygon_start = take_shape(*self.shape(), mask)
        shape = {"points": points, "ring_start": ring_start, "polygon_start": polygon_start}
        polygons = [self.polygons[i] for i in np.flatnonzero(mask)]
        return replace(self, polygons=polygons, building=self.building[mask], names=self.names_of(mask), **shape)


def repair_polygons(draft, report):
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
    for step in (_drop_holes, _exchange_rings, _drop_degenerate, _drop_twins, _drop_doubles, _note_bent):
        draft = step(draft, report)
    return draft


def _drop_holes(draft, report):
    """Remove holes without area."""
    count, area = np.diff(draft.ring_start), np.linalg.norm(measure_rings(draft.points, draft.ring_start), axis=1)
    drop = (count < 3) | ~(area > SMALLEST_AREA)
    drop[draft.polygon_start[:-1]] = False
    polygon = np.repeat(np.arange(len(draft.polygons)), np.diff(draft.polygon_start))
    kept = np.bincount(polygon[~drop], minlength=len(draft.polygons))
    report.repair("hole without area removed", [draft.names[i] for i in np.unique(polygon[drop])])
    points, ring_start = draft.points[np.repeat(~drop, count)], starts_of(count[~drop])
    return replace(draft, points=points, ring_start=ring_start, polygon_start=starts_of(kept))


def _exchange_rings(draft, report):
    """Put the largest ring of a polygon first if the given outline lies within it.

    Some producers write a court as the outline of its house, and the house as the hole. The largest ring then is the
    outline, in its own direction, and the ring that stood first is a hole.
    """
    points, ring_start, polygon_start = draft.shape()
    vectors = measure_rings(points, ring_start)
    area = np.linalg.norm(vectors, axis=1)
    exchanged, order = np.zeros(len(draft.polygons), bool), np.arange(len(area))
    for polygon in np.flatnonzero(np.diff(polygon_start) > 1):
        first, last = polygon_start[polygon : polygon + 2]
        largest = first + int(np.argmax(area[first:last]))
        if largest == first or not area[first] > 0:
            continue
        # Both seen along the area vector of the largest.
        axes = np.concatenate(plane_axes(vectors[largest][None] / area[largest]))
        rings = [points[ring_start[ring] : ring_start[ring + 1]] for ring in (first, largest)]
        small, large = (shapely.make_valid(shapely.Polygon((ring - rings[1][0]) @ axes.T)) for ring in rings)
        if small.area > 0 and small.intersection(large).area >= WITHIN * small.area:
            order[[first, largest]] = largest, first
            exchanged[polygon] = True
    if not exchanged.any():
        return draft
    report.repair("outline and hole exchanged", draft.names_of(exchanged))
    pieces = [points[ring_start[ring] : ring_start[ring + 1]] for ring in order]
    return replace(draft, points=np.concatenate(pieces), ring_start=starts_of(list(map(len, pieces))))


def _drop_degenerate(draft, report):
    """Remove polygons without area."""
    area, _ = measure_polygons(*draft.shape())
    few = np.diff(draft.ring_start)[draft.polygon_start[:-1]] < 3
    flat = ~few & ~(area > SMALLEST_AREA)
    eaten = flat & (area < -SMALLEST_AREA)
    beside = "holes larger than their outline, beside it"
    for reason, mask in (("fewer than three points", few), ("no area", flat & ~eaten), (beside, eaten)):
        report.skip(reason, draft.names_of(mask), np.maximum(area[mask], 0.0).sum())
    return draft.keep(~(few | flat))


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
    reason = "second geometry of the same building (Solid beside its surfaces)"
    report.skip(reason, draft.names_of(~keep), area[~keep].sum())
    return draft.keep(keep)


def _drop_doubles(draft, report):
    """Remove a polygon that its building has already, with the same corners and facing the same side."""
    area, normal = measure_polygons(*draft.shape())
    middles = np.round(0.5 * sum(polygon_bounds(*draft.shape())) / SAME)
    size = np.diff(draft.ring_start[draft.polygon_start])
    rough = np.column_stack([draft.building, size, middles, np.round(area / SAME), np.round(normal / 0.01)])
    _, group, uses = np.unique(rough, axis=0, return_inverse=True, return_counts=True)
    seen, keep = set(), np.ones(len(size), bool)
    for k in np.flatnonzero(uses[group.reshape(-1)] > 1):
        corners = draft.points[draft.ring_start[draft.polygon_start[k]] : draft.ring_start[draft.polygon_start[k + 1]]]
        cells = np.round(corners / SAME).astype(np.int64)
        key = group.reshape(-1)[k], cells[np.lexsort(cells.T)].tobytes()
        keep[k] = key not in seen
        seen.add(key)
    report.skip("duplicate polygon in its building", draft.names_of(~keep), area[~keep].sum())
    return draft.keep(keep)


def _note_bent(draft, report):
    """Report polygons that are not planar; they are triangulated as drawn."""
    _, normal = measure_polygons(*draft.shape())
    polygon = np.repeat(np.arange(len(draft.polygons)), np.diff(draft.ring_start[draft.polygon_start]))
    first = draft.ring_start[draft.polygon_start[:-1]]
    height = np.einsum("ij,ij->i", draft.points - draft.points[first][polygon], normal[polygon])
    low, high = polygon_bounds(height, draft.ring_start, draft.polygon_start)
    bent = high - low > BENT
    report.repair(f"bent by more than {100 * BENT:.0f} cm, triangulated as drawn", draft.names_of(bent))
    return draft
