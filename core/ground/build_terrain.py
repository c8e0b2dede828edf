"""Ground from measured terrain: fine at the buildings, coarse at the horizon, watertight, with walls joined to it."""

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import Delaunay, cKDTree

from ..city.check_geometry import check_patch_size, check_terrain
from ..settings.errors import InputError, check_array
from .build_ground import DEFAULT_PATCH, REACH, SHORTEST_REACH, cut_feet, faces_up, under_buildings
from .foot_lines import draw_lines
from .ground_points import spread_points
from .heights_on import drop_on_triangles
from .terrain import HORIZON, NEAR, measure_heights, nearest_heights

TOLERANCE, SLACK = 0.15, 0.01  # [m], [m/m] largest height error of the ground, and its growth with distance
ROUNDS = 8  # of adding points where the error is larger
MOST_POINTS = 60_000
JOINED = 0.01  # [m] a foot this close to the ground counts as on it
SUNK = 0.05  # [m] walls extended downwards end that far below the ground
SUSPICIOUS = 3.0  # [m] a larger offset between feet and terrain suggests another vertical datum
BELOW = 10.0  # [m] depth of the bottom below the lowest point of ground and city


@dataclass
class Ground:
    """Triangles of the ground and of the wall extensions that join the buildings to it."""

    vertices: np.ndarray  # (v, 3) float64 [m]
    triangles: np.ndarray  # (t, 3) int64: ground, upward; wall extensions; sides and bottom
    hidden: np.ndarray  # (t,) bool: sides and bottom, which receive no light
    hanging: np.ndarray  # (h,) int64 footprints above the ground
    raised: np.ndarray  # (r,) int64 surfaces that end above the terrain: extended downwards
    below_ground: np.ndarray  # (b,) int64 surfaces that end below the terrain: cut by it
    notes: list  # sentences for the report


def build_terrain(feet, points, terrain, patch_size=None, reach=REACH):
    """Ground from terrain heights, with every wall joined to it.

    Parameters
    ----------
    feet : Feet
    points : array, (m, 3) float64 [m]
        Of the city, z up, local origin.
    terrain : Terrain
        In the coordinate frame of the points.
    patch_size : float, optional
        [m] Distance of ground points near the buildings.
    reach : float
        Extent beyond the city [building heights], of `choose_reach`.

    Returns
    -------
    Ground

    Raises
    ------
    InputError
        The terrain is invalid, or has no height under any building.
    """
    check_patch_size(patch_size)
    check_terrain(terrain)
    check_array("points", points, ("m", 3), row="point")
    check_array("start of the feet", feet.start, ("e", 3))
    check_array("end of the feet", feet.end, (len(feet.start), 3))
    patch_size = patch_size or DEFAULT_PATCH
    low, high = points.min(axis=0), points.max(axis=0)
    reach = max(reach * (high[2] - np.median(feet.start[:, 2])), SHORTEST_REACH)
    foot_points, _ = cut_feet(feet, draw_lines(feet), 0.5 * patch_size)
    places, heights, notes = _spread(foot_points, feet, terrain, (low, high, reach), patch_size)
    vertices, triangles = _refine(np.column_stack([places, heights]), terrain, foot_points[:, :2])
    triangles = faces_up(vertices, triangles.astype(np.int64))
    skirts, raised, below_ground, words = _join(feet, vertices[triangles], 0.5 * patch_size)
    body, body_triangles = _close(vertices, min(low[2], vertices[:, 2].min()) - BELOW)
    triangles = triangles[~under_buildings(vertices, triangles, feet.footprints)]
    pieces = [(vertices, triangles), skirts, (body, body_triangles)]
    starts = np.cumsum([0, *[len(piece[0]) for piece in pieces]])
    joined = np.concatenate([piece[1] + first for piece, first in zip(pieces, starts[:-1], strict=True)])
    hidden = np.arange(len(joined)) >= len(joined) - len(body_triangles)
    used, corners = np.unique(joined, return_inverse=True)
    whole = np.concatenate([piece[0] for piece in pieces])[used]
    return Ground(
        whole, corners.reshape(-1, 3), hidden, feet.hanging, raised, below_ground, [*terrain.notes, *notes, *words]
    )


