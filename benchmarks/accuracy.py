"""Error against time on two cities: what each setting buys, and what the peers need.

    python benchmarks/accuracy.py [--city town midtown] [--only CURVE …] [--runs 3] [--threads 1]
                                  [--plot docs/validation/accuracy] [--points N] [--kept FILE]

town     91,764 triangles and 143 suns of tests/data/town.npz; reference of 3,000 triangles in the
         same file, noise
         0.0004, which this program did not make
midtown  a square of Midtown Manhattan, 43,244 triangles (accuracy_midtown.py); reference of 300
         triangles by paths
         followed one by one under every hour's sun, so that the choice of suns is part of the
         error; --paths tells how many (noise is printed)

The error is that of the light of a year, direct, reflected and diffuse, as root mean square over
the triangles in percent of their mean. Time is processor time of tracing, the median of --runs;
`--threads 1` keeps it from growing with waiting threads. Settings that several curves share are
traced once per run. Every run is kept in a file, so that the study can be made in parts, and by one
process for each city with a file of its own: table and picture show all that is kept of a city.
`--points 1` tries the cheapest setting of each curve. *Targets* are rounds to a target
(accuracy_targets.py). Peers: peers/mitsuba.py does the same task with Mitsuba 3 as ray engine,
peers/radiance.py with Radiance on a sample of the triangles, from which its time is multiplied up.
They get the same triangles and suns (of Midtown those of days:24), and their trees count as ours
does.
"""

import argparse
import json
import subprocess
import sys
import time
from dataclasses import replace
from itertools import islice
from pathlib import Path
from statistics import median

import accuracy_midtown
import numpy as np
from accuracy_targets import refine_to
from tracer import SETTINGS, TOWN

from citypv.core.commands.plain_scenes import join_parts
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.light.prepare_scene import prepare_scene
from citypv.core.light.trace_forward import trace_forward
from citypv.core.light.trace_gather import trace_gather
from citypv.core.light.trace_run import trace_run
from citypv.core.results.picture import DOTS, make_figure, make_logarithmic, plain_style
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.sun.suns import Suns

ROOT = Path(__file__).parents[1]
KEPT = ROOT / "build" / "accuracy.json"
ROUNDS = 4
LADDERS = {  # curve -> settings, from cheap to dear
    "samples": [
        {"samples": 16, "shadow_samples": 1},
        {"samples": 64, "shadow_samples": 4},
        {"samples": 256, "shadow_samples": 16},
        {"samples": 1024, "shadow_samples": 64},
        {"samples": 4096, "shadow_samples": 256},
    ],
    "sky rays": [{"samples": count} for count in (16, 64, 256, 1024, 4096)],
    "shadow points": [{"shadow_samples": count} for count in (1, 4, 16, 64)],
    "reflections": [{"max_bounces": count} for count in range(6)],
}
SUNS = {  # of Midtown only: the town's are given
    "days": ["days:4", "days:12", "days:24", "days:52"],
    "typical days": ["typical-days:4", "typical-days:12", "typical-days:52"],
    "sky grid": ["sky-grid:169", "sky-grid:673", "sky-grid:1654"],
    "hourly": ["hourly"],
}
PRESETS = {
    "draft": (64, 4, "days:12"),
    "standard": (256, 16, "days:24"),
    "reference": (1024, 64, "days:52"),
}
# [%] of rounds to a target, on 95 % of the area
TARGETS = {
    "town": (2.0, 1.4, 1.0),
    "midtown": (3.5, 2.0, 1.4),
}
# from each patch, the fewest; four times as many take four times as long for half of the error
PHOTONS = (4,)
PEERS = {
    "mitsuba": ((16, 1), (64, 4), (256, 16), (1024, 64), (4096, 256)),  # rays, points
    "mitsuba sky rays": ((16, 16), (64, 16), (1024, 16), (4096, 16)),
    "radiance": ((4, 4), (8, 8), (16, 16)),  # points, ambient rays from each
}
CURVES = [*LADDERS, *SUNS, "presets", "rounds", "targets", "forward", *PEERS]
NAMES = {  # in the legend, of curves whose own names do not say it
    "samples": "Rays and points",
    "rounds": "Rounds of 64 rays",
    "days": "Days traced",
    "mitsuba": "Mitsuba, rays and points",
    "mitsuba sky rays": "Mitsuba, sky rays",
}
MARKS = "osv^DPX*hp<>dH8"  # as many as curves


