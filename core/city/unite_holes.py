"""Polygons whose holes repeat, overlap or reach beyond the outline: what is missing is their union
within it.
"""

from dataclasses import replace

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely.geometry.polygon import orient

from ..settings.tolerances import GEOMETRY
from .city import free_name, starts_of
from .polygons import measure_polygons, measure_rings, plane_axes


def unite_holes(city, report):
    """The city with holes that lie within their outlines and beside one another.

    A polygon that its holes cut into pieces becomes as many, with numbered identifiers. Others stay
    as drawn.

    Parameters
    ----------
    city : City
    report : ImportReport
        Extended by what was repaired.

    Returns
    -------
    City
    rows : array, (n,) int64
        Row of the given city that each polygon was.
    """
    # Polygons whose holes repeat, overlap or leave their outline, as united pieces.
    every = np.arange(len(city))
    wrong = {
        polygon: left for polygon in _find_doubtful(city) if len(left := _cut_holes(city, polygon))
    }
    # Without such polygons the city stays.
    if not wrong:
        return city, every
    reason = (
        "holes that repeat, overlap or reach beyond their outline: their union within it counts"
    )
    report.repair(reason, [city.surface_id[polygon] for polygon in wrong])
    # Each polygon as a list of rings, the mended ones as one or several of them.
    rings = np.split(city.points, city.ring_start[1:-1])
    starts = zip(city.polygon_start[:-1], city.polygon_start[1:], strict=True)
    drawn = [
        wrong.get(polygon) or [rings[first:last]] for polygon, (first, last) in enumerate(starts)
    ]
    rows = np.repeat(every, list(map(len, drawn)))
    drawn = [polygon for pieces in drawn for polygon in pieces]
    taken, lists = dict.fromkeys(city.surface_id, 1), city.take_lists(rows)
    # The first piece keeps the name, further ones get a number.
    for place in np.flatnonzero(np.diff(rows, prepend=-1) == 0):
        lists["surface_id"][place] = free_name(lists["surface_id"][place], taken)
    rings = [ring for polygon in drawn for ring in polygon]
    # All lists follow their polygons.
    return replace(
        city,
        points=np.concatenate(rings),
        ring_start=starts_of(list(map(len, rings))),
        polygon_start=starts_of(list(map(len, drawn))),
        **lists,
    ), rows


def _find_doubtful(city, *, doubtful_share=1e-3):
    """Polygons where more than a share of the area depends on how holes meet each other and the
    outline: list.
    """
    area = np.linalg.norm(measure_rings(city.points, city.ring_start), axis=1)
    first, holes = city.polygon_start[:-1], np.diff(city.polygon_start) - 1
    outline = area[first]
    largest = np.maximum.reduceat(area, first) if len(first) else outline
    # What has a hole larger than its outline tells nothing of what was meant.
    candidates = np.flatnonzero((holes > 0) & (outline > 0) & (largest <= outline))
    doubtful = []
    for polygon in candidates:
        outer, inner, _ = _project(city, polygon)
        within = shapely.area(shapely.intersection(inner, outer)).sum()
        united = (
            shapely.area(shapely.union_all(inner)) if len(inner) > 1 else shapely.area(inner).sum()
        )
        slack = doubtful_share * outline[polygon]
        if shapely.area(inner).sum() - min(within, united) > slack:
            doubtful.append(int(polygon))
    return doubtful


def _project(city, polygon):
    """Outline and holes (k,) of one polygon on its own plane, as valid shapes; and the way back:
    function of (k, 2).
    """
    rings = city.rings(polygon)
    _, normal = measure_polygons(rings[0], np.array([0, len(rings[0])]), np.array([0, 1]))
    axes, origin = np.concatenate(plane_axes(normal)), rings[0][0]
    corners = np.concatenate(rings)
    plane = (corners - origin) @ axes.T
    # Places on the plane, at the mean height of the corners above the first one.
    height = ((corners - origin) @ normal[0]).mean()
    pieces = np.split(plane, np.cumsum(list(map(len, rings)))[:-1])
    shapes = shapely.make_valid(
        np.array([shapely.Polygon(piece) for piece in pieces], dtype=object)
    )
    tree = cKDTree(plane)

    def lift(places):
        # Back in space, corners return to where they were; new points lie on the plane.
        distance, nearest = tree.query(places)
        lifted = origin + places @ axes + height * normal[0]
        return np.where((distance <= GEOMETRY.computed)[:, None], corners[nearest], lifted)

    return shapes[0], shapes[1:], lift


def _cut_holes(city, polygon):
    """What the holes leave of one polygon, but for the smallest pieces: list of lists of rings,
    (k, 3) float64.
    """
    outline, holes, lift = _project(city, polygon)
    left = shapely.get_parts(shapely.difference(outline, shapely.union_all(holes)))
    left = [piece for piece in left if piece.geom_type == "Polygon" and piece.area > GEOMETRY.area]
    left = [orient(piece) for piece in sorted(left, key=lambda piece: -piece.area)]
    return [
        [lift(np.asarray(ring.coords)[:-1]) for ring in (piece.exterior, *piece.interiors)]
        for piece in left
    ]
