"""Crowns and trunks from the trees of a city: their shapes, or ellipsoids from height and crown
diameter.
"""

import functools
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import ConvexHull, QhullError

from ..settings.tolerances import GEOMETRY
from .polygons import edges_of, merge_vertices, normals_of, triangulate
from .scene import Crowns, volumes_below


@dataclass
class _TreeShape:
    """Triangles of one tree."""

    vertices: np.ndarray  # (v, 3) float64 [m]
    triangles: np.ndarray  # (t, 3) int
    trunk: np.ndarray  # (t,) bool
    height: float | None = None  # [m] as given; None: the shape's own


def build_crowns(trees, report, move):
    """Crowns of a scene.

    A closed shape is the outside of a crown; of a shape that is not closed (crossed pictures) the
    convex hull is. Slim faces below the crown are the trunk. An area of plants without thickness is
    raised by its height; where it has none (lawns and beds, as many producers draw them) it is left
    out and listed, as is a tree without shape and height.

    Parameters
    ----------
    trees : list of Tree
        [m]
    report : ImportReport
        What was assumed is added.
    move : callable
        From the frame of the trees to the scene's.

    Returns
    -------
    Crowns or None
        None without trees, or where all of them are left out.
    """
    built = [(tree, _build_tree(tree, report)) for tree in trees]
    trees, parts = [tree for tree, part in built if part], [part for _, part in built if part]
    if not parts:
        return None
    start = np.cumsum([0, *(len(part.vertices) for part in parts)])
    triangles = [part.triangles + first for part, first in zip(parts, start, strict=False)]
    return Crowns(
        vertices=move(np.concatenate([part.vertices for part in parts])),
        triangles=np.concatenate(triangles).astype(np.int32),
        tree=np.repeat(
            np.arange(len(parts), dtype=np.int32), [len(part.triangles) for part in parts]
        ),
        trunk=np.concatenate([part.trunk for part in parts]),
        names=[tree.name for tree in trees],
        height=np.array(
            [np.ptp(part.vertices[:, 2]) if part.height is None else part.height for part in parts]
        ),
        evergreen=np.array([tree.evergreen for tree in trees]),
        area_density=np.array(
            [np.nan if tree.area_density is None else tree.area_density for tree in trees]
        ),
    )


def _build_tree(tree, report):
    """Triangles of one tree: TreeShape, or None if it is left out, as the report then says."""
    if tree.polygons:
        vertices, triangles = _triangles_of(tree.polygons)
        if tree.cover and tree.height is None and _is_area(vertices, triangles):
            report.skip(
                "vegetation drawn as an area without a height: it casts no shadow", [tree.name]
            )
            return None
        part = _build_shape(tree, vertices, triangles, report)
        if part is not None:
            return part
    # Without a shape a single tree needs a place and a height.
    if tree.cover or tree.place is None or tree.height is None:
        lacks = "height" if tree.height is None else "place"
        report.skip(
            f"vegetation without a shape that has a volume, and without a {lacks}", [tree.name]
        )
        return None
    return _build_ellipsoid(tree, report)


def _build_ellipsoid(tree, report, *, crown_per_height=0.5):
    """A tree from its numbers: an ellipsoid crown from a quarter of its height up, and a trunk
    below its middle.
    """
    width, base = tree.crown_diameter, 0.25 * tree.height
    if width is None:
        # `crown_per_height`: crown diameter of a tree for which only the height is given.
        width = crown_per_height * tree.height
        report.repair(
            f"tree without a crown diameter, {crown_per_height:g} of its height assumed",
            [tree.name],
        )
    middle = tree.place + np.array([0, 0, (base + tree.height) / 2])
    # A sphere, stretched to the width of the crown and to the height between its base and top.
    sphere, triangles = unit_sphere()
    vertices = middle + sphere * [width / 2, width / 2, (tree.height - base) / 2]
    of_crown = len(triangles)
    if tree.trunk_diameter:
        trunk = cylinder(tree.place, tree.trunk_diameter / 2, middle[2] - tree.place[2])
        triangles = np.concatenate([triangles, trunk[1] + len(vertices)])
        vertices = np.concatenate([vertices, trunk[0]])
    return _TreeShape(vertices, triangles, np.arange(len(triangles)) >= of_crown, tree.height)


