"""Find the feet of buildings: edges along which footprints and walls meet the ground.

Things that float, such as slabs, canopies and billboards, tell nothing about it by their lower
edges.
"""

from dataclasses import dataclass

import numpy as np
import shapely

from ..settings.tolerances import GEOMETRY
from .city import number_names
from .plan_geometry import draw_outlines, find_in_boxes, plant_tree
from .polygons import next_in_ring, polygon_bounds
from .slope_filter import find_standing


@dataclass
class _Feet:
    """Edges along which a city meets the ground."""

    start: np.ndarray  # (e, 3) float64 [m]
    end: np.ndarray  # (e, 3) float64 [m]
    step: np.ndarray  # (e,) float64 [m] largest height above a neighbouring foot
    footprints: np.ndarray  # (f,) shapely polygons in plan view, those on the ground
    hanging: np.ndarray  # (h,) int64 footprints above the ground
    polygon: np.ndarray  # (e,) int64 the footprint or wall that each edge belongs to, -1 if none
    on_footprint: np.ndarray  # (e,) bool: edge of a footprint, else the lower edge of a wall
    outward: np.ndarray  # (e, 2) float64 away from the building, of any length


def find_feet(city, points, surfaces, footprint, ground_height=None):
    """Edges of footprints and lower edges of walls that meet the ground.

    Slabs, canopies and boards that hang in the air are told by what lies below or beside them: no
    thing stands on an embankment higher than itself.

    Parameters
    ----------
    city : City
    points : array, (m, 3) float64 [m]
        Of the city, z up.
    surfaces : Surfaces
    footprint : array, (n,) bool
    ground_height : callable, optional
        Of ground that is known before any is laid, as of `_find_floating`.

    Returns
    -------
    Feet
        The edges that stand on the ground, each with its polygon, its largest rise and its
        direction outwards, and the footprints that have one; footprints that have none are told as
        hanging.
    """
    # Edges of all rings, with the polygon that each belongs to, and footprints in plan.
    polygon_of_ring = np.repeat(np.arange(len(city)), np.diff(city.polygon_start))
    polygon_of_point = np.repeat(polygon_of_ring, np.diff(city.ring_start))
    start, end = points, points[next_in_ring(city.ring_start)]
    in_plan = (
        np.zeros((int(footprint.sum()), 3)),
        np.tile(np.eye(3)[:2], (int(footprint.sum()), 1, 1)),
    )
    shapes = draw_outlines(
        (points, city.ring_start, city.polygon_start), np.flatnonzero(footprint), *in_plan
    )
    on_footprint = footprint[polygon_of_point]
    # Lower edges of walls run so that the normal x their direction points up.
    steep = (np.abs(surfaces.surface_tilt - 90) < 10) & (
        np.array(surfaces.thematic) != "ClosureSurface"
    )
    (x, y, _), (u, v, _) = surfaces.normal[polygon_of_point].T, (end - start).T
    bare = (
        steep[polygon_of_point]
        & (x * v - y * u > 0.7 * np.linalg.norm(end - start, axis=1))
        & ~on_footprint
    )
    # Candidates are edges of footprints and lower edges of walls, but none that stands on a
    # building: above the footprint of another.
    low, _ = polygon_bounds(points[:, 2], city.ring_start, city.polygon_start)
    edge = np.flatnonzero(on_footprint | bare)
    middle = 0.5 * (start[edge] + end[edge])
    own = np.where(on_footprint[edge], polygon_of_point[edge], -1)
    edge = edge[~_above_another(shapes, low, np.flatnonzero(footprint), middle, own)]
    # Objects that float above ground that is known are left out by themselves.
    building_of = number_names(city.building_id)
    building = building_of[polygon_of_point]
    height, thin = _measure_objects(building, points)
    if ground_height is not None:
        middle = 0.5 * (start[edge] + end[edge])
        edge = edge[~_find_floating(building[edge], middle, (height, thin), ground_height)]
    # How far each edge may rise above its neighbours' feet: most for the lowest footprints of a
    # building, least for bare walls, no more than the object is high.
    lowest = np.full(building_of.max(initial=-1) + 1, np.inf)
    np.minimum.at(lowest, building_of[footprint], low[footprint])
    # Footprints up to 1.5 m above a building's lowest one count as lowest, too, but not floors that
    # hang between walls of other buildings.
    may_stand_high = low <= lowest[building_of] + 1.5
    lines, top = (
        shapely.linestrings(np.stack([start[edge, :2], end[edge, :2]], axis=1)),
        np.zeros(len(lowest)),
    )
    np.maximum.at(top, building, points[:, 2])
    lines = lines, np.maximum(start[edge, 2], end[edge, 2]), building[edge]
    rows = np.flatnonzero(footprint)
    may_stand_high[rows[_hang_between_walls(shapes, low[rows], building_of[rows], lines, top)]] = (
        False
    )
    # The step: how far an edge may rise above a foot right beside it. It is a storey, or 6 m for
    # the lowest footprints of a building, as on an embankment, but no more than the object is high;
    # of a wall without a footprint it is `GEOMETRY.step`.
    step = np.where(may_stand_high, 6.0, GEOMETRY.storey)[polygon_of_point[edge]]
    step = np.minimum(step, np.maximum(height[building[edge]], GEOMETRY.step))
    step[~on_footprint[edge]] = GEOMETRY.step
    # The slope: how much further it may rise per metre to that foot, as ground rises by 0.5 at
    # most; a thin object is no sign of ground steeper than 0.1.
    slope = np.where(thin[building[edge]], 0.1, 0.5)
    # An edge stands if neither end rises above another foot by more than the step plus slope times
    # distance; footprints without any such edge hang.
    stands = find_standing(start[edge], end[edge], step, slope)
    edge, step = edge[stands], step[stands]
    standing = np.isin(np.flatnonzero(footprint), polygon_of_point[edge])
    hanging = np.flatnonzero(footprint)[~standing]
    # Outwards in plan, from the normal of a wall or the turn of a footprint's edge.
    polygon = polygon_of_point[edge]
    along, normal = (end - start)[edge], surfaces.normal[polygon]
    # The inside of a footprint is to the left of its edges, seen from its front.
    aside = np.sign(normal[:, 2:]) * np.column_stack([along[:, 1], -along[:, 0]])
    outward = np.where(footprint[polygon, None], aside, normal[:, :2])
    return _Feet(
        start[edge],
        end[edge],
        step,
        shapes[standing],
        hanging,
        polygon,
        footprint[polygon],
        outward,
    )