class Town:
    """The town and its reference."""

    name = "town"

    def __init__(self, options):
        self.traced = {}
        self.known = np.load(TOWN)
        self.scene = join_parts([(self.known["vertices"], self.known["triangles"])])
        count = len(self.known["sun"])
        axis = np.zeros(count, np.int32), np.arange(count)
        self.given = Suns("hourly", self.known["sun"], np.full(count, 1 / count), *axis)
        self.words = f"{len(self.scene.triangles):,} triangles, {count} suns"
        self.wanted = np.ones(len(self.scene.triangles), bool)
        self.file = TOWN  # for peers

    def suns(self, way):
        """Its own, whatever the way."""
        return self.given

    def error(self, transfer):
        """Root mean square error of the light of a year, in percent of its mean."""
        known, chosen = self.known, self.known["triangle"]
        cosine = np.maximum(self.scene.surfaces.normal[chosen] @ known["sun"].T, 0)
        found = (cosine * transfer.visible_share[chosen] + transfer.direct_reflected[chosen]).mean(
            axis=1
        )
        true = (known["direct"] + known["direct_reflected"]).mean(axis=1) + known["diffuse"]
        return relative_rms(
            found + transfer.diffuse_relative[chosen], true + known["diffuse_reflected"]
        )


class Midtown:
    """The square of Midtown and its reference."""

    name = "midtown"

    def __init__(self, options):
        self.traced = {}
        self.scene, self.weather = accuracy_midtown.read_square()
        apart = accuracy_midtown.set_apart(self.scene)
        self.chosen, self.light, noise, hidden = accuracy_midtown.reference(
            apart, self.weather, options.paths
        )
        suns = self.suns("days:24")
        self.words = f"{len(self.scene.triangles):,} triangles, {len(suns)} suns"
        self.wanted = self.scene.surfaces.eligible
        self.file = accuracy_midtown.write_scene(apart, suns, self.chosen, self.light)
        share = 100 * np.sqrt(np.mean(noise**2)) / self.light.mean()
        words = (
            f"rms of {len(self.chosen)} triangles; {hidden} drawn beside them lie partly inside "
            "something"
        )
        print(f"midtown: noise of the reference {share:.2f} % ({words})", flush=True)

    def suns(self, way):
        """As a run chooses them."""
        year = (
            self.weather.data.index,
            self.weather.interval,
            self.weather.latitude,
            self.weather.longitude,
        )
        return choose_suns(way, *year, position=self.weather.data).progressive_order()

    def error(self, transfer):
        """The same as of the town; cosines are those of every hour, as in a run."""
        energy = compute_energy(transfer, self.weather, threads=1)
        found = energy.direct_relative_annual + transfer.diffuse_relative
        return relative_rms(found[self.chosen], self.light)


def relative_rms(found, true):
    """Root mean square difference in percent of the mean."""
    return 100 * float(np.sqrt(np.mean((found - true) ** 2)) / true.mean())


def run(city, trace, changes, threads, way="days:24"):
    """Processor seconds of tracing, and error [%]; of settings that this run has traced before,
    these numbers.
    """
    request, suns = Request(**{**SETTINGS, **changes}, threads=threads), city.suns(way)
    key = trace.__name__, suns.sampling, str(request)
    if key not in city.traced:
        before = time.process_time()
        transfer = trace(city.scene, suns, request, silent)
        city.traced[key] = time.process_time() - before, city.error(transfer)
    return city.traced[key]


def run_rounds(city, threads):
    """The same after each of some rounds, the first of 64 rays and 4 points, that double."""
    request = Request(**{**SETTINGS, "samples": 64, "shadow_samples": 4}, threads=threads)
    before = time.process_time()
    suns = city.suns("days:24")
    prepared = replace(
        prepare_scene(city.scene, request, suns=suns).build_tree(request), rounds=True
    )
    run = trace_run(city.scene, None, request, prepared=prepared)
    spent = time.process_time() - before
    yield "1 × 64 rays, 4 points", spent, city.error(run.transfer)
    for _ in range(ROUNDS - 1):
        before = time.process_time()
        run = run.add_round(run.transfer.record.rounds)
        spent += time.process_time() - before
        yield f"{run.transfer.record.rounds} × 64 rays, 4 points", spent, city.error(run.transfer)


def run_targets(city, threads):
    """The same of rounds to some targets, the first of 256 rays and 16 points."""
    request = Request(**SETTINGS, threads=threads)
    targets = TARGETS[city.name]
    for target, transfer, spent in refine_to(
        targets, city.scene, city.suns("days:24"), request, city.wanted
    ):
        yield f"to {target:g} % on 95 % of the area", spent, city.error(transfer)


def run_peer(curve, file, numbers, threads):
    """Processor seconds and error [%] of a peer on the triangles and suns of a file."""
    name = curve.split()[0]
    names = ("samples", "shadow-samples") if name == "mitsuba" else ("points", "divisions")
    command = [
        sys.executable,
        ROOT / "benchmarks" / "peers" / f"{name}.py",
        "--json",
        "--threads",
        threads,
    ]
    command += ["--scene", file, *(["--runs", 1] if name == "mitsuba" else [])]
    for option, value in zip(names, numbers, strict=True):
        command += [f"--{option}", value]
    done = subprocess.run(
        [str(word) for word in command], check=True, stdout=subprocess.PIPE, text=True
    )
    found = json.loads(done.stdout)
    before = found["scene_seconds" if name == "mitsuba" else "octree_seconds"]
    return before + found["cpu_whole"], found["year"]


