"""Crowns and trunks from the trees of a city: their shapes, or ellipsoids from height and crown diameter."""

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import ConvexHull, QhullError

from ..city.triangulate import triangulate
from ..settings.errors import InputError
from .crowns import Crowns
from .ellipsoid import cylinder, ellipsoid, extrude

CROWN_PER_HEIGHT = 0.5  # crown diameter of a tree of which only the height is given
CROWN_BASE = 0.25  # of its height
SLIM = 0.1  # of the crown's width: parts below the crown that are slimmer are its trunk
STEEP = 60.0  # [°] tilt of the faces of a trunk's mantle, at least
FLAT = 0.1  # [m] shapes that are lower have no volume
WALLS = 0.5  # [m] steep faces of plants per length of the outline of the others, from which they are a body
OVERLAP = 1.01  # area of faces over what they cover, seen from above, up to which none lies above another
AREA = "vegetation drawn as an area without a height: it casts no shadow"
MERGED = 5  # decimals [m] of corners that are one


@dataclass
class Part:
    """Triangles of one tree."""

    vertices: np.ndarray  # (v, 3) float64 [m]
    triangles: np.ndarray  # (t, 3) int
    trunk: np.ndarray  # (t,) bool
    height: float | None = None  # [m] as given; None: that of the shape


def build_crowns(trees, report, move):
    """Crowns of a scene.

    A closed shape is the outside of a crown; of a shape that is not closed (crossed pictures) the convex hull is.
    Slim faces below the crown are the trunk. An area of plants without thickness is raised by its height; where it has
    none (lawns and beds, as many producers draw them) it is left out and listed.

    Parameters
    ----------
    trees : list of Tree
        [m]
    report : ImportReport
        What was assumed is added.
    move : callable
        From the frame of the trees to that of the scene.

    Returns
    -------
    Crowns or None
        None without trees, or where all of them are left out.

    Raises
    ------
    InputError
        A tree has neither shape nor height.
    """
    if not trees:
        return None
    built = [(tree, build_tree(tree, report)) for tree in trees]
    report.skip(AREA, [tree.name for tree, part in built if part is None])
    trees, parts = [tree for tree, part in built if part], [part for _, part in built if part]
    if not parts:
        return None
    start = np.cumsum([0, *(len(part.vertices) for part in parts)])
    vertices = np.concatenate([part.vertices for part in parts])
    return Crowns(
        vertices=move(vertices),
        triangles=np.concatenate([part.triangles + first for part, first in zip(parts, start, strict=False)]).astype(
            np.int32
        ),
        tree=np.repeat(np.arange(len(parts), dtype=np.int32), [len(part.triangles) for part in parts]),
        trunk=np.concatenate([part.trunk for part in parts]),
        names=[tree.name for tree in trees],
        height=np.array([np.ptp(part.vertices[:, 2]) if part.height is None else part.height for part in parts]),
        evergreen=np.array([tree.evergreen for tree in trees]),
        area_density=np.array([np.nan if tree.area_density is None else tree.area_density for tree in trees]),
    )


def build_tree(tree, report):
    """Triangles of one tree: Part, or None for an area of plants without a height."""
    if tree.polygons:
        vertices, triangles = triangles_of(tree.polygons)
        if tree.cover and tree.height is None and is_area(vertices, triangles):
            return None
        part = build_shape(tree, vertices, triangles, report)
        if part is not None:
            return part
    if tree.cover or tree.place is None or tree.height is None:
        lacks = "height" if tree.height is None else "place"
        cure = "give it a height [m]" if tree.height is None else "give it a reference point or a shape"
        cure += ", or leave it out of the file"
        raise InputError(tree.path, f"{tree.where} has no shape with a volume and no {lacks}", cure)
    return build_ellipsoid(tree, report)


def build_ellipsoid(tree, report):
    """A tree from its numbers: an ellipsoid crown from CROWN_BASE of its height up, and a trunk below its middle."""
    width, base = tree.crown_diameter, CROWN_BASE * tree.height
    if width is None:
        width = CROWN_PER_HEIGHT * tree.height
        report.repair(f"tree without a crown diameter, {CROWN_PER_HEIGHT:g} of its height assumed", [tree.name])
    middle = tree.place + np.array([0, 0, (base + tree.height) / 2])
    crown = ellipsoid(middle, [width / 2, width / 2, (tree.height - base) / 2])
    if not tree.trunk_diameter:
        return Part(*crown, np.zeros(len(crown[1]), bool), tree.height)
    trunk = cylinder(tree.place, tree.trunk_diameter / 2, middle[2] - tree.place[2])
    triangles = np.concatenate([crown[1], trunk[1] + len(crown[0])])
    vertices, of_trunk = np.concatenate([crown[0], trunk[0]]), np.arange(len(triangles)) >= len(crown[1])
    return Part(vertices, triangles, of_trunk, tree.height)


