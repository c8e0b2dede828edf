"""Compare the tracer with bare Embree, on the town of 91,764 triangles and 143 suns.

    python benchmarks/tracer.py [--runs 5] [--threads 2] [--mitsuba] [--json]

Side by side, run after run in turn, with the same threads:

bare     `EmbreeScene.run` of embreex on the very rays that the tracer sends, made beforehand: contiguous float32, one
         row of direction for all rays to a sun, only suns that stand in front, the tree built before
rays     the whole task by single rays: rays made and traced, the matrix of hits, three reflections for every sun
packets  the same by packets of rays
mitsuba  the same task done with Mitsuba 3 (see peers/mitsuba.py), with --mitsuba

Printed: the median seconds, their ratio to the bare rays', and the errors against the reference of the town. What comes
before the first ray (patches, plan, Embree's tree) is reported separately.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from citypv.core.commands.plain_scenes import join_parts
from citypv.core.patches.facing_scene import FacingScene
from citypv.core.progress import silent
from citypv.core.radiosity import gather_context
from citypv.core.radiosity.trace_gather import trace_gather
from citypv.core.rays.choose_engine import TREES, VARIABLE
from citypv.core.request import Request
from citypv.core.sun.suns import Suns

ROOT = Path(__file__).parents[1]
TOWN = ROOT / "tests" / "data" / "town.npz"
SETTINGS = {"samples": 256, "shadow_samples": 16, "far_ground": False, "max_bounces": 3, "sky": "isotropic"}


class Recorder:
    """A BVH that records its rays."""

    def __init__(self, tree):
        self.tree, self.closest, self.points = tree, [], {}

    def trace_places(self, origins, directions):
        self.closest.append((origins, directions))
        return self.tree.trace_places(origins, directions)

    def trace_closest(self, origins, directions):
        return self.trace_places(origins, directions)[0]

    def trace_shadow_rays(self, position, wanted, directions):
        self.points.setdefault(directions.tobytes(), []).append((position, wanted, directions))
        return self.tree.trace_shadow_rays(position, wanted, directions)


def trace(scene, suns, engine, threads, record=None):
    """One whole task: seconds, seconds before the first ray, and the Transfer."""

    def open_scene(*parts):
        ray_scene = FacingScene(*parts)
        if record is not None:
            ray_scene._tree = record(ray_scene._tree)
        return ray_scene

    os.environ[VARIABLE], gather_context.FacingScene = engine, open_scene
    transfer = trace_gather(scene, suns, Request(**SETTINGS, threads=threads), silent)
    seconds = dict(transfer.record.seconds)
    before = seconds.pop("plan and tree")
    return sum(seconds.values()), before, transfer


class BareRays:
    """The rays of a task, prepared for embreex."""

    def __init__(self, scene, suns, threads):
        recorders = []

        def record(tree):
            recorders.append(Recorder(tree))
            return recorders[-1]

        trace(scene, suns, "packets", 1, record)
        self.closest = recorders[-1].closest
        self.threads, self.blocks = threads, []  # of suns that are traced together
        for block in recorders[-1].points.values():
            position, wanted = (np.concatenate([task[place] for task in block]) for place in (0, 1))
            self.blocks.append((position, wanted, block[0][2]))
        self.tree = EmbreeScene(robust=True)
        TriangleMesh(self.tree, scene.vertices.astype(np.float32), scene.triangles.astype(np.int32))
        self.tree.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))

    def run(self):
        """Time of the rays alone [s], and their number."""
        with ThreadPoolExecutor(self.threads) as pool:
            started = time.perf_counter()
            found = pool.map(lambda rays: len(self.tree.run(*rays)), self.closest)
            count, seconds = sum(found), time.perf_counter() - started
            for position, wanted, directions in self.blocks:
                for sun in range(len(directions)):
                    parts = np.array_split(position[wanted[:, sun]].reshape(-1, 3), self.threads)
                    started = time.perf_counter()
                    found = pool.map(lambda part, to=directions[sun : sun + 1]: self.look(part, to), parts)
                    count, seconds = count + sum(found), seconds + time.perf_counter() - started
        return seconds, count

    def look(self, origins, direction):
        """Number of rays to one sun."""
        return len(self.tree.run(origins, direction, query="OCCLUDED"))


def measure_errors(scene, town, transfer):
    """Root mean square errors of each triangle against the reference, and the bias of the reflected light."""
    chosen = town["triangle"]
    cosine = np.maximum(scene.surfaces.normal[chosen] @ town["sun"].T, 0)
    reflected = transfer.direct_reflected[chosen] - town["direct_reflected"]
    parts = {
        "direct": cosine * transfer.visible_share[chosen] - town["direct"],
        "reflected": reflected,
        "diffuse": transfer.diffuse_relative[chosen] - town["diffuse"] - town["diffuse_reflected"],
    }
    errors = {name: float(np.sqrt(np.mean(part**2))) for name, part in parts.items()}
    return errors | {"bias_reflected": float(reflected.sum() / town["direct_reflected"].sum())}


def compare_engines(found):
    """Largest relative difference of the town's means between the engines' Transfers."""
    names = ("diffuse_relative", "sky_view_factor", "visible_share", "direct_reflected")
    one, other = (np.array([np.mean(getattr(transfer, name), dtype=float) for name in names]) for transfer in found)
    return float(np.abs(other / one - 1).max())


def run_mitsuba(threads):
    """Results of one run of the peer."""
    command = [sys.executable, ROOT / "benchmarks" / "peers" / "mitsuba.py", "--runs", "1", "--json"]
    found = subprocess.run([*map(str, command), "--threads", str(threads)], check=True, capture_output=True, text=True)
    return json.loads(found.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--mitsuba", action="store_true", help="also run the peer")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    town = np.load(TOWN)
    scene = join_parts([(town["vertices"], town["triangles"])])
    count = len(town["sun"])
    suns = Suns("hourly", town["sun"], np.full(count, 1 / count), np.zeros(count, np.int32), np.arange(count))
    bare = BareRays(scene, suns, options.threads)
    trace(scene, suns, "rays", options.threads)  # numba's loops are compiled before anything is timed
    seconds = {name: [] for name in ("bare", *TREES)}
    errors, before, transfers = {}, [], {}
    for number in range(options.runs):
        taken, count = bare.run()
        seconds["bare"].append(taken)
        for engine in TREES:
            taken, ahead, transfer = trace(scene, suns, engine, options.threads)
            seconds[engine].append(taken)
            before.append(ahead)
            errors[engine] = measure_errors(scene, town, transfer)
            transfers[engine] = transfer
        if options.mitsuba:
            found = run_mitsuba(options.threads)
            seconds.setdefault("mitsuba", []).append(found["whole"])
            errors["mitsuba"] = found["rms"] | {"bias_reflected": found["bias_reflected"]}
        print(
            f"run {number + 1}: " + ", ".join(f"{name} {part[-1]:.2f} s" for name, part in seconds.items()), flush=True
        )
    medians = {name: statistics.median(part) for name, part in seconds.items()}
    ratios = {name: statistics.median(a / b for a, b in zip(part, seconds["bare"], strict=True))
              for name, part in seconds.items()}  # fmt: skip
    apart = compare_engines(transfers.values())
    if options.json:
        found = {"rays": count, "medians": medians, "ratios": ratios, "errors": errors, "means_apart": apart}
        print(json.dumps(found))
        return
    print(f"{count:,} rays, {options.threads} threads; before the first ray {statistics.median(before):.2f} s")
    print(f"means of the town by packets and by rays: {apart:.1e} apart")
    for name, median in medians.items():
        words = ", ".join(f"{part} {value:.4f}" for part, value in errors.get(name, {}).items())
        print(f"{name:<8} {median:6.2f} s  {ratios[name]:5.2f} × bare  {words}")


if __name__ == "__main__":
    main()