def _build_shape(tree, vertices, triangles, report):
    """A tree from its triangles: TreeShape, or None if they enclose nothing."""
    if not len(triangles):
        return None
    trunk = _find_trunk(vertices, triangles, tree.trunk_diameter)
    size = (
        volumes_below(vertices - vertices.mean(axis=0), triangles).sum()
        if _is_closed(triangles)
        else 0.0
    )
    if size:
        crown = triangles if size > 0 else triangles[:, ::-1]
    elif tree.cover and tree.height is not None:  # a body of plants over an area
        upwards = normals_of(vertices, triangles)[:, 2]
        level = np.where(upwards[:, None] < 0, triangles[:, ::-1], triangles)[np.abs(upwards) > 0]
        points, body = extrude(vertices, level, tree.height)
        return _TreeShape(points, body, np.zeros(len(body), bool))
    else:
        crown = _hull_of(vertices, triangles[~trunk] if not trunk.all() else triangles)
        if crown is None:
            return None
        report.repair("crown that is not closed, replaced by its convex hull", [tree.name])
    triangles = np.concatenate([crown, triangles[trunk]])
    return _TreeShape(vertices, triangles, np.arange(len(triangles)) >= len(crown))


def _triangles_of(polygons):
    """Triangles of polygons with merged corners: (v, 3) float64 and (t, 3) int64."""
    rings, counts = [], []
    # Rings without corners that fall together; a polygon with fewer than three of them has no area.
    for polygon in polygons:
        # Corners that agree to five decimals of a metre are one.
        keys = [np.round(ring, 5) for ring in polygon.rings]
        own = [
            r[(k != np.roll(k, -1, axis=0)).any(axis=1)]
            for r, k in zip(polygon.rings, keys, strict=True)
        ]
        if all(len(ring) >= 3 for ring in own):
            rings += own
            counts.append(len(own))
    if not rings:
        return np.empty((0, 3)), np.empty((0, 3), np.int64)
    points = np.concatenate(rings)
    triangles, _ = triangulate(points, np.cumsum([0, *map(len, rings)]), np.cumsum([0, *counts]))
    points, triangles = merge_vertices(points, triangles)
    return points, triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]


def _is_closed(triangles):
    """Whether triangles enclose volumes and all face outwards, or all inwards: every edge runs once
    in each sense.
    """
    start, end = edges_of(triangles).T
    count = triangles.max() + 1
    return bool((np.sort(start * count + end) == np.sort(end * count + start)).all())


def _is_area(vertices, triangles):
    """Whether plants are drawn as a piece of the ground: no face above another, and hardly any
    walls around it.
    """
    steep = _is_steep(vertices, triangles)
    level = triangles[~steep]
    if not len(level) or _is_closed(triangles):
        return False
    edges, uses = np.unique(np.sort(edges_of(level), axis=1), axis=0, return_counts=True)
    outline = np.linalg.norm(np.diff(vertices[edges[uses == 1]], axis=1), axis=2).sum()
    walls = 0.5 * np.linalg.norm(normals_of(vertices, triangles[steep]), axis=1).sum()
    faces = shapely.polygons(vertices[level, :2])
    # A plant is a body from 0.5 m of steep faces per metre of the other faces' outline on; the
    # faces of an area overlap by less than 1 % seen from above.
    return (
        walls < 0.5 * outline and shapely.area(faces).sum() <= 1.01 * shapely.union_all(faces).area
    )


