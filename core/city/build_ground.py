"""Generate the ground of a city without terrain: a TIN through the base edges ("feet") of its
buildings.

Between them it has points of the open ground, dense near the buildings, sparser with distance. They
are the middles of squares of patch size × 2ᵏ that lie at the same places whatever is built on them:
counted from zero of the grid of the files, as far as whole squares reach.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial import cKDTree

from ..rays.random_numbers import mix, uniform
from ..settings.progress import report_part, silent
from ..settings.tolerances import GEOMETRY
from .check_geometry import check_parts, check_patch_size
from .city import City
from .find_feet import find_feet
from .plan_geometry import (
    draw_triangles,
    find_inside,
    join_polygons,
    list_runs,
    merge_places,
    pair_keys,
    unique_pairs,
)
from .polygons import drop_unused
from .scene import Surfaces
from .site import MICROMETRE, Site
from .slope_filter import draw_lines, highest_foot
from .triangulate_feet import drop_on_triangles, triangulate_feet, triangulate_plan


class Lattice(NamedTuple):
    """Squares of the ground on the grid of the files."""

    low: np.ndarray  # (2,) float64 [m] least easting and northing, whole multiples of the step
    high: np.ndarray  # (2,) float64 [m]
    step: float  # [m] of the largest squares along the rim, patch_size × 2ᵏ
    patch_size: float  # [m] of the smallest squares
    site: Site  # whose frame the points are in

    def place(self, eastings_northings):
        """Points of the grid, (k, 2) float64 [m], in the scene's frame: (k, 2) float64 [m]."""
        return self.site.from_files(np.pad(eastings_northings, ((0, 0), (0, 1))))[:, :2]

    def draw_rim(self):
        """Points on the rim, one step apart, the corners among them: (r, 2) float64 [m] in the
        scene's frame.
        """
        # Each side begins at one corner and ends before the next.
        x, y = (
            np.arange(low, high, self.step) for low, high in zip(self.low, self.high, strict=True)
        )
        sides = [
            (x, self.low[1]),
            (self.high[0], y),
            (x + self.step, self.high[1]),
            (self.low[0], y + self.step),
        ]
        return self.place(
            np.concatenate([np.stack(np.broadcast_arrays(*side), axis=1) for side in sides])
        )


def lay_lattice(points, feet, reach, patch_size, site, *, kept=None):
    """Lattice that reaches beyond a city.

    Parameters
    ----------
    points : array, (m, 3) float64 [m]
        Of the city.
    feet : Feet
    reach : float
        Least extent beyond the city [building heights].
    patch_size : float [m]
    site : Site
        Whose frame the points are in.
    kept : Lattice, optional
        Taken if all of the city lies on it.

    Returns
    -------
    Lattice
    """
    # On the grid of the files, so that an edit of the city leaves the squares where they are.
    places = site.to_files(points)[:, :2].round(3)  # to millimetres
    low, high = places.min(axis=0), places.max(axis=0)
    if kept is not None and (low >= kept.low).all() and (high <= kept.high).all():
        return kept
    # Reach by the height above the feet, in whole squares of the largest power of two within it.
    reach = max(reach * (points[:, 2].max() - np.median(feet.start[:, 2])), SHORTEST_REACH)
    step = patch_size * 2.0 ** max(np.floor(np.log2(reach / patch_size)), 0)
    first, last = np.floor((low - reach) / step), np.ceil((high + reach) / step)
    return Lattice(first * step, last * step, step, patch_size, site)


def spread_points(foot_places, footprints, lattice):
    """Middles of squares outside the footprints, and points on the rim.

    A square is split as long as it is larger than patch_size + 0.35 * (distance to the nearest
    foot).

    Parameters
    ----------
    foot_places : array, (k, 2) float64 [m]
    footprints : array of shapely polygons
    lattice : Lattice

    Returns
    -------
    array, (p, 2) float64 [m]
        Points on the rim come last.
    """
    tree, patch_size, (low, high) = cKDTree(foot_places), lattice.patch_size, lattice[:2]
    # So large that none of the first is small enough: the others do not depend on where the ground
    # ends.
    size = patch_size * 2.0 ** (3 + np.ceil(np.log2(max((high - low).max() / patch_size, 1))))
    x, y = (
        np.arange(np.floor(a / size), np.ceil(b / size)) for a, b in zip(low, high, strict=True)
    )
    cells = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)  # column and row, from zero
    # A quadtree: squares of the size, those on the lattice, are taken or cut into four.
    done = []
    while len(cells):
        # Squares outside the bounds of the lattice are dropped.
        cells = cells[((cells + 1) * size > low).all(axis=1) & (cells * size < high).all(axis=1)]
        # Random numbers of each square: of those near each other no two have the same middle in
        # half patches.
        # The numbers repeat after 2048 half patches.
        middles = ((2 * cells + 1) * (size / patch_size)).astype(np.int64) % (1 << 11)
        shifts = uniform(mix(pair_keys(middles).view(np.uint64)), 2) - 0.5
        # Random shifts by a hundredth of a square, so that no four points lie on one circle.
        middles = size * (cells + 0.5 + 1e-2 * shifts)
        places = lattice.place(middles.round(3))
        away, _ = tree.query(places)
        # A patch may grow by 0.35 m per metre of distance from the nearest foot.
        fine = size <= patch_size * 1.0001 + 0.35 * np.maximum(away - 0.7 * size, 0)
        # Squares that reach over the bounds are split down to the step of the lattice.
        fine &= (size <= lattice.step) | ((cells * size >= low) & ((cells + 1) * size <= high)).all(
            axis=1
        )
        # No point lies closer to a foot than half a patch.
        done.append(places[fine & (away > 0.5 * patch_size)])
        # Squares that are not fine enough become four.
        cells = (2 * cells[~fine, None] + np.array([[0, 0], [1, 0], [0, 1], [1, 1]])).reshape(-1, 2)
        size /= 2
    # No points under footprints; the rim closes the ground.
    places = np.concatenate(done)
    outside = np.ones(len(places), bool)
    outside[find_inside(footprints, places)[0]] = False
    return np.concatenate([places[outside], lattice.draw_rim()])


