"""Generate the ground of a city without terrain: a TIN through the base edges ("feet") of its buildings."""

from functools import partial

import numpy as np
import shapely

from ..city.check_geometry import check_parts, check_patch_size
from ..progress import ignore_share, report_part
from .find_feet import COINCIDENT, FOOTPRINT_STEP, find_feet
from .ground_points import spread_points
from .triangulate_plan import add_places, find_triangle, has_edges, near_any, triangulate_plan

DEFAULT_PATCH = 10.0  # [m]
FEET_FOUND, SPREAD, TRIANGULATED = 0.35, 0.45, 0.85  # shares of the time that are over then
REACH = 3.0  # [building heights] least extent of the ground beyond the city's edge
REACH_WHITE = 8.0  # [building heights] the same where the ground absorbs nothing
SHORTEST_REACH = 30.0  # [m]
ROUNDS = 6  # of halving foot edges that are missing in the triangulation
SHORTEST_EDGE = 0.5  # [m]
HANG = 0.005  # [m] foot edges further above the ground are refined
ABREAST = 0.25  # [m] feet closer together than this get the height of the higher one
CONTROL_COUNT = 32  # points on the rim; their heights are weighted means of the feet's heights


def choose_reach(ground_albedo):
    """Extent of the generated ground beyond the city for which its edge costs less than 0.1 % of the light.

    Ground further away is taken as unshaded. At its edge, r building heights away, a row of buildings hides
    (1 - cos β)/2 ≈ 1/(4 r²) of its sky, with tan β = 1/r, and the light that it passes on grows with its albedo: the
    same error needs a reach in proportion to the root of the albedo.

    Returns
    -------
    float
        [building heights]
    """
    return max(REACH, REACH_WHITE * ground_albedo**0.5)


def build_ground(
    city,
    points,
    surfaces,
    footprint,
    patch_size=None,
    *,
    ground_height=None,
    reach=REACH,
    report_share=ignore_share,
):
    """TIN that meets the foot of every wall, with courtyards and passages, coarser with distance.

    Foot edges are split into pieces of at most half a patch, and again where they are missing in the triangulation, so
    that no gap opens below a wall between two ground points. Where feet of different height meet, the ground takes the
    higher one: it covers a strip of the lower wall rather than leave a gap below the other. Footprints replace the
    ground below buildings; courtyards, and the ground below overhanging footprints, are kept.

    Parameters
    ----------
    city : City
    points : array, (m, 3) float64 [m]
        Of the city, z up, local origin.
    surfaces : Surfaces
    footprint : array, (n,) bool
    patch_size : float, optional
        [m] Distance of ground points near the buildings.
    ground_height : callable, optional
        As of `find_feet`.
    reach : float
        Extent beyond the city [building heights], of `choose_reach`.
    report_share : callable, optional
        As of `build_scene`, of the ground.

    Returns
    -------
    vertices : array, (v, 3) float64 [m]
    triangles : array, (t, 3) int64
        Oriented upwards.
    hanging : array, (h,) int64
        Footprints above the ground: passages, bridges, towers on other buildings.

    Raises
    ------
    InputError
        An array or the patch size is invalid.
    """
    check_patch_size(patch_size)
    check_parts(city, points, surfaces, footprint)
    patch_size = patch_size or DEFAULT_PATCH
    feet = feet_or_corners(city, points, surfaces, footprint, ground_height)
    low, high = points.min(axis=0), points.max(axis=0)
    reach = max(reach * (high[2] - np.median(feet.start[:, 2])), SHORTEST_REACH)
    foot_points, edges = cut_feet(feet, 0.5 * patch_size)
    report_share(FEET_FOUND)
    free = spread_points(foot_points[:, :2], feet.footprints, low[:2] - reach, high[:2] + reach, patch_size)
    free = _interpolate_heights(foot_points, free, low[:2] - reach, high[:2] + reach)
    report_share(SPREAD)
    triangulate_part = partial(report_part, report_share, SPREAD, TRIANGULATED)
    vertices, triangles = _triangulate(feet, foot_points, edges, free, triangulate_part)
    report_share(TRIANGULATED)
    between = np.flatnonzero((triangles < len(vertices) - len(free)).all(axis=1))  # free places are outside
    triangles = np.delete(triangles, between[under_buildings(vertices, triangles[between], feet.footprints)], axis=0)
    used, corners = np.unique(triangles, return_inverse=True)
    return vertices[used], corners.reshape(-1, 3), feet.hanging