def _hang_between_walls(shapes, low, building, lines, top):
    """Floors that hang between walls of other buildings with nothing below: (f,) bool.

    Walls carry a floor where they run along its outline, from more than a storey below it to
    above it. It hangs between them where most of it lies between the places where they do: a
    bridge, not a house at the edge of a terrace.

    Parameters
    ----------
    shapes : (f,) shapely polygons
        The floors in plan.
    low, building : (f,) float64 [m] and (f,) int
        Height, and the building of each.
    lines : tuple of (e,) shapely lines, (e,) float64 [m] and (e,) int
        Feet of all buildings in plan, their heights, and the building of each.
    top : (b,) float64 [m]
        Highest point of each building.
    """
    hangs, (feet, height, owner) = np.zeros(len(shapes), bool), lines
    if not len(shapes) or not len(feet):
        return hangs
    around = shapely.bounds(shapes) + GEOMETRY.cladding * np.array([-1, -1, 1, 1])
    floor, foot = shapely.STRtree(feet).query(shapely.box(*around.T))
    # Walls of other buildings that carry a floor: from well below it to above it.
    carries = (owner[foot] != building[floor]) & (height[foot] < low[floor] - GEOMETRY.storey)
    carries &= top[owner[foot]] > low[floor]
    for row in np.unique(floor[carries]):
        # What runs along the outline, and what lies between: the part of the floor in the hull of
        # these walls.
        outline = shapely.buffer(shapely.boundary(shapes[row]), GEOMETRY.cladding)
        along = shapely.intersection(
            shapely.union_all(feet[foot[carries & (floor == row)]]), outline
        )
        between = shapely.intersection(shapely.convex_hull(along), shapes[row])
        hangs[row] = shapely.area(between) > shapely.area(shapes[row]) / 2
    return hangs


