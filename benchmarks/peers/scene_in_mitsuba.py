"""Light on a city by the matrix method, with Mitsuba 3 as the ray engine.

Started by mitsuba.py, which describes it, with the options as one JSON object; prints what was
measured as another.
"""

import json
import statistics
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from types import SimpleNamespace

import mitsuba as mi
import numpy as np
from scipy import sparse

mi.set_variant("llvm_ad_rgb")
import drjit as dr  # noqa: E402 - only now it is known for which variant

ALBEDO = 0.25
REFLECTIONS = 3
RAY_OFFSET = 1e-3  # [m] along the normal
# of the hemisphere; with 16 points for 256 rays up to 19 M shadow rays under 143 suns
RAYS_PER_CHUNK = 1 << 21
ROWS_PER_TASK = 1024
# by which light is divided at least, as far as a triangle lies under something
LEAST_OPEN_SHARE = 0.05


@dataclass
class City:
    """Triangles as the rays need them, on Mitsuba's side; four floats per row are read in
    one go.
    """

    scene: mi.Scene
    count: int  # n triangles
    corner: mi.Float  # (n, 4) first corner, moved along the normal [m]
    edges: list  # two of (n, 4), to the second and third corner [m]
    tangents: list  # two of (n, 4)
    normal: mi.Float  # (n, 4)
    sun: mi.Float  # (s, 4) towards the sun
    sun_count: int


def rows_of_four(rows):
    """Rows of three numbers as a flat array of four each."""
    return mi.Float(np.pad(np.asarray(rows, np.float32), ((0, 0), (0, 1))).ravel())


def take(rows, index):
    """Vectors out of rows of four."""
    vector = dr.gather(mi.Vector4f, rows, index)
    return mi.Vector3f(vector.x, vector.y, vector.z)


def build_city(file):
    """Embree's tree and the tables of triangles: City."""
    vertices, triangles = file["vertices"], file["triangles"]
    mesh = mi.Mesh("city", vertex_count=len(vertices), face_count=len(triangles))
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = mi.Float(vertices.astype(np.float32).ravel())
    parameters["faces"] = mi.UInt32(triangles.astype(np.uint32).ravel())
    parameters.update()
    first, second, third = (vertices[triangles[:, corner]] for corner in range(3))
    normal = np.cross(second - first, third - first)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    tangent = (second - first) / np.linalg.norm(second - first, axis=1, keepdims=True)
    return City(
        scene=mi.load_dict({"type": "scene", "mesh": mesh}),
        count=len(triangles),
        corner=rows_of_four(first + RAY_OFFSET * normal),
        edges=[rows_of_four(second - first), rows_of_four(third - first)],
        tangents=[rows_of_four(tangent), rows_of_four(np.cross(normal, tangent))],
        normal=rows_of_four(normal),
        sun=rows_of_four(file["sun"]),
        sun_count=len(file["sun"]),
    )


def steps_of_sequence(dimensions):
    """Steps of the additive recurrence with the generalised golden ratio (Roberts 2018), as
    fractions of 2³².
    """
    ratio = 2.0
    for _ in range(64):
        ratio = (1 + ratio) ** (1 / (dimensions + 1))
    return [int(ratio**-power * 2**32) for power in range(1, dimensions + 1)]


def hemisphere_rays(city, first, count, samples, seed):
    """Cosine-distributed rays from `count` triangles: place and direction from one shifted 4-D
    sequence.
    """
    index = dr.arange(mi.UInt32, count * samples)
    row = index // samples
    sample, triangle = index - row * samples, row + dr.opaque(mi.UInt32, first)
    shifts = (*mi.sample_tea_32(triangle, 2 * seed), *mi.sample_tea_32(triangle, 2 * seed + 1))
    # Sums of 32-bit integers wrap around as the torus does; 24 bits of them fit a float.
    u1, u2, u3, u4 = (
        mi.Float((shift + sample * step) >> 8) * 2**-24
        for shift, step in zip(shifts, steps_of_sequence(4), strict=True)
    )
    below = u2 > u1  # from the square to the triangle (Heitz 2019)
    b1 = dr.select(below, 0.5 * u1, u1 - 0.5 * u2)
    b2 = dr.select(below, u2 - 0.5 * u1, 0.5 * u2)
    origin = (
        take(city.corner, triangle)
        + b1 * take(city.edges[0], triangle)
        + b2 * take(city.edges[1], triangle)
    )
    sine, cosine = dr.sincos(dr.two_pi * u4)
    flat = take(city.tangents[0], triangle) * cosine + take(city.tangents[1], triangle) * sine
    return mi.Ray3f(origin, flat * dr.sqrt(u3) + take(city.normal, triangle) * dr.sqrt(1 - u3))


