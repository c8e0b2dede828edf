"""Glass towers of Midtown Manhattan: gather with a specular pass against pure forward, seconds at
equal error.

    python benchmarks/specular.py [--radius 150] [--suns 12] [--threads 1]

Facades that reach above 60 m are double glazing, everything else is diffuse. Both are run once with
few samples. Seconds grow with samples, errors fall as 1/√samples: compared is seconds × error²,
with the rms of the stated standard errors of eligible facades, that is the seconds that both would
need for the same error.
"""

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from citypv.core.city.build_scene import build_scene
from citypv.core.light.specular_light import trace_hybrid
from citypv.core.light.trace_forward import trace_forward
from citypv.core.read.read_city import read_city
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request
from citypv.core.sun.suns import Suns

CITY = Path(__file__).parents[1] / "tests" / "data" / "obj" / "nyc_midtown_citicorp_1km.obj.gz"
TALL = 60.0  # [m]


def place_scene(radius):
    """Scene of the part of Midtown within a radius [m] of its middle."""
    scene = build_scene(read_city([CITY]), latitude=40.75, longitude=-73.97, ground="none")
    middle = scene.vertices[scene.triangles].mean(axis=1)[:, :2]
    near = np.linalg.norm(middle - np.median(middle, axis=0), axis=1) < radius
    return keep_triangles(scene, near)


def keep_triangles(scene, kept):
    """The scene of some triangles and their surfaces."""
    own = np.unique(scene.triangle_surface[kept])
    place = np.full(len(scene.surfaces), -1)
    place[own] = np.arange(len(own))
    rows = {
        name: [values[row] for row in own]
        if isinstance(values, list)
        else (None if values is None else values[own])
        for name, values in vars(scene.surfaces).items()
    }
    names = ("triangles", "footprint", "closure", "sheet")
    parts = {
        name: None if getattr(scene, name) is None else getattr(scene, name)[kept] for name in names
    }
    surfaces = type(scene.surfaces)(**rows)
    return replace(
        scene,
        **parts,
        triangle_surface=place[scene.triangle_surface[kept]].astype(np.int32),
        surfaces=surfaces,
    )


def glaze_towers(scene, path):
    """Albedo file that makes glass of facades that reach above TALL; their number."""
    high = np.full(len(scene.surfaces), -np.inf)
    np.maximum.at(high, scene.triangle_surface, scene.vertices[scene.triangles, 2].max(axis=1))
    high -= scene.vertices[scene.triangles.ravel(), 2].min()
    glass = np.flatnonzero((scene.surfaces.kind == "facade") & (high > TALL))
    lines = [f"{scene.surfaces.surface_id[row]},double glazing" for row in glass]
    path.write_text("surface,material\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return len(glass)


def some_suns(count):
    """Suns spread over the sky of a year."""
    azimuth = np.radians(np.linspace(90, 270, count))
    height = np.radians(20 + 45 * np.abs(np.sin(np.arange(count))))
    direction = np.stack(
        [np.sin(azimuth) * np.cos(height), np.cos(azimuth) * np.cos(height), np.sin(height)], axis=1
    )
    place = np.arange(count, dtype=np.int32)
    return Suns("hourly", direction, np.full(count, 1 / count), np.zeros(count, np.int32), place)


def measure(trace, scene, suns, request):
    """Seconds, and rms standard error of diffuse and of direct light of eligible facades, and their
    means.
    """
    started = time.perf_counter()
    found = trace(scene, suns, request, silent)
    seconds = time.perf_counter() - started
    chosen = found.surfaces.eligible & (found.surfaces.kind == "facade")
    weight = found.surfaces.area[chosen] / found.surfaces.area[chosen].sum()
    errors = [
        float(np.sqrt(weight @ error[chosen] ** 2))
        for error in (found.diffuse_relative_standard_error, found.direct_annual_standard_error)
    ]
    projection = np.maximum(found.surfaces.normal[chosen] @ suns.direction.T, 0)
    direct = (
        found.visible_share[chosen] * projection + found.direct_reflected[chosen]
    ) @ suns.weight
    light = float(weight @ found.diffuse_relative[chosen]), float(weight @ direct)
    return seconds, np.array(errors), light


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--radius", type=float, default=150.0, help="[m] of the cut-out")
    parser.add_argument("--suns", type=int, default=12)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument(
        "--samples", type=int, default=16, help="photons per patch and source of forward"
    )
    options = parser.parse_args()
    scene, suns = place_scene(options.radius), some_suns(options.suns)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "glass.csv"
        count = glaze_towers(scene, path)
        print(
            f"{len(scene.triangles):,} patches, {len(scene.surfaces):,} surfaces, {count:,} of "
            f"glass, {len(suns)} suns"
        )
        request = Request(albedo_file=str(path), threads=options.threads)
        runs = {
            "hybrid": (trace_hybrid, request),
            "forward": (
                trace_forward,
                replace(request, estimator="forward", samples=options.samples),
            ),
            "gather, black glass": (trace_hybrid, replace(request, effects={"specular": False})),
        }
        trace_hybrid(scene, some_suns(1), replace(request, samples=16), silent)  # compiles
        found = {
            name: measure(trace, scene, suns, settings) for name, (trace, settings) in runs.items()
        }
    for name, (seconds, errors, light) in found.items():
        print(
            f"{name:<20} {seconds:7.1f} s, rms error diffuse {errors[0]:.4f}, direct "
            f"{errors[1]:.4f}; "
            f"light diffuse {light[0]:.4f}, direct {light[1]:.4f}"
        )
    cost = {name: seconds * errors**2 for name, (seconds, errors, _) in found.items()}
    ratio = cost["hybrid"] / cost["forward"]
    print(
        f"seconds at equal error, hybrid over forward: diffuse {ratio[0]:.3f}, direct "
        f"{ratio[1]:.3f}"
    )


if __name__ == "__main__":
    main()
