"""Ground from measured terrain: fine at the buildings, coarse at the horizon, watertight, with
walls joined to it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, Delaunay, cKDTree

from ..settings.errors import InputError, check_array, count_of
from ..settings.tolerances import GEOMETRY
from .build_ground import (
    DEFAULT_PATCH,
    cut_feet,
    faces_up,
    lay_lattice,
    split_feet,
    spread_points,
    under_buildings,
)
from .check_geometry import check_patch_size, check_terrain
from .locate_site import AS_IN_FILES
from .polygons import drop_unused
from .slope_filter import draw_lines
from .terrain import HORIZON, NEAR, measure_heights, nearest_heights
from .triangulate_feet import drop_on_triangles, triangulate_plan


@dataclass
class Ground:
    """Triangles of the ground and of the wall extensions that join the buildings to it."""

    vertices: np.ndarray  # (v, 3) float64 [m]
    triangles: np.ndarray  # (t, 3) int64: ground, upward; wall extensions; sides and bottom
    hidden: np.ndarray  # (t,) bool: sides and bottom, which receive no light
    raised: np.ndarray  # (r,) int64 surfaces that end above the terrain: extended downwards
    below_ground: np.ndarray  # (b,) int64 surfaces that end below the terrain: cut by it
    notes: list  # sentences for the report


def build_terrain(feet, points, terrain, patch_size=None, reach=3.0, *, site=AS_IN_FILES):
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
        Least extent beyond the city [building heights], of `Scene.ground_reach`.
    site : Site, optional
        Whose frame the points are in.

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
    near = lay_lattice(points, feet, reach, patch_size, site)
    foot_points, _ = cut_feet(feet, draw_lines(feet), 0.5 * patch_size)
    places, heights, notes = _spread(foot_points, feet, terrain, near)
    vertices, triangles = _refine(np.column_stack([places, heights]), terrain, foot_points[:, :2])
    triangles = faces_up(vertices, triangles.astype(np.int64))
    skirts, raised, below_ground, words = _join(feet, vertices[triangles], 0.5 * patch_size)
    # The bottom lies 10 m below the lowest point of ground and city.
    body, body_triangles = _close(vertices, min(points[:, 2].min(), vertices[:, 2].min()) - 10.0)
    triangles = triangles[~under_buildings(vertices, triangles, feet.footprints)]
    pieces = [(vertices, triangles), skirts, (body, body_triangles)]
    starts = np.cumsum([0, *[len(piece[0]) for piece in pieces]])
    joined = np.concatenate(
        [piece[1] + first for piece, first in zip(pieces, starts[:-1], strict=True)]
    )
    hidden = np.arange(len(joined)) >= len(joined) - len(body_triangles)
    laid = drop_unused(np.concatenate([piece[0] for piece in pieces]), joined)
    return Ground(*laid, hidden, raised, below_ground, [*terrain.notes, *notes, *words])


def _spread(foot_points, feet, terrain, near):
    """Ground points with the heights of a terrain: places in plan, (p, 2) float64 [m], heights,
    (p,) float64 [m], and notes on gaps near the buildings, which are filled; ground points in gaps
    further away are left out.

    The feet's own places come first. `near` is the Lattice around the buildings.

    Raises
    ------
    InputError
        The terrain has no height under any building.
    """
    # The lattice is widened as far as the terrain reaches, up to the horizon, in its own steps.
    foot_places, site = foot_points[:, :2], near.site
    grid_points = site.to_files(np.concatenate([layer.points for layer in terrain.layers]))[:, :2]
    low = np.ceil(np.maximum(grid_points.min(axis=0), near.low - HORIZON) / near.step) * near.step
    high = (
        np.floor(np.minimum(grid_points.max(axis=0), near.high + HORIZON) / near.step) * near.step
    )
    far = near._replace(low=np.minimum(near.low, low), high=np.maximum(near.high, high))
    free = spread_points(foot_places, feet.footprints, far)
    # Heights of the terrain at all points; at walls also from close beside.
    places = np.concatenate([foot_places, free])
    heights = measure_heights(terrain, places)
    at_feet = np.arange(len(places)) < len(foot_places)
    rest = np.flatnonzero(np.isnan(heights) & at_feet)
    # Feet that miss the terrain by rounding alone take its nearest height, and no note.
    heights[rest] = nearest_heights(terrain, places[rest], GEOMETRY.accuracy)
    gap = np.isnan(heights)
    # Other feet in a gap take the nearest height within 5 m, if there is one.
    heights[gap & at_feet] = nearest_heights(terrain, places[gap & at_feet], NEAR)
    if np.isnan(heights[at_feet]).all():
        raise InputError(
            terrain.source,
            "has no height under any building",
            "give terrain that covers the city, in its system and unit",
        )
    # Gaps far from the buildings stay gaps: points there are left out, but the rim.
    on_grid = site.to_files(np.pad(places, ((0, 0), (0, 1))))[:, :2]
    inside = (
        (on_grid >= near.low - GEOMETRY.accuracy) & (on_grid <= near.high + GEOMETRY.accuracy)
    ).all(axis=1)
    # spread_points ends with them
    rim = np.arange(len(places)) >= len(places) - len(far.draw_rim())
    keep = ~gap | inside | rim
    # Gaps near the buildings are told, and filled.
    notes = []
    if (gap & inside & ~rim).any():
        count, feet_in = int((gap & inside & ~rim).sum()), int(gap[: len(foot_places)].sum())
        share = count / max(int((inside & ~rim).sum()), 1)
        notes.append(
            f"The terrain has gaps: {100 * share:.1f} % of the ground points near the buildings, "
            f"{feet_in:,} of them "
            "at walls; heights there are interpolated, or those of the nearest point."
        )
    # Feet further than 5 m from any terrain keep their own height, less the median by which feet
    # stand above the terrain elsewhere.
    open_feet = np.flatnonzero(np.isnan(heights[at_feet]))
    if len(open_feet):
        heights[open_feet] = foot_points[open_feet, 2] - np.nanmedian(
            foot_points[:, 2] - heights[at_feet]
        )
        count = f"{len(open_feet):,} ground points at walls"
        notes.append(
            f"{count} are more than {NEAR:g} m from the terrain: they follow the buildings' feet."
        )
    # All other gaps are filled linearly between known points, beyond their convex hull by the
    # nearest height.
    gap = np.isnan(heights)
    if gap.any():
        known = np.column_stack([places, heights])[~gap]
        between = drop_on_triangles(known[triangulate_plan(known[:, :2])], places[gap])
        nearest = cKDTree(known[:, :2]).query(places[gap])[1]
        heights[gap] = np.where(np.isfinite(between), between, known[nearest, 2])
    return places[keep], heights[keep], notes


def _refine(vertices, terrain, foot_places, *, most_points=60_000):
    """Greedy refinement: in each triangle add the terrain point with the largest error, until all
    are in tolerance, there would be more than `most_points`, or after eight rounds.

    It begins with ground points, (v, 3) float64 [m]. Returns all vertices, and the triangles
    between them, by Delaunay in plan.
    """
    # Ground of so many points is not refined.
    if len(vertices) >= most_points:
        return vertices, Delaunay(vertices[:, :2]).simplices
    # Candidates are the terrain's own points inside the hull, over 1 m from any building's foot.
    feet = cKDTree(foot_places)
    low, high = vertices.min(axis=0)[:2], vertices.max(axis=0)[:2]
    own = np.concatenate([layer.points for layer in terrain.layers])
    own = own[((own[:, :2] > low) & (own[:, :2] < high)).all(axis=1)]
    # Points at which the terrain has another height lie below a finer layer, and are left out.
    own = own[np.abs(measure_heights(terrain, own[:, :2]) - own[:, 2]) < GEOMETRY.accuracy]
    distance = feet.query(own[:, :2])[0]
    own, distance = own[distance > 1.0], distance[distance > 1.0]
    # The ground may err by 0.15 m in height, and by 0.01 m more per metre of distance.
    allowed = 0.15 + 0.01 * distance
    # Points are added where the error is larger, in eight rounds at most.
    for _ in range(8):
        triangulation = Delaunay(vertices[:, :2])
        # Height of the ground at each candidate, by barycentric coordinates in its triangle.
        simplex = triangulation.find_simplex(own[:, :2])
        corners = vertices[triangulation.simplices[simplex], 2]
        turn = triangulation.transform[simplex]
        share = np.einsum("kij,kj->ki", turn[:, :2], own[:, :2] - turn[:, 2])
        height = (corners * np.column_stack([share, 1 - share.sum(axis=1)])).sum(axis=1)
        missed = np.where(simplex >= 0, np.abs(height - own[:, 2]) / allowed, 0.0)
        # The worst candidate of each triangle, where its error is more than allowed.
        order = np.lexsort([-missed, simplex])
        worst = order[np.unique(simplex[order], return_index=True)[1]]
        worst = worst[missed[worst] > 1]
        # Done if no error is too large, or the points would be too many.
        if not len(worst) or len(vertices) + len(worst) > most_points:
            return vertices, triangulation.simplices
        vertices = np.concatenate([vertices, own[worst]])
        left = np.ones(len(own), bool)
        left[worst] = False
        own, allowed = own[left], allowed[left]
    return vertices, Delaunay(vertices[:, :2]).simplices


def _join(feet, ground, longest):
    """Walls carried down to lower ground: vertices (v, 3) float64 [m] and triangles (t, 3) of these
    extensions, the surfaces carried down, those partly below the ground, (k,) int, and notes.
    """
    # Each piece of a foot, no longer than `longest`, is held against the ground's triangles at five
    # places along it; beyond them it counts as lying on the ground.
    edge, (start, end) = _split_once(feet, longest)
    shares = np.array([0.0, 0.25, 0.5, 0.75, 1.0])[:, None, None]
    between = (1 - shares) * start + shares * end
    height = drop_on_triangles(ground, between.reshape(-1, 3)).reshape(5, -1)
    height = np.where(np.isfinite(height), height, between[..., 2])
    above, below = (between[..., 2] - height).max(axis=0), (height - between[..., 2]).max(axis=0)
    own = feet.polygon[edge] >= 0
    # Where the ground lies lower, a wall is carried down to it: two triangles from the foot to its
    # bottom, turned outwards.
    lifted = own & (above > GEOMETRY.accuracy)
    # Walls that are extended downwards end 5 cm below the ground.
    bottom = height.min(axis=0) - 0.05
    lower = [
        np.column_stack([place[:, :2], np.minimum(bottom, place[:, 2])])[lifted]
        for place in (start, end)
    ]
    outward = feet.outward[edge][lifted]
    along = (end - start)[lifted]
    turned = outward[:, 0] * along[:, 1] - outward[:, 1] * along[:, 0] < 0
    k, n = np.arange(lifted.sum()), int(lifted.sum())
    # top left, top right, bottom left, bottom right
    vertices = np.concatenate([start[lifted], end[lifted], *lower])
    triangles = np.concatenate(
        [np.column_stack([k, k + 2 * n, k + 3 * n]), np.column_stack([k, k + 3 * n, k + n])]
    )
    triangles[np.tile(turned, 2)] = triangles[np.tile(turned, 2)][:, ::-1]
    # Which surfaces were carried down, and which are partly buried.
    raised, below_ground = (
        np.unique(feet.polygon[edge][mask]) for mask in (lifted, own & (below > GEOMETRY.accuracy))
    )
    words = []
    apart = float(np.median((between[..., 2] - height)[:, own])) if own.any() else 0.0
    # An offset of more than 3 m between feet and terrain suggests another vertical datum.
    if abs(apart) > 3.0:
        where = "above" if apart > 0 else "below"
        words.append(
            f"The buildings' feet are {abs(apart):.1f} m {where} the terrain (median): "
            "check that both heights have the same unit and vertical datum."
        )
    if len(raised):
        area = float((np.linalg.norm(along[:, :2], axis=1) * above[lifted]).sum())
        words.append(
            f"{count_of(len(raised), 'surface')} above the terrain, by up to {above.max():.1f} m: "
            f"walls extended downwards, about {area:,.0f} m² without a row in the results."
        )
    if len(below_ground):
        words.append(
            f"{count_of(len(below_ground), 'surface')} below the terrain, by up to "
            f"{below.max():.1f} m: "
            "their parts below the terrain receive no light."
        )
    return (vertices, triangles), raised, below_ground, words


def _split_once(feet, longest):
    """Pieces of foot edges without duplicates (walls win over footprints): edge, (p,), and its
    ends, (2, p, 3).
    """
    edge, pieces = split_feet(feet, longest)
    cells = np.round(pieces.reshape(-1, 3) / GEOMETRY.accuracy).astype(np.int64)
    place = np.sort(np.unique(cells, axis=0, return_inverse=True)[1].reshape(-1, 2), axis=1)
    order = np.argsort(feet.on_footprint[edge], kind="stable")
    chosen = np.sort(order[np.unique(place[order], axis=0, return_index=True)[1]])
    return edge[chosen], np.moveaxis(pieces[chosen], 1, 0)


def _close(vertices, depth):
    """Sides and bottom of the ground, so that rays from below ground meet only back faces:
    vertices, triangles.
    """
    top = vertices[ConvexHull(vertices[:, :2]).vertices]  # counter-clockwise
    bottom = np.column_stack([top[:, :2], np.full(len(top), depth)])
    middle = np.append(top[:, :2].mean(axis=0), depth)
    n = len(top)
    k, following = np.arange(n), (np.arange(n) + 1) % n
    sides = [
        np.column_stack([k, k + n, following + n]),
        np.column_stack([k, following + n, following]),
    ]
    floor = np.column_stack([np.full(n, 2 * n), following + n, k + n])
    return np.concatenate([top, bottom, [middle]]), np.concatenate([*sides, floor])
