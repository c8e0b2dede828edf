"""A square of Midtown Manhattan for benchmarks/accuracy.py, and its reference by paths followed one by one.

Each path starts at a place of a triangle drawn by chance, looks at one sun of the year drawn by chance at every place
it comes to, and goes on in a direction by the cosine until it leaves the scene, meets a back or has been reflected
three times. It needs neither patches nor form factors nor chosen suns, and shares only the tree of triangles with
citypv. Triangles are those of the model, cut to 10 m, without ground; light from below the horizon is none.
"""

from pathlib import Path

import numpy as np

from citypv.core.rays.ray_scene import RayScene
from citypv.core.request import Request
from citypv.core.selfcheck.plain_scenes import join_parts
from citypv.core.study import read_scene, read_year
from citypv.core.sun.choose_suns import choose_suns

ROOT = Path(__file__).parents[1]
FILE = ROOT / "tests" / "data" / "obj" / "nyc_midtown_citicorp_1km.obj.gz"
CACHE = ROOT / "build" / "accuracy_midtown.npz"
PLACE = {"latitude": 40.757, "longitude": -73.97}
SIDE = 250.0  # [m] of the square
TRIANGLES = 300  # with a reference
LEAST_AREA = 1.0  # [m²] of these
ALBEDO, REFLECTIONS = 0.25, 3
OFFSET = 1e-3  # [m] from a face
BATCH = 1 << 18  # paths at a time


def read_square(side=SIDE):
    """The middle of Midtown, and a year of clear skies: Scene of single triangles, and Weather."""
    request = Request(**PLACE, ground="none", weather="clear-sky")
    scene = read_scene([FILE], request)
    vertices, triangles = np.asarray(scene.vertices, float), scene.triangles
    middle = vertices[triangles].mean(axis=1)
    inside = (np.abs(middle[:, :2] - np.median(middle[:, :2], axis=0)) < side / 2).all(axis=1)
    used, corners = np.unique(triangles[inside], return_inverse=True)
    square = join_parts([(vertices[used], corners.reshape(-1, 3))])
    square.site = scene.site
    return square, read_year(scene.site, request)


def draw_triangles(scene, seed=0):
    """Triangles with a reference: eligible ones, drawn by area, (k,) int."""
    area = np.where(scene.surfaces.eligible & (scene.surfaces.area >= LEAST_AREA), scene.surfaces.area, 0)
    generator = np.random.default_rng(seed)
    count = min(TRIANGLES, int((area > 0).sum()))
    return np.sort(generator.choice(len(area), count, replace=False, p=area / area.sum()))


def reference(scene, weather, paths, seed=1):
    """Light of a year on some triangles, the mean over every hour's sun plus that of the sky.

    Returns
    -------
    chosen : (k,) int
    light, error : (k,) float64
        And its standard error.
    """
    key = np.array([paths, seed, len(scene.triangles)])
    if CACHE.exists():
        with np.load(CACHE) as kept:
            if np.array_equal(kept["key"], key):
                return kept["chosen"], kept["light"], kept["error"]
    chosen = draw_triangles(scene)
    suns = choose_suns("hourly", *weather.axis)
    tracer, generator = RayScene(scene.vertices, scene.triangles), np.random.default_rng(seed)
    sums = np.zeros((2, len(chosen)))
    for start in range(0, paths, max(1, BATCH // len(chosen))):
        count = min(max(1, BATCH // len(chosen)), paths - start)
        light = follow(scene, tracer, np.repeat(chosen, count), suns.direction, generator).reshape(len(chosen), count)
        sums += light.sum(axis=1), (light**2).sum(axis=1)
    mean = sums[0] / paths
    error = np.sqrt((sums[1] / paths - mean**2) / paths)
    CACHE.parent.mkdir(exist_ok=True)
    np.savez(CACHE, key=key, chosen=chosen, light=mean, error=error)
    return chosen, mean, error


def follow(scene, tracer, triangle, suns, generator):
    """Light that one path from each of some triangles finds: (n,) float64."""
    corners = np.asarray(scene.vertices, float)[scene.triangles]
    edges, normals = corners[:, 1:] - corners[:, :1], scene.surfaces.normal
    u, v = np.sqrt(generator.random(len(triangle))), generator.random(len(triangle))
    places = corners[triangle, 0] + (u * (1 - v))[:, None] * edges[triangle, 0] + (u * v)[:, None] * edges[triangle, 1]
    light, weight, path = np.zeros(len(triangle)), 1.0, np.arange(len(triangle))
    for turn in range(REFLECTIONS + 1):
        normal = normals[triangle]
        origins = (places + OFFSET * normal).astype(np.float32)
        sun = suns[generator.integers(len(suns), size=len(path))]
        cosine = np.einsum("ij,ij->i", normal, sun)
        front = np.flatnonzero(cosine > 0)
        free = front[tracer.trace_closest(origins[front], sun[front].astype(np.float32)) < 0]
        light[path[free]] += weight * cosine[free]
        away = cosine_directions(normal, generator)
        met, b1, b2 = tracer.trace_places(origins, away.astype(np.float32))
        light[path[(met < 0) & (away[:, 2] > 0)]] += weight
        on = (met >= 0) & (np.einsum("ij,ij->i", normals[met], away) < 0)
        path, triangle, weight = path[on], met[on], weight * ALBEDO
        places = corners[triangle, 0] + b1[on, None] * edges[triangle, 0] + b2[on, None] * edges[triangle, 1]
        if not len(path) or turn == REFLECTIONS:
            break
    return light


def cosine_directions(normal, generator):
    """Directions distributed by the cosine about normals, (n, 3): a point on the unit sphere around their tips."""
    away = generator.normal(size=normal.shape)
    away = normal + away / np.linalg.norm(away, axis=1, keepdims=True)
    return away / np.linalg.norm(away, axis=1, keepdims=True)