def feet_or_corners(city, points, surfaces, footprint, ground_height=None):
    """Feet of a city; if nothing stands on the ground, the edges of its bounding rectangle."""
    feet = find_feet(city, points, surfaces, footprint, ground_height)
    if not len(feet.start):
        low, high = points.min(axis=0), points.max(axis=0)
        corners = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
        feet.start = np.column_stack([corners, np.full(4, low[2])])
        feet.end, feet.step = np.roll(feet.start, -1, axis=0), np.full(4, FOOTPRINT_STEP)
        feet.polygon, feet.on_footprint, feet.outward = np.full(4, -1), np.zeros(4, bool), np.zeros((4, 2))
    return feet


def cut_feet(feet, longest):
    """Points along the feet, without duplicates in plan view, and the edges between them."""
    length = np.linalg.norm((feet.end - feet.start)[:, :2], axis=1)
    edges_kept = length > COINCIDENT
    start, end, length = feet.start[edges_kept], feet.end[edges_kept], length[edges_kept]
    count = np.maximum(np.ceil(length / longest), 1).astype(np.int64)
    edge = np.repeat(np.arange(len(start)), count)
    step = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    share = (step / count[edge])[:, None]
    following = ((step + 1) / count[edge])[:, None]
    span = end - start
    pieces = np.stack([start[edge] + share * span[edge], start[edge] + following * span[edge]], axis=1)  # (p, 2, 3)
    places, index = _merge_places(pieces.reshape(-1, 3))
    places[:, 2] = _highest_foot(feet, places)
    edges = np.sort(index.reshape(-1, 2), axis=1)
    return places, np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0)


def _merge_places(points):
    """Lowest point at each distinct plan position, and the position index of each point."""
    _, place = np.unique(np.round(points[:, :2] / COINCIDENT).astype(np.int64), axis=0, return_inverse=True)
    place = place.reshape(-1)
    order = np.lexsort([points[:, 2], place])
    first = np.unique(place[order], return_index=True)[1]
    return points[order[first]], place


def _highest_foot(feet, places):
    """Height [m] of the highest foot edge at each position, leaving out edges too far above the lowest."""
    lines = shapely.linestrings(np.stack([feet.start[:, :2], feet.end[:, :2]], axis=1))
    edge, place = shapely.STRtree(shapely.points(places[:, :2])).query(lines, "dwithin", distance=ABREAST)
    span = feet.end[edge] - feet.start[edge]
    squared = np.maximum((span[:, :2] ** 2).sum(axis=1), 1e-12)
    share = ((places[place, :2] - feet.start[edge, :2]) * span[:, :2]).sum(axis=1) / squared
    height = feet.start[edge, 2] + np.clip(share, 0, 1) * span[:, 2]
    near = height <= places[place, 2] + feet.step[edge]
    highest = places[:, 2].copy()
    np.maximum.at(highest, place[near], height[near])
    return highest


def _interpolate_heights(foot_points, free, low, high):
    """Free places with heights between those of the feet, and out to a rim at about their mean height."""
    angle = 2 * np.pi * np.arange(CONTROL_COUNT) / CONTROL_COUNT
    rim = 0.5 * (low + high) + np.hypot(*(high - low)) * np.column_stack([np.cos(angle), np.sin(angle)])
    squared = ((rim[:, None] - foot_points[None, :, :2]) ** 2).sum(axis=2)
    weight = 1 / squared
    rim_height = (weight * foot_points[:, 2]).sum(axis=1) / weight.sum(axis=1)
    known = np.concatenate([foot_points, np.column_stack([rim, rim_height])])
    corners = known[triangulate_plan(known[:, :2])]
    return np.column_stack([free, heights_on(corners[find_triangle(corners[..., :2], free)], free)])


def _triangulate(feet, foot_points, edges, free, report_share):
    """Delaunay TIN of all points; missing foot edges are halved, in later rounds only those above the ground."""
    vertices, kept, new = np.concatenate([foot_points, free]), 0, np.zeros(0, np.int64)
    triangles = triangulate_plan(vertices[:, :2])
    for turn in range(ROUNDS - 1):
        report_share((turn + 1) / ROUNDS)
        missing = edges[~has_edges(triangles, edges)]
        ends = foot_points[missing]
        missing = missing[np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1) > SHORTEST_EDGE]
        if turn == 1:
            missing = missing[_hang(vertices[triangles], foot_points[missing])]
        if turn > 1:  # the others lie on the ground where it has not changed
            hang, added = _hang(vertices[triangles[kept:]], foot_points[missing]), np.isin(missing, new).any(axis=1)
            hang[added] |= _hang(vertices[triangles], foot_points[missing[added]])
            missing = missing[hang]
        if not len(missing):
            break
        foot_points, edges, index = _halve(feet, foot_points, edges, missing)
        old = np.concatenate([index, len(foot_points) + np.arange(len(free))])
        before, vertices = vertices, np.concatenate([foot_points, free])
        new = np.setdiff1d(np.arange(len(vertices)), old)
        if (before[:, :2] == vertices[old, :2]).all():
            triangles, kept = add_places(vertices[:, :2], old[triangles], new)
        else:  # a middle lies beside an older point
            triangles, kept = triangulate_plan(vertices[:, :2]), 0
    return vertices, faces_up(vertices, triangles)