def points_of(city, curve, threads):
    """Label, processor seconds and error [%] of each point of a curve, one after the other."""
    if curve in LADDERS:
        for changes in LADDERS[curve]:
            words = ", ".join(
                f"{value} {name.replace('_', ' ')}" for name, value in changes.items()
            )
            yield words, *run(city, trace_gather, changes, threads)
    elif curve in SUNS and city.name == "midtown":
        for way in SUNS[curve]:
            yield way, *run(city, trace_gather, {}, threads, way)
    elif curve == "presets" and city.name == "midtown":
        for name, (samples, points, way) in PRESETS.items():
            yield (
                name,
                *run(
                    city, trace_gather, {"samples": samples, "shadow_samples": points}, threads, way
                ),
            )
    elif curve == "rounds":
        yield from run_rounds(city, threads)
    elif curve == "targets":
        yield from run_targets(city, threads)
    elif curve == "forward":
        for photons in PHOTONS:
            yield (
                f"forward, {photons} photons",
                *run(city, trace_forward, {"samples": photons}, threads),
            )
    elif curve in PEERS:
        for numbers in PEERS[curve]:
            words = ("points", "ambient rays") if curve == "radiance" else ("rays", "points")
            label = ", ".join(
                f"{number} {word}" for number, word in zip(numbers, words, strict=True)
            )
            yield label, *run_peer(curve, city.file, numbers, threads)


def read_kept(path):
    """What was measured before: city -> curve -> label -> list of (seconds, error)."""
    return json.loads(path.read_text()) if path.exists() else {}


def keep(path, kept, city, curve, found):
    """Add a run, and write all."""
    label, *numbers = found
    kept.setdefault(city, {}).setdefault(curve, {}).setdefault(label, []).append(numbers)
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps(kept, indent=1))


def medians(kept, city):
    """Curve -> list of label, median seconds, median error [%], runs."""
    found = {}
    for curve, points in kept.get(city, {}).items():
        middle = [[median(part) for part in zip(*runs, strict=True)] for runs in points.values()]
        found[curve] = [
            (label, *pair, len(points[label])) for label, pair in zip(points, middle, strict=True)
        ]
    return found


def draw(curves, path, words):
    """Write the picture: error against processor seconds."""
    with plain_style():
        figure = make_figure(9, 5)
        axes = figure.subplots()
        for mark, label in zip(MARKS, sorted(curves, key=CURVES.index), strict=False):
            _, seconds, errors, _ = zip(*curves[label], strict=True)
            name, line = NAMES.get(label, label.capitalize()), "--" if label in PEERS else "-"
            axes.plot(seconds, errors, marker=mark, label=name, linestyle=line)
        make_logarithmic(axes)
        axes.set_xlabel(f"Processor seconds of tracing, {words}")
        axes.set_ylabel("Error of the light of a year, rms over triangles [%]")
        figure.legend(loc="outside right upper")
        figure.savefig(path, dpi=DOTS)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--city", nargs="+", choices=("town", "midtown"), default=["town", "midtown"]
    )
    parser.add_argument(
        "--only", nargs="*", choices=CURVES, default=CURVES, help="curves; none: table and picture"
    )
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument(
        "--paths",
        type=int,
        default=1 << 16,
        help="from each triangle of Midtown, for its reference",
    )
    parser.add_argument(
        "--points", type=int, help="no more of each curve, from the cheapest on; all if not given"
    )
    parser.add_argument(
        "--kept", type=Path, default=KEPT, help="file of all runs (build/accuracy.json)"
    )
    parser.add_argument("--plot", type=Path, help="pictures PLOT.png of the town, PLOT_midtown.png")
    options = parser.parse_args()
    kept = read_kept(options.kept)
    for name in options.city:
        city = (Town if name == "town" else Midtown)(options)
        if options.only:
            # compiles
            run(city, trace_gather, {"samples": 16, "shadow_samples": 1}, options.threads, "days:4")
        for _ in range(options.runs):
            city.traced = {}
            for curve in options.only:
                for found in islice(points_of(city, curve, options.threads), options.points):
                    keep(options.kept, kept, name, curve, found)
        curves = medians(kept, name)
        print("| city | curve | settings | s | error, % | runs |\n|---|---|---|--:|--:|--:|")
        for curve, points in curves.items():
            for label, seconds, error, runs in points:
                print(f"| {name} | {curve} | {label} | {seconds:.3g} | {error:.3g} | {runs} |")
        if options.plot:
            draw(curves, f"{options.plot}{'' if name == 'town' else '_midtown'}.png", city.words)


if __name__ == "__main__":
    main()