def _above_another(shapes, low, footprints, middles, own):
    """Edges above another, lower footprint: they stand on a building."""
    above = np.zeros(len(middles), bool)
    if not len(shapes) or not len(middles):
        return above
    # The middle of the edge lies in plan over another footprint, which is lower by more than a
    # step.
    edge, shape = find_in_boxes(plant_tree(middles), shapely.bounds(shapes))
    other = footprints[shape]
    higher = (other != own[edge]) & (middles[edge, 2] > low[other] + GEOMETRY.step)
    edge, (shape, each) = edge[higher], np.unique(shape[higher], return_inverse=True)
    smaller = shapely.buffer(shapes[shape], -GEOMETRY.cladding)
    shapely.prepare(smaller)
    above[edge[shapely.intersects_xy(smaller[each], *middles[edge, :2].T)]] = True
    return above


def _measure_objects(building, points):
    """Height of each building, and whether it is thin.

    Parameters
    ----------
    building : (m,) int
        Of each point, 0 to b - 1, each at least once.
    points : (m, 3) float64 [m]
        z up.

    Returns
    -------
    height : (b,) float64 [m]
    thin : (b,) bool
        Its height, or its width seen from above, is less than THIN.
    """
    order = np.argsort(building, kind="stable")
    first, heights = np.flatnonzero(np.diff(building[order], prepend=-1)), points[order, 2]
    height = np.maximum.reduceat(heights, first) - np.minimum.reduceat(heights, first)
    around = shapely.oriented_envelope(
        shapely.multipoints(points[order, :2], indices=building[order])
    )
    # The shorter side of a rectangle, which may be a line or a point, from half its outline and its
    # area.
    half = 0.5 * shapely.length(around)
    width = 0.5 * (half - np.sqrt(np.maximum(half**2 - 4 * shapely.area(around), 0.0)))
    # What is thinner than 1 m, lying or upright, is no building.
    return height, np.minimum(height, width) < 1.0


def _find_floating(building, middles, objects, ground_height):
    """Lower edges of buildings that hang in the air as a whole above ground that is known.

    A building floats where none of its lower edges comes nearer to the ground than its own height
    or a storey, whichever is less: no building stands on an embankment higher than itself.

    Parameters
    ----------
    building : (e,) int
        Of each edge.
    middles : (e, 3) float64 [m]
        Of the edges.
    objects : tuple of (b,) float64 [m] and (b,) bool
        Of `_measure_objects`.
    ground_height : callable
        Takes places, (e, 3) float64 [m], and whether each belongs to a thin thing, (e,) bool, to
        heights of what lies below, (e,) float64 [m]: the ground, or for a thin thing anything that
        faces up; NaN where nothing is known.

    Returns
    -------
    (e,) bool
    """
    height, thin = objects
    rise = middles[:, 2] - ground_height(middles, thin[building])
    least = np.full(len(height), np.inf)
    np.fmin.at(least, building, np.where(np.isnan(rise), np.inf, rise))
    known = np.isfinite(least)
    # Where half of the buildings stand more than 3 m above the ground, its zero level is another.
    if (known & ~thin).any() and np.median(least[known & ~thin]) > 3.0:
        known &= thin
    # A building floats if it stands nowhere lower than a storey of 2.5 m, or its own height, above
    # the ground; lower than 0.5 m nothing floats.
    floats = known & (least > np.maximum(np.minimum(height, GEOMETRY.storey), GEOMETRY.step))
    return floats[building]