def _hang(corners, ends):
    """Edges, given by their ends (k, 2, 3), that are above the ground at 1/4, 1/2 or 3/4 of their length."""
    if not len(ends):
        return np.zeros(0, bool)
    shares = np.array([0.25, 0.5, 0.75])[:, None, None]
    places = ((1 - shares) * ends[:, 0] + shares * ends[:, 1]).reshape(-1, 3)
    return (places[:, 2] - drop_on_triangles(corners, places) > HANG).reshape(3, -1).any(axis=0)


def drop_on_triangles(corners, places):
    """Height [m] of the lowest triangle at each plan position; infinite where there is none.

    Parameters
    ----------
    corners : array, (t, 3, 3) float64 [m]
    places : array, (k, 2) or (k, 3) float64 [m]
    """
    near = np.flatnonzero(near_any(corners[:, :, :2], places[:, :2]))  # few, where there are few places
    tree = shapely.STRtree(shapely.polygons(corners[near, :, :2]))
    place, triangle = tree.query(shapely.points(places[:, :2]), predicate="intersects")
    height = np.full(len(places), np.inf)
    np.fmin.at(height, place, heights_on(corners[near[triangle]], places[place]))
    return height


def heights_on(corners, places):
    """Height of each place's triangle there: (k,) float64 [m]; NaN where it has no area in plan view."""
    a, b, c = (corners[:, k] for k in range(3))
    normal = np.cross(b - a, c - a)
    sloped = ((places[:, :2] - a[:, :2]) * normal[:, :2]).sum(axis=1)
    steep = np.abs(normal[:, 2]) < 1e-9
    rise = np.divide(sloped, normal[:, 2], out=np.full(len(places), np.nan), where=~steep)
    return a[:, 2] - rise


def under_buildings(vertices, triangles, footprints):
    """Triangles completely under buildings, where footprints replace the ground."""
    if not len(footprints):
        return np.zeros(len(triangles), bool)
    blocks = shapely.get_parts(shapely.buffer(shapely.union_all(footprints), COINCIDENT))
    shapely.prepare(blocks)
    corners = vertices[triangles][:, [0, 1, 2, 0], :2]
    middles = shapely.points(corners[:, :3].mean(axis=1))
    triangle, block = shapely.STRtree(blocks).query(middles, predicate="intersects")
    under = np.zeros(len(triangles), bool)
    under[triangle] = shapely.contains(blocks[block], shapely.polygons(corners[triangle]))
    return under


def _halve(feet, foot_points, edges, missing):
    """Points with the middles of some edges, edges between them, and the index of each earlier point."""
    middles = foot_points[missing].mean(axis=1)
    places, index = _merge_places(np.concatenate([foot_points, middles]))
    new = np.concatenate([index[edges], np.column_stack([index[missing[:, 0]], index[len(foot_points) :]])])
    new = np.concatenate([new, np.column_stack([index[len(foot_points) :], index[missing[:, 1]]])])
    fresh = np.ones(len(places), bool)
    fresh[index[: len(foot_points)]] = (places[index[: len(foot_points)]] != foot_points).any(axis=1)
    places[fresh, 2] = _highest_foot(feet, places[fresh])
    new = np.sort(new, axis=1)
    gone = np.sort(index[missing], axis=1)
    keys, gone_keys = (pair[:, 0] * np.int64(len(places)) + pair[:, 1] for pair in (new, gone))
    new = new[~np.isin(keys, gone_keys)]
    return places, np.unique(new[new[:, 0] != new[:, 1]], axis=0), index[: len(foot_points)]


def faces_up(vertices, triangles):
    """Triangles oriented upwards, without those that have no area in plan view."""
    a, b, c = (vertices[triangles[:, k], :2] for k in range(3))
    doubled = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    triangles = np.where(doubled[:, None] < 0, triangles[:, ::-1], triangles)
    longest = np.maximum(((b - a) ** 2).sum(axis=1), ((c - a) ** 2).sum(axis=1))
    return triangles[np.abs(doubled) > 1e-6 * longest]