def _spread(foot_points, feet, terrain, bounds, patch_size):
    """Ground points with heights; gaps are interpolated, with a note."""
    foot_places = foot_points[:, :2]
    low, high, reach = bounds
    found = np.concatenate([layer.points for layer in terrain.layers])
    near = low[:2] - reach, high[:2] + reach
    far_low = np.minimum(near[0], np.maximum(found.min(axis=0)[:2], low[:2] - HORIZON))
    far_high = np.maximum(near[1], np.minimum(found.max(axis=0)[:2], high[:2] + HORIZON))
    free, _ = spread_points(foot_places, feet.footprints, far_low, far_high, patch_size)
    places = np.concatenate([foot_places, free])
    heights = measure_heights(terrain, places)
    at_feet = np.arange(len(places)) < len(foot_places)
    rest = np.flatnonzero(np.isnan(heights) & at_feet)
    heights[rest] = nearest_heights(terrain, places[rest], JOINED)  # the same place but for rounding
    gap = np.isnan(heights)
    heights[gap & at_feet] = nearest_heights(terrain, places[gap & at_feet], NEAR)
    if np.isnan(heights[at_feet]).all():
        problem = "has no height under any building"
        raise InputError(terrain.source, problem, "give terrain that covers the city, in its system and unit")
    inside = ((places >= near[0]) & (places <= near[1])).all(axis=1)
    rim = np.arange(len(places)) >= len(places) - 32  # spread_points ends with them
    keep = ~gap | inside | rim
    notes = []
    if (gap & inside & ~rim).any():
        count, feet_in = int((gap & inside & ~rim).sum()), int(gap[: len(foot_places)].sum())
        share = count / max(int((inside & ~rim).sum()), 1)
        notes.append(
            f"The terrain has gaps: {100 * share:.1f} % of the ground points near the buildings, {feet_in:,} of them "
            "at walls; heights there are interpolated, or those of the nearest point."
        )
    open_feet = np.flatnonzero(np.isnan(heights[at_feet]))
    heights[open_feet], beyond = _follow_feet(places, heights, foot_points, open_feet)
    if beyond:
        notes.append(f"{beyond:,} ground points at walls are beyond the terrain: they follow the buildings' feet.")
    gap = np.isnan(heights)
    heights[gap] = _bridge(places[~gap], heights[~gap], places[gap])
    return places[keep], heights[keep], notes


def _follow_feet(places, heights, foot_points, chosen):
    """Heights of feet in gaps: linear between what is around; beyond that the feet's own, less the median by which
    feet stand above the terrain elsewhere. And how many lie beyond."""
    known = ~np.isnan(heights)
    between = _interpolate(places[known], heights[known], places[chosen])
    at_feet = np.flatnonzero(known[: len(foot_points)])
    offset = np.median(foot_points[at_feet, 2] - heights[at_feet])
    beyond = np.isnan(between)
    return np.where(beyond, foot_points[chosen, 2] - offset, between), int(beyond.sum())


def _bridge(places, heights, gaps):
    """Heights in gaps: interpolated linearly, beyond the convex hull the nearest height."""
    if not len(gaps):
        return np.empty(0)
    between = _interpolate(places, heights, gaps)
    return np.where(np.isnan(between), heights[cKDTree(places).query(gaps)[1]], between)


def _interpolate(places, heights, wanted):
    """Linear between places; NaN beyond them."""
    if len(places) < 4 or not len(wanted):
        return np.full(len(wanted), np.nan)
    return LinearNDInterpolator(Delaunay(places, qhull_options="QJ"), heights)(wanted)


def _refine(vertices, terrain, foot_places):
    """Greedy refinement: in each triangle add the terrain point with the largest error, until all are in tolerance.

    Returns the vertices, and the triangles between them.
    """
    if len(vertices) >= MOST_POINTS:
        return vertices, Delaunay(vertices[:, :2]).simplices
    feet = cKDTree(foot_places)
    low, high = vertices.min(axis=0)[:2], vertices.max(axis=0)[:2]
    own = np.concatenate([layer.points for layer in terrain.layers])
    own = own[((own[:, :2] > low) & (own[:, :2] < high)).all(axis=1)]
    own = own[np.abs(measure_heights(terrain, own[:, :2]) - own[:, 2]) < JOINED]  # not covered by a finer layer
    distance = feet.query(own[:, :2])[0]
    own, distance = own[distance > 1.0], distance[distance > 1.0]
    allowed = TOLERANCE + SLACK * distance
    for _ in range(ROUNDS):
        triangulation = Delaunay(vertices[:, :2])
        simplex = triangulation.find_simplex(own[:, :2])
        corners = vertices[triangulation.simplices[simplex], 2]
        turn = triangulation.transform[simplex]
        share = np.einsum("kij,kj->ki", turn[:, :2], own[:, :2] - turn[:, 2])
        height = (corners * np.column_stack([share, 1 - share.sum(axis=1)])).sum(axis=1)
        missed = np.where(simplex >= 0, np.abs(height - own[:, 2]) / allowed, 0.0)
        order = np.lexsort([-missed, simplex])
        worst = order[np.unique(simplex[order], return_index=True)[1]]
        worst = worst[missed[worst] > 1]
        if not len(worst) or len(vertices) + len(worst) > MOST_POINTS:
            return vertices, triangulation.simplices
        vertices = np.concatenate([vertices, own[worst]])
        left = np.ones(len(own), bool)
        left[worst] = False
        own, allowed = own[left], allowed[left]
    return vertices, Delaunay(vertices[:, :2]).simplices


