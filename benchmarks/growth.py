"""Scaling of time and memory with the size of the city: 10,000 to a million triangles, 12 typical
days, 3 bounces.

    python benchmarks/growth.py [--sizes 10000 100000 1000000] [--plot FILE.png]

Copies of the test town stand side by side, and a square is cut out of them that holds as many
triangles as wanted. Each size is traced in a process of its own. Printed: seconds and the highest
memory of the whole process, Embree's nanoseconds per ray, and these over the logarithm of the
number of triangles, which should not grow.
"""

import argparse
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
SIZES = (10_000, 30_000, 100_000, 300_000, 1_000_000)


def cut_city(count):
    """Vertices and triangles of the nearest `count` triangles around the middle of enough towns."""
    town = np.load(ROOT / "tests" / "data" / "town.npz")
    corners = town["vertices"][town["triangles"]].astype(np.float32)  # (t, 3, 3)
    span = np.ptp(corners, axis=(0, 1))[:2] + 10
    side = math.ceil(math.sqrt(count / len(corners))) + 1
    moves = [(column, row) for row in range(side) for column in range(side)]
    every = np.concatenate([corners + np.float32([*span * move, 0]) for move in moves])
    middle = every.mean(axis=1)[:, :2]
    distance = np.abs(middle - middle.mean(axis=0)).max(axis=1)
    chosen = np.sort(np.argpartition(distance, count - 1)[:count])
    vertices, corner = np.unique(every[chosen].reshape(-1, 3), axis=0, return_inverse=True)
    return vertices.astype(float), corner.reshape(-1, 3)


def trace_one(count):
    """Trace a city of `count` triangles; return time and memory."""
    from citypv.core.commands.plain_scenes import join_parts
    from citypv.core.light.trace_gather import trace_gather
    from citypv.core.results.write_summary import peak_memory
    from citypv.core.settings.progress import silent
    from citypv.core.settings.request import Request
    from citypv.core.sun.suns import Suns

    sun = np.load(ROOT / "tests" / "data" / "town.npz")["sun"]
    suns = Suns(
        "hourly",
        sun,
        np.full(len(sun), 1 / len(sun)),
        np.zeros(len(sun), np.int32),
        np.arange(len(sun)),
    )
    scene = join_parts([cut_city(count)])
    before = peak_memory()
    settings = trace_gather(
        scene, suns, Request(far_ground=False, sky="isotropic"), silent
    ).record.as_dict()
    rays = settings["hemisphere_rays"] + settings["shadow_rays"]
    return {
        "triangles": len(scene.triangles),
        "seconds": settings["seconds"],
        "rays": rays,
        "nanoseconds": 1e9 * settings["embree_thread_seconds"] / rays,
        "scene_memory": before,
        "memory": peak_memory(),
    }


def draw(rows, path):
    """Nanoseconds per ray, seconds and memory over the number of triangles."""
    import matplotlib.pyplot as plt

    triangles = [row["triangles"] for row in rows]
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.2), constrained_layout=True)
    values = (
        ("Embree, ns per ray and thread", [row["nanoseconds"] for row in rows]),
        ("whole task [s]", [sum(row["seconds"].values()) for row in rows]),
        ("highest memory [GB]", [row["memory"] / 1e9 for row in rows]),
    )
    for axis, (label, heights) in zip(axes, values, strict=True):
        axis.plot(triangles, heights, "o-")
        axis.set(xscale="log", xlabel="triangles", title=label)
        axis.grid(alpha=0.3)
    # Time per ray that grows like log n, through the first point.
    logarithm = [values[0][1][0] * math.log(count) / math.log(triangles[0]) for count in triangles]
    axes[0].plot(triangles, logarithm, ":", label="∝ log n")
    axes[0].legend()
    for axis in axes:
        axis.set_ylim(bottom=0)
    figure.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES)
    parser.add_argument("--plot", type=Path)
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(trace_one(options.one)))
        return
    rows = []
    print("triangles    rays [M]   seconds   ns/ray   ns/ray/log2(n)   memory [GB]")
    for count in options.sizes:
        command = [sys.executable, __file__, "--one", str(count)]
        row = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
        rows.append(row)
        each = row["nanoseconds"]
        print(
            f"{row['triangles']:>9,} {row['rays'] / 1e6:>10.0f} "
            f"{sum(row['seconds'].values()):>9.1f} {each:>8.1f} "
            f"{each / math.log2(row['triangles']):>16.2f} {row['memory'] / 1e9:>13.2f}",
            flush=True,
        )
    if options.plot:
        draw(rows, options.plot)


if __name__ == "__main__":
    main()
