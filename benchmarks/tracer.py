"""Compare the tracer with bare Embree, on the town of 91,764 triangles and 143 suns.

    python benchmarks/tracer.py [--runs 5] [--threads 2] [--mitsuba] [--fewer 208] [--only NAME…]
    [--json]

Side by side, run after run in turn, with the same threads:

bare     `EmbreeScene.run` of embreex on the very rays that the tracer sends, made beforehand:
         contiguous float32, one
         row of direction for all rays to a sun, only suns that stand in front, the tree built
         before
rays     the whole task by single rays: rays made and traced, the matrix of hits, three reflections
         for every sun
packets  the same by packets of rays
fewer    the same with --fewer hemisphere rays per triangle, with --fewer
mitsuba  the same task done with Mitsuba 3 (see peers/mitsuba.py), with --mitsuba

Printed: the median wall and processor seconds, the median ratio of the latter to those of the first
row, run by run, and the errors against the reference of the town. Where other programs run beside
it, processor seconds (of all threads) say more than wall seconds. What comes before the first ray
(patches, plan, Embree's tree) is reported separately.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from citypv.core.commands.plain_scenes import join_parts
from citypv.core.light import prepare_scene
from citypv.core.light.trace_gather import trace_gather
from citypv.core.patches.facing_scene import FacingScene
from citypv.core.rays.engines import TREES, VARIABLE
from citypv.core.settings.request import Request
from citypv.core.sun.suns import Suns

ROOT = Path(__file__).parents[1]
TOWN = ROOT / "tests" / "data" / "town.npz"
SETTINGS = {
    "samples": 256,
    "shadow_samples": 16,
    "far_ground": False,
    "max_bounces": 3,
    "sky": "isotropic",
}


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


def trace(scene, suns, engine, threads, record=None, **settings):
    """One whole task: wall and processor seconds, wall seconds before the first ray, and the
    Transfer.
    """

    def open_scene(*parts):
        ray_scene = FacingScene(*parts)
        if record is not None:
            ray_scene._tree = ray_scene._shadow_tree = record(ray_scene._tree)
        return ray_scene

    os.environ[VARIABLE], prepare_scene.FacingScene = engine, open_scene
    reports = []
    request = Request(**SETTINGS | settings, threads=threads)
    transfer = trace_gather(
        scene, suns, request, lambda *report: reports.append(time.process_time())
    )
    processor = time.process_time() - reports[0]  # the first report comes before the first ray
    seconds = dict(transfer.record.seconds)
    before = seconds.pop("plan and tree")
    return (sum(seconds.values()), processor), before, transfer


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
        """Wall and processor seconds of the rays alone, and their number."""
        with ThreadPoolExecutor(self.threads) as pool:
            started = clocks()
            found = pool.map(lambda rays: len(self.tree.run(*rays)), self.closest)
            count, seconds = sum(found), clocks() - started
            for position, wanted, directions in self.blocks:
                for sun in range(len(directions)):
                    parts = np.array_split(position[wanted[:, sun]].reshape(-1, 3), self.threads)
                    started = clocks()
                    found = pool.map(
                        lambda part, to=directions[sun : sun + 1]: self.look(part, to), parts
                    )
                    count, seconds = count + sum(found), seconds + clocks() - started
        return tuple(seconds), count

    def look(self, origins, direction):
        """Number of rays to one sun."""
        return len(self.tree.run(origins, direction, query="OCCLUDED"))


def clocks():
    """Wall and processor clock [s]."""
    return np.array([time.perf_counter(), time.process_time()])


def measure_errors(scene, town, transfer):
    """Root mean square errors of each triangle against the reference, and the bias of the reflected
    light.
    """
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
    one, other = (
        np.array([np.mean(getattr(transfer, name), dtype=float) for name in names])
        for transfer in found
    )
    return float(np.abs(other / one - 1).max())


def run_mitsuba(threads):
    """Results of one run of the peer."""
    command = [
        sys.executable,
        ROOT / "benchmarks" / "peers" / "mitsuba.py",
        "--runs",
        "1",
        "--json",
    ]
    found = subprocess.run(
        [*map(str, command), "--threads", str(threads)], check=True, capture_output=True, text=True
    )
    return json.loads(found.stdout)


def read_options():
    """Command line of the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--mitsuba", action="store_true", help="also run the peer")
    parser.add_argument(
        "--fewer",
        type=int,
        metavar="N",
        help="also trace with so many hemisphere rays per triangle",
    )
    parser.add_argument(
        "--only", nargs="+", metavar="NAME", help="of the rows bare, rays, packets, fewer, mitsuba"
    )
    parser.add_argument("--json", action="store_true")
    return parser.parse_args()


