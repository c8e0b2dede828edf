"""Berlin and Manhattan, whole or cut to their middle, and which of their surfaces lie alone."""

from functools import cache
from pathlib import Path

import numpy as np
from scenes import suns_towards

from citypv.core.city.build_scene import build_scene
from citypv.core.rays.ray_scene import RayScene
from citypv.core.read.read_city import read_city

ROOT = Path(__file__).parents[2]
PLACE = {"latitude": 40.757, "longitude": -73.97}
CITIES = {  # file, its place, half the side of the square that is cut out [m]
    "Berlin": ("examples/berlin/berlin_3910_5817.gml", {}, 220.0),
    "Manhattan": ("tests/data/obj/nyc_midtown_citicorp_1km.obj.gz", PLACE, 110.0),
}
SUNS = suns_towards([[0.3, -0.8, 0.6], [-0.5, 0.6, 0.4]])


@cache
def city_and_alone(name, whole):
    """Scene, and which of its surfaces lie alone."""
    file, place, half = CITIES[name]
    city = read_city([ROOT / file])
    scene = build_scene(city if whole else middle_of(city, half), **place)
    return scene, lies_alone(scene)


def middle_of(city, half):
    """The buildings whose points' middle lies in a square about the middle of the city."""
    building = np.array(city.building_id)
    ring = np.repeat(np.arange(len(city)), np.diff(city.polygon_start))
    of_point = np.repeat(ring, np.diff(np.append(city.ring_start[:-1], len(city.points))))
    names, index = np.unique(building, return_inverse=True)
    if len(names) < 20:  # the file knows no buildings: polygon by polygon
        index = np.arange(len(city))
    count = np.bincount(index[of_point])
    middle = np.stack(
        [np.bincount(index[of_point], city.points[:, axis]) / count for axis in (0, 1)], axis=1
    )
    away = np.abs(middle - np.median(middle, axis=0)).max(axis=1)
    return city.take((away < half)[index])


def lies_alone(scene):
    """Whether no face of another surface lies within a centimetre of a surface, seen from ten
    points of each triangle.

    Surfaces are dealt into two heaps, again and again, and each is held against the other heap:
    (n,) bool.
    """
    generator = np.random.default_rng(3)
    surface, corners = scene.triangle_surface, scene.vertices[scene.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    share = generator.dirichlet([1, 1, 1], (len(corners), 10))
    points = np.einsum("tkc,tcx->tkx", share, corners)
    met = np.zeros(points.shape[:2], bool)
    for _ in range(10):
        heap = generator.integers(0, 2, len(scene.surfaces) + 1)[surface]
        for mine in (0, 1):
            others, own = RayScene(scene.vertices, scene.triangles[heap != mine]), heap == mine
            for side in (1, -1):
                towards = -side * np.repeat(normal[own], points.shape[1], axis=0)
                start = points[own] + 0.01 * side * normal[own][:, None]
                depth = depth_of_hits(
                    others, scene.triangles[heap != mine], scene.vertices, start, towards
                )
                met[own] |= (depth <= 0.02).reshape(-1, points.shape[1])
    listed = surface >= 0
    shared = np.bincount(surface[listed], met.any(axis=1)[listed], len(scene.surfaces))
    return shared == 0


def depth_of_hits(tree, triangles, vertices, start, towards):
    """How far rays go until they meet something: (m,) float64 [m], inf for nothing."""
    start = start.reshape(-1, 3)
    hit = tree.trace_closest(start.astype(np.float32), towards.astype(np.float32))
    corners = vertices[triangles[np.maximum(hit, 0)]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    along = (normal * towards).sum(axis=1)
    away = ((corners[:, 0] - start) * normal).sum(axis=1)
    return np.divide(away, along, out=np.full(len(hit), np.inf), where=(hit >= 0) & (along != 0))
