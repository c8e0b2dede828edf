"""A square of Midtown Manhattan for benchmarks/accuracy.py, and its reference by paths followed one
by one.

Each path starts at a place of a triangle, looks at one sun of the year at every place it comes to,
drawn by chance, and goes on in a direction by the cosine until it leaves the scene, meets a back or
has been reflected three times. It needs neither patches nor form factors nor chosen suns, and
shares only the tree of triangles with citypv. First places, directions and suns are those of a
scrambled Sobol sequence, shifted by chance for each triangle; REPLICATES sequences tell the noise.
Triangles are those of the model, cut to 10 m, without ground; light from below the horizon is none.

Two things must be said before two programs can be compared on a real model:

- Sheets are two faces in one place that look in opposite directions; a tenth of the triangles are
  of such. A ray may
  meet either, so that paths lose light there, which citypv's rays do not. Reference and peers
  therefore get every triangle APART in front of its own place, citypv the model as it is.
- Places inside other buildings: whether some light counts there that falls into an open shell is a
  definition. So
  triangles with a reference are only those of whose first rays less than BACKS meet a back. The
  limit hardly matters: nearly all have less than 1 % or more than 30 %.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from citypv.core.commands.plain_scenes import join_parts
from citypv.core.rays.ray_scene import RayScene
from citypv.core.run.study import read_scene, read_year
from citypv.core.settings.request import Request
from citypv.core.sun.sun_sampling import choose_suns

ROOT = Path(__file__).parents[1]
FILE = ROOT / "tests" / "data" / "obj" / "nyc_midtown_citicorp_1km.obj.gz"
CACHE = ROOT / "build" / "accuracy_midtown.npz"
FOR_PEERS = ROOT / "build" / "midtown.npz"
PLACE = {"latitude": 40.757, "longitude": -73.97}
SIDE = 250.0  # [m] of the square
TRIANGLES = 300  # with a reference
LEAST_AREA = 1.0  # [m²] of these
APART = 1e-3  # [m]
BACKS, BACK_RAYS = 0.05, 1000  # most that may meet a back, of so many rays
ALBEDO, REFLECTIONS = 0.25, 3
OFFSET = 1e-3  # [m] from a face
REPLICATES = 16
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


def set_apart(scene):
    """The same triangles without common corners, each APART in front of its place: Scene."""
    corners = (
        np.asarray(scene.vertices, float)[scene.triangles] + APART * scene.surfaces.normal[:, None]
    )
    vertices = corners.reshape(-1, 3)
    return replace(
        scene, vertices=vertices, triangles=np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    )


def draw_triangles(scene, tracer, seed=0):
    """Triangles with a reference, (k,) int: eligible ones in the open, drawn by area; and how many
    others were drawn.

    `scene` is that of `set_apart`.
    """
    area = np.where(
        scene.surfaces.eligible & (scene.surfaces.area >= LEAST_AREA), scene.surfaces.area, 0
    )
    generator = np.random.default_rng(seed)
    drawn = generator.choice(
        len(area), min(2 * TRIANGLES, int((area > 0).sum())), replace=False, p=area / area.sum()
    )
    triangle = np.repeat(drawn, BACK_RAYS)
    origins = lay_places(scene, triangle, generator.random((2, len(triangle))))
    away = cosine_directions(scene.surfaces.normal[triangle], generator.random((2, len(triangle))))
    met, _, _ = tracer.trace_places(origins.astype(np.float32), away.astype(np.float32))
    back = (met >= 0) & (np.einsum("ij,ij->i", scene.surfaces.normal[met], away) > 0)
    share = back.reshape(-1, BACK_RAYS).mean(axis=1)
    kept = np.flatnonzero(share < BACKS)[:TRIANGLES]
    return np.sort(drawn[kept]), kept[-1] + 1 - len(kept)


def reference(scene, weather, paths, seed=1):
    """Light of a year on some triangles, the mean over every hour's sun plus that of the sky.

    Parameters
    ----------
    scene : Scene
        Of `set_apart`.
    weather : Weather
    paths : int
        From each triangle, REPLICATES times a power of two.
    seed : int

    Returns
    -------
    chosen : (k,) int
    light, error : (k,) float64
        And its standard error.
    hidden : int
        Further triangles that were drawn and lie partly inside something.
    """
    key = np.array([paths, seed, len(scene.triangles), TRIANGLES])
    names = "chosen", "light", "error", "hidden"
    if CACHE.exists():
        with np.load(CACHE) as kept:
            if np.array_equal(kept["key"], key):
                return tuple(kept[name] for name in names)
    tracer = RayScene(scene.vertices, scene.triangles)
    chosen, hidden = draw_triangles(scene, tracer)
    suns = choose_suns("hourly", *weather.axis).direction
    light = np.empty((REPLICATES, len(chosen)))
    for replicate in range(REPLICATES):
        generator = np.random.default_rng([seed, replicate])
        net = qmc.Sobol(5, rng=generator).random(paths // REPLICATES)
        step = max(1, BATCH // len(net))
        for start in range(0, len(chosen), step):
            some = chosen[start : start + step]
            numbers = (net + generator.random((len(some), 1, 5))) % 1
            found = follow(
                scene,
                tracer,
                np.repeat(some, len(net)),
                suns,
                (numbers.reshape(-1, 5).T, generator),
            )
            light[replicate, start : start + step] = found.reshape(len(some), -1).mean(axis=1)
    error = light.std(axis=0, ddof=1) / np.sqrt(REPLICATES)
    CACHE.parent.mkdir(exist_ok=True)
    found = chosen, light.mean(axis=0), error, hidden
    np.savez(CACHE, key=key, **dict(zip(names, found, strict=True)))
    return found


def write_scene(scene, suns, chosen, light):
    """Write what peers read (peers/mitsuba.py): the file."""
    wanted = int(scene.surfaces.eligible.sum())
    city = {
        "vertices": scene.vertices,
        "triangles": scene.triangles,
        "sun": suns.direction,
        "weight": suns.weight,
    }
    FOR_PEERS.parent.mkdir(exist_ok=True)
    np.savez(FOR_PEERS, **city, triangle=chosen, light=light, wanted=wanted)
    return FOR_PEERS


def follow(scene, tracer, triangle, suns, numbers):
    """Light that one path from each of some triangles finds: (n,) float64.

    Parameters
    ----------
    triangle : (n,) int
    suns : (s, 3) float
    numbers : tuple
        (5, n) float in [0, 1) of the first place, direction and sun, and the generator of all
        others.
    """
    first, generator = numbers
    normals = scene.surfaces.normal
    places = lay_places(scene, triangle, first[:2], offset=0.0)
    light, weight, path = np.zeros(len(triangle)), 1.0, np.arange(len(triangle))
    for turn in range(REFLECTIONS + 1):
        normal = normals[triangle]
        chance = first[2:] if turn == 0 else generator.random((3, len(path)))
        origins = (places + OFFSET * normal).astype(np.float32)
        sun = suns[(chance[2] * len(suns)).astype(int)]
        cosine = np.einsum("ij,ij->i", normal, sun)
        front = np.flatnonzero(cosine > 0)
        free = front[tracer.trace_closest(origins[front], sun[front].astype(np.float32)) < 0]
        light[path[free]] += weight * cosine[free]
        away = cosine_directions(normal, chance[:2])
        met, b1, b2 = tracer.trace_places(origins, away.astype(np.float32))
        light[path[(met < 0) & (away[:, 2] > 0)]] += weight
        on = (met >= 0) & (np.einsum("ij,ij->i", normals[met], away) < 0)
        path, triangle, weight = path[on], met[on], weight * ALBEDO
        corners = np.asarray(scene.vertices, float)[scene.triangles[triangle]]
        edges = corners[:, 1:] - corners[:, :1]
        places = corners[:, 0] + b1[on, None] * edges[:, 0] + b2[on, None] * edges[:, 1]
        if not len(path) or turn == REFLECTIONS:
            break
    return light


def lay_places(scene, triangle, numbers, offset=OFFSET):
    """Places on triangles, evenly distributed for even numbers, (2, n) in [0, 1): (n, 3)
    float64.
    """
    corners = np.asarray(scene.vertices, float)[scene.triangles[triangle]]
    edges = corners[:, 1:] - corners[:, :1]
    u, v = np.sqrt(numbers[0]), numbers[1]
    places = corners[:, 0] + (u * (1 - v))[:, None] * edges[:, 0] + (u * v)[:, None] * edges[:, 1]
    return places + offset * scene.surfaces.normal[triangle]


def cosine_directions(normal, numbers):
    """Directions by the cosine about normals, (n, 3), from (2, n) in [0, 1): points of unit spheres
    at their tips.
    """
    height, turn = 1 - 2 * numbers[0], 2 * np.pi * numbers[1]
    ring = np.sqrt(1 - height**2)
    away = normal + np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
    return away / np.linalg.norm(away, axis=1, keepdims=True)