def make_rows(options, scene, suns, town):
    """What is timed, by name: functions that return wall and processor seconds, errors, and the
    Transfer or None.
    """
    found = {}

    def trace_row(engine, **settings):
        seconds, before, transfer = trace(scene, suns, engine, options.threads, **settings)
        found["before"] = before
        return seconds, measure_errors(scene, town, transfer), transfer

    def bare_row():
        found.setdefault("bare", BareRays(scene, suns, options.threads))
        seconds, found["rays"] = found["bare"].run()
        return seconds, {}, None

    def mitsuba_row():
        peer = run_mitsuba(options.threads)
        errors = peer["rms"] | {"bias_reflected": peer["bias_reflected"]}
        return (peer["whole"], peer["cpu_whole"]), errors, None

    rows = {"bare": bare_row} | {engine: partial(trace_row, engine) for engine in TREES}
    if options.fewer:
        rows["fewer"] = partial(trace_row, "packets", samples=options.fewer)
    if options.mitsuba:
        rows["mitsuba"] = mitsuba_row
    return {
        name: row for name, row in rows.items() if not options.only or name in options.only
    }, found


def main():
    options = read_options()
    town = np.load(TOWN)
    scene = join_parts([(town["vertices"], town["triangles"])])
    count = len(town["sun"])
    suns = Suns(
        "hourly",
        town["sun"],
        np.full(count, 1 / count),
        np.zeros(count, np.int32),
        np.arange(count),
    )
    # numba's loops are compiled before anything is timed
    trace(scene, suns, "packets", options.threads)
    rows, found = make_rows(options, scene, suns, town)
    seconds, errors, transfers = {name: [] for name in rows}, {}, {}
    for number in range(options.runs):
        for name, row in rows.items():
            taken, errors[name], transfers[name] = row()
            seconds[name].append(taken)
        words = (
            f"{name} {part[-1][0]:.2f} s, cpu {part[-1][1]:.2f} s" for name, part in seconds.items()
        )
        print(f"run {number + 1}: " + "; ".join(words), flush=True)
    medians = {name: np.median(part, axis=0).tolist() for name, part in seconds.items()}
    first = np.array(next(iter(seconds.values())))
    ratios = {
        name: np.median(np.array(part) / first, axis=0).tolist() for name, part in seconds.items()
    }
    engines = [transfers[name] for name in TREES if name in transfers]
    apart = compare_engines(engines) if len(engines) > 1 else None
    if options.json:
        summary = {"medians": medians, "ratios": ratios, "errors": errors, "means_apart": apart}
        print(json.dumps(summary | {"rays": found.get("rays")}))
        return
    print(f"{options.threads} threads; before the first ray {found.get('before', np.nan):.2f} s")
    if apart is not None:
        print(
            f"{found.get('rays', 0):,} rays; means of the town by packets and by rays: {apart:.1e} "
            "apart"
        )
    for name, (wall, processor) in medians.items():
        words = ", ".join(f"{part} {value:.4f}" for part, value in errors[name].items())
        print(
            f"{name:<8} {wall:6.2f} s ({ratios[name][0]:.2f}) cpu {processor:6.2f} s "
            f"({ratios[name][1]:.2f})  {words}"
        )


if __name__ == "__main__":
    main()