def _find_trunk(vertices, triangles, diameter):
    """Faces of the trunk, (t,) bool: near the axis through the foot, and below all that is wider.

    Its mantle is steep: a round crown without a trunk has faces around its lowest point, too, but
    level ones.
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    # The trunk is slimmer than a tenth of the crown's width.
    radius = max(0.1 * max(high[0] - low[0], high[1] - low[1]), 0.55 * (diameter or 0.0))
    foot = vertices[vertices[:, 2] <= low[2] + 1e-3 * (high[2] - low[2])].mean(axis=0)
    farthest = np.linalg.norm(vertices[:, :2] - foot[:2], axis=1)[triangles].max(axis=1)
    base = vertices[triangles[farthest > radius], 2].min(initial=np.inf)
    low_down = (farthest <= radius) & (vertices[triangles, 2].min(axis=1) < base - GEOMETRY.uneven)
    width = farthest[low_down & _is_steep(vertices, triangles)].max(initial=0.0)
    return low_down & (farthest <= width)


def _is_steep(vertices, triangles):
    """Whether triangles are steeper than 60°: (t,) bool."""
    normal = normals_of(vertices, triangles)
    # Faces of a trunk's mantle are tilted by 60° or more.
    return np.abs(normal[:, 2]) < np.cos(np.radians(60.0)) * np.linalg.norm(normal, axis=1)


def _hull_of(vertices, triangles):
    """Convex hull of the corners of triangles: (t, 3) int facing outwards, or None if it
    is flat.
    """
    used = np.unique(triangles)
    points = vertices[used]
    if np.ptp(points[:, 2]) < GEOMETRY.uneven:
        return None
    try:
        hull = ConvexHull(points)
    except QhullError:
        return None
    inwards = np.einsum("ti,ti->t", normals_of(points, hull.simplices), hull.equations[:, :3]) < 0
    return used[np.where(inwards[:, None], hull.simplices[:, ::-1], hull.simplices)]


@functools.cache
def unit_sphere(subdivisions=3):
    """Triangulated sphere with the volume of the unit sphere.

    Returns
    -------
    vertices : (v, 3) float64
    triangles : (t, 3) int64
    """
    vertices = np.array(
        [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float
    )
    triangles = np.array(
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]],
        np.int64,
    )
    for _ in range(subdivisions):  # each triangle is cut into four at the middles of its edges
        edges, which = np.unique(np.sort(edges_of(triangles), axis=1), axis=0, return_inverse=True)
        ab, bc, ca = (which.reshape(-1) + len(vertices)).reshape(3, -1)
        a, b, c = triangles.T
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        triangles = np.concatenate([np.column_stack(part) for part in parts])
        vertices = np.concatenate([vertices, vertices[edges].mean(axis=1)])
        vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    return vertices * (4 / 3 * np.pi / volumes_below(vertices, triangles).sum()) ** (
        1 / 3
    ), triangles


def cylinder(foot, radius, height):
    """Mantle of an upright cylinder: vertices (v, 3) [m] and triangles (t, 3)."""
    sides, angle = 8, 0.25 * np.pi * np.arange(8)
    ring = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(sides)]) + foot
    k, following = np.arange(sides), (np.arange(sides) + 1) % sides
    lower = np.column_stack([k, following, k + sides])
    upper = np.column_stack([following, following + sides, k + sides])
    return np.concatenate([ring, ring + np.array([0, 0, height])]), np.concatenate([lower, upper])


def extrude(vertices, triangles, height):
    """Closed body between triangles that face upwards and the same ones raised by `height` [m]."""
    count, edges = len(vertices), edges_of(triangles).tolist()
    keys = set(map(tuple, edges))
    # The rim: edges whose reverse belongs to no triangle. On each of them stands a wall of two
    # triangles.
    begin, end = (
        np.array([edge for edge in edges if (edge[1], edge[0]) not in keys]).reshape(-1, 2).T
    )
    walls = [
        np.column_stack([begin, end, end + count]),
        np.column_stack([begin, end + count, begin + count]),
    ]
    raised = np.concatenate([vertices, vertices + np.array([0, 0, height])])
    return raised, np.concatenate([triangles[:, ::-1], triangles + count, *walls])