def trace_hemisphere(city, first, count, samples, seed):
    """What the hemisphere rays of some triangles meet.

    Returns
    -------
    (count, samples) int32
        A triangle's number, or n for the sky, n + 1 for what lies below the horizon, n + 2 for a
        back.
    """
    ray = hemisphere_rays(city, first, count, samples, seed)
    # These rays are not coherent, and told otherwise Embree takes twice as long.
    met = city.scene.ray_intersect_preliminary(ray, coherent=False)
    hit, triangle = met.is_valid(), met.prim_index
    back = dr.dot(take(city.normal, dr.select(hit, triangle, 0)), ray.d) > 0
    missed = dr.select(ray.d.z > 0, mi.UInt32(city.count), city.count + 1)
    return (
        dr.select(hit, dr.select(back, city.count + 2, triangle), missed)
        .numpy()
        .view(np.int32)
        .reshape(-1, samples)
    )


def count_hits(hit, count):
    """Rows of the matrix from lists of hits: sky and covered share, entries per row, columns and
    values.
    """
    samples = hit.shape[1]
    hit = np.sort(hit, axis=1)
    new = np.ones(hit.shape, bool)
    np.not_equal(hit[:, 1:], hit[:, :-1], out=new[:, 1:])
    first = np.flatnonzero(new)
    column, rays = hit.ravel()[first], np.diff(first, append=hit.size)
    kept = column < count
    entries = np.bincount(first[kept] // samples, minlength=len(hit))
    sky, covered = ((hit == met).mean(axis=1, dtype=np.float32) for met in (count, count + 2))
    return sky, covered, entries, column[kept], rays[kept].astype(np.float32) / np.float32(samples)


def cell_centroids(count):
    """Weights of the second and third corner at the centroids of `count` = k² congruent
    sub-triangles: two Float.
    """
    k = round(count**0.5)
    upright = [(3 * i + 1, 3 * j + 1) for j in range(k) for i in range(k - j)]
    inverted = [(3 * i + 2, 3 * j + 2) for j in range(k) for i in range(k - j - 1)]
    return (mi.Float(weights) for weights in np.float32(upright + inverted).T / np.float32(3 * k))


def sun_visibility(city, first, count, points, direct):
    """Shadow rays from some triangles to every sun in front of them; `direct` takes cos aoi ·
    visible share.
    """
    # Pairs of triangle and sun, triangle by triangle: what stands side by side meets the same
    # things.
    pair = dr.arange(mi.UInt32, count * city.sun_count)
    row = pair // city.sun_count
    triangle, sun = row + dr.opaque(mi.UInt32, first), pair - row * city.sun_count
    cosine = dr.dot(take(city.normal, triangle), take(city.sun, sun))
    facing = dr.compress(cosine > 0)
    triangle, sun, cosine = (
        dr.gather(type(values), values, facing) for values in (triangle, sun, cosine)
    )
    dr.eval(triangle, sun, cosine)

    # The points of one pair are neighbours: a packet of parallel rays.
    index = dr.arange(mi.UInt32, len(facing) * points)
    pair = index // points
    b1, b2 = (
        dr.gather(mi.Float, weights, index - pair * points) for weights in cell_centroids(points)
    )
    start, towards = dr.gather(mi.UInt32, triangle, pair), dr.gather(mi.UInt32, sun, pair)
    origin = (
        take(city.corner, start) + b1 * take(city.edges[0], start) + b2 * take(city.edges[1], start)
    )
    blocked = city.scene.ray_test(mi.Ray3f(origin, take(city.sun, towards)), coherent=True)
    free = dr.block_sum(dr.select(blocked, mi.Float(0), mi.Float(1 / points)), points)
    dr.scatter(direct, cosine * free, triangle * (city.sun_count + 1) + sun)
    dr.eval(direct)
    return len(index)


def reflect_once(matrix, light, reflected, pool):
    """Matrix times light, (n, s) float32, in blocks of rows on all threads; added to `reflected`
    too.
    """
    arriving = np.empty_like(light)

    def fill(start):
        rows = slice(start, start + ROWS_PER_TASK)
        arriving[rows] = matrix[rows] @ light
        reflected[rows] += arriving[rows]

    list(pool.map(fill, range(0, len(light), ROWS_PER_TASK)))
    return arriving


def light_city(city, options, pool, clock):
    """The whole task.

    Returns
    -------
    first, reflected : (n, s + 1) float32
        For each sun relative to DNI, in the last column for the isotropic sky relative to DHI.
    rays : dict
    """
    step = max(1, RAYS_PER_CHUNK // max(options.samples, 16 * options.shadow_samples, 256))
    chunks = [(start, min(step, city.count - start)) for start in range(0, city.count, step)]
    parts = []
    for start, count in chunks:
        with clock("hemisphere"):
            hit = trace_hemisphere(city, start, count, options.samples, options.seed)
        with clock("matrix"):
            blocks = [hit[row : row + ROWS_PER_TASK] for row in range(0, count, ROWS_PER_TASK)]
            parts += pool.map(lambda block: count_hits(block, city.count), blocks)
    with clock("matrix"):
        sky, covered, entries, columns, values = (
            np.concatenate(part) for part in zip(*parts, strict=True)
        )
        ends = np.concatenate([[0], np.cumsum(entries)]).astype(np.int32)
        matrix = sparse.csr_matrix((values, columns, ends), shape=(city.count, city.count))
    with clock("suns"):
        direct = dr.zeros(mi.Float, city.count * (city.sun_count + 1))
        shadow_rays = sum(
            sun_visibility(city, *chunk, options.shadow_samples, direct) for chunk in chunks
        )
        first = direct.numpy().reshape(city.count, -1)
        first[:, -1] = sky
    with clock("reflections"):
        # light leaving per light arriving
        matrix.data *= (ALBEDO / np.maximum(1 - covered, LEAST_OPEN_SHARE))[columns]
        arriving, reflected = first, np.zeros_like(first)
        for _ in range(REFLECTIONS):
            arriving = reflect_once(matrix, arriving, reflected, pool)
    return first, reflected, {"hemisphere": city.count * options.samples, "suns": shadow_rays}


def measure_parts(file, first, reflected):
    """Differences from a reference by parts: rms over triangles (and suns), and bias of the
    reflected light.
    """
    chosen = file["triangle"]
    first, reflected = first[chosen].astype(float), reflected[chosen].astype(float)
    difference = {
        "direct": first[:, :-1] - file["direct"],
        "direct_reflected": reflected[:, :-1] - file["direct_reflected"],
        "diffuse": first[:, -1] - file["diffuse"],
        "diffuse_reflected": reflected[:, -1] - file["diffuse_reflected"],
    }
    difference["diffuse_relative"] = difference["diffuse"] + difference["diffuse_reflected"]
    rms = {name: float(np.sqrt(np.mean(values**2))) for name, values in difference.items()}
    bias = float(difference["direct_reflected"].sum() / file["direct_reflected"].sum(dtype=float))
    return {"rms": rms, "bias_reflected": bias}


def error_of_year(file, first, reflected):
    """Rms error of the mean over the suns plus the sky, in percent of its mean, as in
    benchmarks/accuracy.py: float.
    """
    light = (first + reflected)[file["triangle"]].astype(float)
    weight = file.get("weight", np.full(light.shape[1] - 1, 1 / (light.shape[1] - 1)))
    known = file.get("light")
    if known is None:
        known = (
            (file["direct"] + file["direct_reflected"]) @ weight
            + file["diffuse"]
            + file["diffuse_reflected"]
        )
    found = light[:, :-1] @ weight + light[:, -1]
    return 100 * float(np.sqrt(np.mean((found - known) ** 2)) / known.mean())


def run_once(city, options, pool):
    """One run: (seconds and seconds of all threads, by stage and whole; result)."""
    stages = ("hemisphere", "matrix", "suns", "reflections", "whole")
    seconds, cpu_seconds = (dict.fromkeys(stages, 0.0) for _ in range(2))

    @contextmanager
    def clock(stage):
        started, cpu = time.perf_counter(), time.process_time()
        yield
        dr.sync_thread()
        seconds[stage] += time.perf_counter() - started
        cpu_seconds[stage] += time.process_time() - cpu

    with clock("whole"):
        result = light_city(city, options, pool, clock)
    return seconds, cpu_seconds, result


def measure(options):
    """Run as often as asked for: a dict of numbers and names."""
    dr.set_thread_count(options.threads)
    with np.load(options.scene) as opened:
        file = dict(opened)
    started = time.perf_counter()
    city = build_city(file)
    scene_seconds = time.perf_counter() - started
    with ThreadPoolExecutor(options.threads) as pool:
        run_once(city, options, pool)  # compiles the kernels
        runs = [run_once(city, options, pool) for _ in range(options.runs)]
    first, reflected, rays = runs[-1][2]
    seconds, cpu = (
        {stage: statistics.median(run[i][stage] for run in runs) for stage in runs[0][i]}
        for i in (0, 1)
    )
    return {
        "engine": "mitsuba",
        "variant": mi.variant(),
        "versions": {name: version(name) for name in ("mitsuba", "drjit", "numpy", "scipy")}
        | {"llvm": ".".join(map(str, dr.detail.llvm_version()))},
        **{
            name: getattr(options, name)
            for name in ("threads", "samples", "shadow_samples", "seed")
        },
        "rays": rays,
        "scene_seconds": scene_seconds,
        "whole": seconds.pop("whole"),
        "whole_runs": [run[0]["whole"] for run in runs],
        "cpu_whole": cpu.pop("whole"),
        "seconds": seconds,
        "cpu_seconds": cpu,
        **(measure_parts(file, first, reflected) if "direct" in file else {}),
        "year": error_of_year(file, first, reflected),
    }


if __name__ == "__main__":
    print(json.dumps(measure(SimpleNamespace(**json.loads(sys.argv[1])))))
