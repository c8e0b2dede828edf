"""Generate the ground of a city without terrain: a TIN through the base edges ("feet") of its buildings."""

from functools import partial

import numpy as np
import shapely

from ..city.check_geometry import check_parts, check_patch_size
from ..settings.progress import ignore_share, report_part
from .find_feet import FOOTPRINT_STEP, find_feet
from .foot_lines import draw_lines, highest_foot
from .ground_points import spread_points
from .heights_on import heights_on
from .in_polygons import draw_triangles, find_inside, join_polygons
from .keep_edges import find_cut_edges
from .merge_places import COINCIDENT, merge_places, unique_pairs
from .triangle_sides import find_neighbours, sort_sides
from .triangulate_feet import triangulate_feet
from .triangulate_plan import triangulate_plan
from .walk_plan import triangle_at, walk

DEFAULT_PATCH = 10.0  # [m]
FEET_FOUND, SPREAD, TRIANGULATED = 0.28, 0.45, 0.8  # shares of the time that are over then
REACH = 3.0  # [building heights] least extent of the ground beyond the city's edge
REACH_WHITE = 8.0  # [building heights] the same where the ground absorbs nothing
SHORTEST_REACH = 30.0  # [m]
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
    lines = draw_lines(feet)
    foot_points, edges = cut_feet(feet, lines, 0.5 * patch_size)
    report_share(FEET_FOUND)
    corners = low[:2] - reach, high[:2] + reach
    free, nearest = spread_points(foot_points[:, :2], feet.footprints, *corners, patch_size)
    free, cut = _interpolate_heights(foot_points, edges, (free, nearest), corners)
    report_share(SPREAD)
    triangulate_part = partial(report_part, report_share, SPREAD, TRIANGULATED)
    vertices, triangles = triangulate_feet(lines, foot_points, (edges, cut), free, triangulate_part)
    triangles = faces_up(vertices, triangles)
    report_share(TRIANGULATED)
    between = np.flatnonzero((triangles < len(vertices) - len(free)).all(axis=1))  # free places are outside
    triangles = np.delete(triangles, between[under_buildings(vertices, triangles[between], feet.footprints)], axis=0)
    used = np.zeros(len(vertices), bool)
    used[triangles] = True
    return vertices[used], (np.cumsum(used) - 1)[triangles], feet.hanging


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


def cut_feet(feet, lines, longest):
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
    points = pieces.reshape(-1, 3)
    lowest, index = merge_places(points)
    places = points[lowest]
    places[:, 2] = highest_foot(lines, places)
    edges = np.sort(index.reshape(-1, 2), axis=1)
    return places, unique_pairs(edges[edges[:, 0] != edges[:, 1]])


def _interpolate_heights(foot_points, edges, free, corners):
    """Free places with heights between those of the feet, and out to a rim at about their mean height; and whether each
    edge is missing in the triangulation of all."""
    (free, nearest), (low, high) = free, corners
    angle = 2 * np.pi * np.arange(CONTROL_COUNT) / CONTROL_COUNT
    rim = 0.5 * (low + high) + np.hypot(*(high - low)) * np.column_stack([np.cos(angle), np.sin(angle)])
    x, y, height = foot_points.T.copy()
    weights = (1 / ((east - x) ** 2 + (north - y) ** 2) for east, north in rim)
    rim_height = [(weight * height).sum() / weight.sum() for weight in weights]
    known = np.concatenate([foot_points, np.column_stack([rim, rim_height])])
    triangles = triangulate_plan(known[:, :2])
    sides = sort_sides(triangles)
    near = triangle_at(triangles, len(known))[nearest]
    found = walk(known[:, :2], (triangles, find_neighbours(sides)), free, near)
    cut = find_cut_edges(known[:, :2], (triangles, sides), edges, free)
    return np.column_stack([free, heights_on(known[triangles[found]], free)]), cut


def under_buildings(vertices, triangles, footprints):
    """Triangles completely under buildings, where footprints replace the ground."""
    if not len(footprints):
        return np.zeros(len(triangles), bool)
    # Blocks are widened one by one: all of them together would take four times as long.
    blocks = shapely.buffer(shapely.get_parts(join_polygons(footprints)), COINCIDENT, quad_segs=4)
    blocks = shapely.get_parts(join_polygons(blocks))
    corners = vertices[:, :2].copy()[triangles]
    triangle, block = find_inside(blocks, (corners[:, 0] + corners[:, 1] + corners[:, 2]) / 3)
    under = np.zeros(len(triangles), bool)
    under[triangle[shapely.contains(blocks[block], draw_triangles(corners[triangle]))]] = True
    return under


def faces_up(vertices, triangles):
    """Triangles oriented upwards, without those that have no area in plan view."""
    a, b, c = triangles.T
    x, y = vertices[:, 0].copy(), vertices[:, 1].copy()
    along, across = (x[b] - x[a], y[b] - y[a]), (x[c] - x[a], y[c] - y[a])
    doubled = along[0] * across[1] - along[1] * across[0]
    longest = np.maximum(along[0] ** 2 + along[1] ** 2, across[0] ** 2 + across[1] ** 2)
    triangles = np.where(doubled[:, None] < 0, triangles[:, ::-1], triangles)
    return triangles[np.abs(doubled) > 1e-6 * longest]