def build_shape(tree, vertices, triangles, report):
    """A tree from its triangles: Part, or None if they enclose nothing."""
    if not len(triangles):
        return None
    trunk = find_trunk(vertices, triangles, tree.trunk_diameter)
    size = signed_volume(vertices, triangles) if is_closed(triangles) else 0.0
    if size:
        crown = triangles if size > 0 else triangles[:, ::-1]
    elif tree.cover and tree.height is not None:
        return extrude_cover(vertices, triangles, tree.height)
    else:
        crown = hull_of(vertices, triangles[~trunk] if not trunk.all() else triangles)
        if crown is None:
            return None
        report.repair("crown that is not closed, replaced by its convex hull", [tree.name])
    triangles = np.concatenate([crown, triangles[trunk]])
    return Part(vertices, triangles, np.arange(len(triangles)) >= len(crown))


def triangles_of(polygons):
    """Triangles of polygons with merged corners: (v, 3) float64 and (t, 3) int64."""
    opened = [[open_ring(ring) for ring in polygon.rings] for polygon in polygons]
    opened = [rings for rings in opened if all(len(ring) >= 3 for ring in rings)]
    rings = [ring for polygon in opened for ring in polygon]
    if not rings:
        return np.empty((0, 3)), np.empty((0, 3), np.int64)
    ring_start = np.cumsum([0, *map(len, rings)])
    polygon_start = np.cumsum([0, *map(len, opened)])
    points = np.concatenate(rings)
    triangles, _ = triangulate(points, ring_start, polygon_start)
    _, first, which = np.unique(np.round(points, MERGED), axis=0, return_index=True, return_inverse=True)
    triangles = which.reshape(-1)[triangles]
    proper = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return points[first], triangles[proper]


def open_ring(ring):
    """Ring without repeated points."""
    keys = np.round(ring, MERGED)
    return ring[(keys != np.roll(keys, -1, axis=0)).any(axis=1)]


def is_closed(triangles):
    """Whether triangles enclose volumes and all face outwards, or all inwards: every edge runs once in each sense."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    back = np.sort(edges[:, 0] * (triangles.max() + 1) + edges[:, 1])
    return bool((back == np.sort(edges[:, 1] * (triangles.max() + 1) + edges[:, 0])).all())


def is_area(vertices, triangles):
    """Whether plants are drawn as a piece of the ground: no face above another, and hardly any walls around it."""
    steep = is_steep(vertices, triangles)
    level = triangles[~steep]
    if not len(level) or is_closed(triangles):
        return False
    edges, uses = np.unique(edges_of(level), axis=0, return_counts=True)
    outline = np.linalg.norm(np.diff(vertices[edges[uses == 1]], axis=1), axis=2).sum()
    if triangle_areas(vertices, triangles[steep]).sum() >= WALLS * outline:
        return False
    faces = shapely.polygons(vertices[level, :2])
    return shapely.area(faces).sum() <= OVERLAP * shapely.union_all(faces).area


def edges_of(triangles):
    """Edges of triangles, the smaller end first: (3t, 2) int."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    return np.sort(edges, axis=1)


def signed_volume(vertices, triangles):
    """Volume inside closed triangles [m³], negative if they face inwards."""
    corners = vertices[triangles] - vertices.mean(axis=0)
    return float(np.einsum("ti,ti->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)


def find_trunk(vertices, triangles, diameter):
    """Faces of the trunk, (t,) bool: near the axis through the foot, and below all that is wider.

    Its mantle is steep: a round crown without a trunk has faces around its lowest point, too, but level ones.
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    radius = max(SLIM * max(high[0] - low[0], high[1] - low[1]), 0.55 * (diameter or 0.0))
    foot = vertices[vertices[:, 2] <= low[2] + 1e-3 * (high[2] - low[2])].mean(axis=0)
    farthest = np.linalg.norm(vertices[:, :2] - foot[:2], axis=1)[triangles].max(axis=1)
    base = vertices[triangles[farthest > radius], 2].min(initial=np.inf)
    low_down = (farthest <= radius) & (vertices[triangles, 2].min(axis=1) < base - FLAT)
    width = farthest[low_down & is_steep(vertices, triangles)].max(initial=0.0)
    return low_down & (farthest <= width)


def triangle_areas(vertices, triangles):
    """Areas, (t,) float64 [m²]."""
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def is_steep(vertices, triangles):
    """Whether triangles are steeper than STEEP: (t,) bool."""
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    normal = np.cross(b - a, c - a)
    return np.abs(normal[:, 2]) < np.cos(np.radians(STEEP)) * np.linalg.norm(normal, axis=1)


def hull_of(vertices, triangles):
    """Convex hull of the corners of triangles: (t, 3) int facing outwards, or None if it is flat."""
    used = np.unique(triangles)
    points = vertices[used]
    if np.ptp(points[:, 2]) < FLAT:
        return None
    try:
        hull = ConvexHull(points)
    except QhullError:
        return None
    a, b, c = np.moveaxis(points[hull.simplices], 1, 0)
    inwards = np.einsum("ti,ti->t", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    return used[np.where(inwards[:, None], hull.simplices[:, ::-1], hull.simplices)]


def extrude_cover(vertices, triangles, height):
    """Body of plants over an area: Part."""
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    upwards = np.cross(b - a, c - a)[:, 2]
    triangles = np.where(upwards[:, None] < 0, triangles[:, ::-1], triangles)[np.abs(upwards) > 0]
    points, body = extrude(vertices, triangles, height)
    return Part(points, body, np.zeros(len(body), bool))