def _join(feet, ground, longest):
    """Wall extensions down to the ground: (vertices, triangles), surfaces above and below the ground, and notes."""
    edge, start, end = _pieces(feet, longest)
    shares = np.array([0.0, 0.25, 0.5, 0.75, 1.0])[:, None, None]
    between = (1 - shares) * start + shares * end
    height = drop_on_triangles(ground, between.reshape(-1, 3)).reshape(5, -1)
    height = np.where(np.isfinite(height), height, between[..., 2])
    above, below = (between[..., 2] - height).max(axis=0), (height - between[..., 2]).max(axis=0)
    own = feet.polygon[edge] >= 0
    lifted = own & (above > JOINED)
    bottom = height.min(axis=0) - SUNK
    lower = [np.column_stack([place[:, :2], np.minimum(bottom, place[:, 2])])[lifted] for place in (start, end)]
    outward = feet.outward[edge][lifted]
    along = (end - start)[lifted]
    turned = outward[:, 0] * along[:, 1] - outward[:, 1] * along[:, 0] < 0
    k, n = np.arange(lifted.sum()), int(lifted.sum())
    vertices = np.concatenate([start[lifted], end[lifted], *lower])  # top left, top right, bottom left, bottom right
    triangles = np.concatenate([np.column_stack([k, k + 2 * n, k + 3 * n]), np.column_stack([k, k + 3 * n, k + n])])
    triangles[np.tile(turned, 2)] = triangles[np.tile(turned, 2)][:, ::-1]
    raised, below_ground = (np.unique(feet.polygon[edge][mask]) for mask in (lifted, own & (below > JOINED)))
    words = []
    apart = float(np.median((between[..., 2] - height)[:, own])) if own.any() else 0.0
    if abs(apart) > SUSPICIOUS:
        where = "above" if apart > 0 else "below"
        words.append(
            f"The buildings' feet are {abs(apart):.1f} m {where} the terrain (median): "
            "check that both heights have the same unit and vertical datum."
        )
    if len(raised):
        area = float((np.linalg.norm(along[:, :2], axis=1) * above[lifted]).sum())
        words.append(
            f"{len(raised)} surfaces end above the terrain, by up to {above.max():.1f} m: "
            f"walls extended downwards, about {area:,.0f} m² without a row in the results."
        )
    if len(below_ground):
        words.append(
            f"{len(below_ground)} surfaces end below the terrain, by up to {below.max():.1f} m: "
            "their parts below the terrain receive no light."
        )
    return (vertices, triangles), raised, below_ground, words


def _pieces(feet, longest):
    """Foot edges split into pieces, without duplicates (walls win over footprints): edge, start, end."""
    length = np.linalg.norm((feet.end - feet.start)[:, :2], axis=1)
    count = np.maximum(np.ceil(length / longest), 1).astype(np.int64)
    edge = np.repeat(np.arange(len(count)), count)
    step = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    span = feet.end - feet.start
    start, end = (feet.start[edge] + ((step + k) / count[edge])[:, None] * span[edge] for k in (0, 1))
    cells = np.round(np.concatenate([start, end]) / JOINED).astype(np.int64)
    place = np.unique(cells, axis=0, return_inverse=True)[1].reshape(2, -1)
    order = np.argsort(feet.on_footprint[edge], kind="stable")
    first = np.unique(np.sort(place, axis=0)[:, order], axis=1, return_index=True)[1]
    chosen = np.sort(order[first])
    return edge[chosen], start[chosen], end[chosen]


def _close(vertices, depth):
    """Sides and bottom of the ground, so that rays from below ground meet only back faces: vertices, triangles."""
    order = np.array(shapely.convex_hull(shapely.multipoints(vertices[:, :2])).exterior.coords)[:-1]
    nearest = cKDTree(vertices[:, :2]).query(order)[1]
    top = vertices[nearest]
    bottom = np.column_stack([top[:, :2], np.full(len(top), depth)])
    middle = np.append(top[:, :2].mean(axis=0), depth)
    n = len(top)
    k, following = np.arange(n), (np.arange(n) + 1) % n
    sides = [np.column_stack([k, k + n, following + n]), np.column_stack([k, following + n, following])]
    floor = np.column_stack([np.full(n, 2 * n), following + n, k + n])
    triangles = np.concatenate([*sides, floor])
    counter = shapely.LinearRing(top[:, :2]).is_ccw
    return np.concatenate([top, bottom, [middle]]), triangles if counter else triangles[:, ::-1]