DEFAULT_PATCH = 10.0  # [m]
SHORTEST_REACH = 30.0  # [m]


class PlacedCity(NamedTuple):
    """A city in the scene's axes, as ground is laid under it."""

    city: City
    points: np.ndarray  # (m, 3) float64 [m], of the city, z up, local origin
    surfaces: Surfaces
    footprint: np.ndarray  # (n,) bool
    site: Site  # whose frame the points are in


def build_ground(
    placed, patch_size=None, *, reach=3.0, lattice=None, ground_height=None, report_share=silent
):
    """TIN that meets the foot of every wall, with courtyards and passages, coarser with distance.

    Foot edges are split into pieces of at most half a patch, and again where they are missing in
    the triangulation, so that no gap opens below a wall between two ground points. Where feet of
    different height meet, the ground takes the higher one: it covers a strip of the lower wall
    rather than leave a gap below the other. Footprints replace the ground below buildings;
    courtyards, and the ground below overhanging footprints, are kept.

    Where the triangles lie, and in what order, follows from what is near them: an edit of the city
    leaves those further away as they are.

    Parameters
    ----------
    placed : PlacedCity
    patch_size : float, optional
        [m] Distance of ground points near the buildings.
    reach : float
        Least extent beyond the city [building heights], of `Scene.ground_reach`.
    lattice : Lattice, optional
        Of the city before an edit: taken if all of this one lies on it.
    ground_height : callable, optional
        As of `find_feet`.
    report_share : callable, optional
        As of `build_scene`, of the ground.

    Returns
    -------
    vertices : array, (v, 3) float64 [m]
    triangles : array, (t, 3) int64
        Oriented upwards.
    hanging : array, (h,) int64
        Footprints above the ground: passages, bridges, towers on other buildings.
    lattice : Lattice

    Raises
    ------
    InputError
        An array or the patch size is invalid.
    """
    check_parts(*placed[:4])
    check_patch_size(patch_size)
    # Feet as constraints: edges cut into short pieces, each place at the highest foot.
    patch_size = patch_size or DEFAULT_PATCH
    feet = feet_or_corners(placed, ground_height)
    lattice = lay_lattice(placed.points, feet, reach, patch_size, placed.site, kept=lattice)
    lines = draw_lines(feet)
    foot_points, edges = cut_feet(feet, lines, 0.5 * patch_size)
    report_share(0.28)
    # Points of the open ground, at heights interpolated between the feet.
    free = spread_points(foot_points[:, :2], feet.footprints, lattice)
    free = _interpolate_heights(foot_points, free, lattice)
    spread, triangulated = 0.45, 0.8  # shares of the time that are over then
    report_share(spread)
    triangulate_part = partial(report_part, report_share, spread, triangulated)
    # Triangles through both; those that lie under buildings alone go, as footprints take their
    # place.
    vertices, triangles = triangulate_feet(lines, foot_points, edges, free, triangulate_part)
    triangles = faces_up(vertices, triangles)
    report_share(triangulated)
    between = np.flatnonzero((triangles >= len(free)).all(axis=1))  # free places are outside
    triangles = np.delete(
        triangles, between[under_buildings(vertices, triangles[between], feet.footprints)], axis=0
    )
    return *_sort_by_place(vertices, triangles), feet.hanging, lattice


def _sort_by_place(vertices, triangles):
    """Vertices of some triangles sorted by easting, then northing, and the triangles sorted by
    these, each beginning with its first one."""
    # Vertices renumbered from west to east; each triangle turned so that its least vertex comes
    # first.
    vertices, triangles = drop_unused(vertices, triangles)
    order = np.lexsort(vertices.T[[2, 1, 0]])
    triangles = np.argsort(order)[triangles]
    first = triangles.argmin(axis=1)[:, None]
    triangles = np.take_along_axis(triangles, (first + np.arange(3)) % 3, axis=1)
    return vertices[order], triangles[np.lexsort(triangles.T[::-1])]


def feet_or_corners(placed, ground_height=None):
    """Feet of a city; if nothing stands on the ground, the edges of its bounding rectangle."""
    points = placed.points
    feet = find_feet(placed.city, points, placed.surfaces, placed.footprint, ground_height)
    # Nothing stands on the ground: it lies as a rectangle below everything.
    if not len(feet.start):
        low, high = points.min(axis=0), points.max(axis=0)
        corners = np.array(
            [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]]
        )
        feet.start = np.column_stack([corners, np.full(4, low[2])])
        feet.end, feet.step = np.roll(feet.start, -1, axis=0), np.full(4, GEOMETRY.storey)
        feet.polygon, feet.on_footprint, feet.outward = (
            np.full(4, -1),
            np.zeros(4, bool),
            np.zeros((4, 2)),
        )
    return feet


def split_feet(feet, longest):
    """Edges of feet in pieces no longer than this [m] in plan: the edge of each, (p,), and its
    ends, (p, 2, 3).
    """
    # Equal pieces, as many as the length needs; edges upright in plan have none.
    span = feet.end - feet.start
    length = np.linalg.norm(span[:, :2], axis=1)
    count = np.where(
        length > GEOMETRY.accuracy, np.maximum(np.ceil(length / longest), 1), 0
    ).astype(np.int64)
    edge, step = list_runs(np.zeros(len(count), np.int64), count)
    share = (np.stack([step, step + 1], axis=1) / count[edge, None])[..., None]
    return edge, feet.start[edge, None] + share * span[edge, None]


def cut_feet(feet, lines, longest):
    """Points along the feet, without duplicates in plan view, and the edges between them."""
    # Each place once, at the height of the highest foot there; edges by the numbers of places.
    points = split_feet(feet, longest)[1].reshape(-1, 3)
    lowest, index = merge_places(points)
    places = points[lowest]
    places[:, 2] = highest_foot(lines, places)
    edges = np.sort(index.reshape(-1, 2), axis=1)
    return places, unique_pairs(edges[edges[:, 0] != edges[:, 1]])


def _interpolate_heights(foot_points, free, lattice, *, controls=32, rounding=0.1):
    """Free places with heights interpolated between the feet, and out to a rim as high as the
    places next to it: (k, 3) float64 [m]."""
    low, high = lattice.low, lattice.high
    # Around the ground a circle of places, as high as the feet near them.
    # Each control point on a circle around the ground has the height of the feet nearest to it.
    angle = 2 * np.pi * np.arange(controls) / controls
    rim = 0.5 * (low + high) + np.hypot(*(high - low)) * np.column_stack(
        [np.cos(angle), np.sin(angle)]
    )
    rim, tree = lattice.place(rim), cKDTree(foot_points[:, :2])
    # Heights are averaged over feet within 100 m.
    around = tree.query_ball_point(foot_points[tree.query(rim)[1], :2], 100.0)
    # The mean is rounded, to `rounding` [m].
    rim_height = [rounding * np.round(foot_points[some, 2].mean() / rounding) for some in around]
    # Heights are linear on the triangles between feet and circle.
    known = np.concatenate([foot_points, np.column_stack([rim, rim_height])])
    heights = drop_on_triangles(known[triangulate_plan(known[:, :2])], free)
    return np.column_stack([free, heights.round(MICROMETRE)])


def under_buildings(vertices, triangles, footprints):
    """Triangles completely under buildings, where footprints replace the ground."""
    if not len(footprints):
        return np.zeros(len(triangles), bool)
    # Blocks are widened one by one: all of them together would take four times as long.
    blocks = shapely.buffer(
        shapely.get_parts(join_polygons(footprints)), GEOMETRY.accuracy, quad_segs=4
    )
    blocks = shapely.get_parts(join_polygons(blocks))
    # A triangle is under a block if its middle is, and then all of it.
    corners = vertices[:, :2].copy()[triangles]
    triangle, block = find_inside(blocks, (corners[:, 0] + corners[:, 1] + corners[:, 2]) / 3)
    under = np.zeros(len(triangles), bool)
    under[triangle[shapely.contains(blocks[block], draw_triangles(corners[triangle]))]] = True
    return under


def faces_up(vertices, triangles):
    """Triangles oriented upwards, without those that have no area in plan view."""
    # doubled  twice the area in plan, positive if the corners run anticlockwise [m²].
    a, b, c = triangles.T
    x, y = vertices[:, 0].copy(), vertices[:, 1].copy()
    along, across = (x[b] - x[a], y[b] - y[a]), (x[c] - x[a], y[c] - y[a])
    doubled = along[0] * across[1] - along[1] * across[0]
    longest = np.maximum(along[0] ** 2 + along[1] ** 2, across[0] ** 2 + across[1] ** 2)
    triangles = np.where(doubled[:, None] < 0, triangles[:, ::-1], triangles)
    return triangles[np.abs(doubled) > 1e-6 * longest]
