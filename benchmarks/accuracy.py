"""Error against time on the town of 91,764 triangles and 143 suns: what each setting buys, and what the peers need.

    python benchmarks/accuracy.py [--threads 1] [--plot docs/accuracy.png] [--forward 8 32] [--mitsuba]

The reference is that of tests/data/town.npz (3,000 triangles, noise 0.0004), which this program did not make. The error
is that of the light of a year, the mean over the suns plus that of the sky, as root mean square over the triangles in
percent of its mean; the three parts stand beside it. Time is processor time of tracing, so that other work on the
machine counts little; `--threads 1` keeps it from growing with waiting threads.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from tracer import SETTINGS, TOWN, measure_errors, run_mitsuba

from citypv.core.accuracy.refine import add_round
from citypv.core.commands.plain_scenes import join_parts
from citypv.core.photons.trace_forward import trace_forward
from citypv.core.plots.picture import DOTS, make_figure, make_logarithmic, plain_style
from citypv.core.progress import silent
from citypv.core.radiosity.trace_gather import trace_gather
from citypv.core.request import Request
from citypv.core.study import trace_round
from citypv.core.sun.suns import Suns
from citypv.core.transfer.patch_light import Round
from citypv.core.transfer.prepare_scene import build_tree, prepare_scene

LADDERS = {  # label -> settings, from cheap to dear
    "samples: rays and points": [
        {"samples": 64, "shadow_samples": 4},
        {"samples": 256, "shadow_samples": 16},
        {"samples": 1024, "shadow_samples": 64},
    ],
    "sky rays": [{"samples": count} for count in (64, 256, 1024)],
    "shadow points": [{"shadow_samples": count} for count in (4, 16, 64)],
    "reflections, 0 to 5": [{"max_bounces": count} for count in (0, 1, 2, 3, 5)],
}
MARKS = "osv^DPX*"


def year_of(scene, town, transfer):
    """Root mean square error of the light of a year, in percent of its mean."""
    chosen = town["triangle"]
    cosine = np.maximum(scene.surfaces.normal[chosen] @ town["sun"].T, 0)
    found = (cosine * transfer.visible_share[chosen] + transfer.direct_reflected[chosen]).mean(axis=1)
    found += transfer.diffuse_relative[chosen]
    known = (town["direct"] + town["direct_reflected"]).mean(axis=1) + town["diffuse"] + town["diffuse_reflected"]
    return 100 * float(np.sqrt(np.mean((found - known) ** 2)) / known.mean())


def run(trace, inputs, changes, threads):
    """Processor seconds of tracing, error [%] and parts."""
    scene, suns, town, seen = inputs
    key = trace.__name__, tuple(sorted(changes.items()))
    if key not in seen:
        request = Request(**{**SETTINGS, **changes}, threads=threads)
        before = time.process_time()
        transfer = trace(scene, suns, request, silent)
        seen[key] = time.process_time() - before, year_of(scene, town, transfer), measure_errors(scene, town, transfer)
    return seen[key]


def run_rounds(inputs, count, threads):
    """The same after each of some rounds, the first of 64 rays and 4 points, that double; with their samples."""
    scene, suns, town, _ = inputs
    request = Request(**{**SETTINGS, "samples": 64, "shadow_samples": 4}, threads=threads)
    before, found = time.process_time(), []
    prepared = replace(build_tree(prepare_scene(scene, request), request), round=Round())
    total = trace_gather(scene, suns, request, silent, prepared=prepared)
    spent = time.process_time() - before
    found.append((1, spent, year_of(scene, town, total), measure_errors(scene, town, total)))
    for _ in range(count - 1):
        before = time.process_time()
        part = Round(total.record.rounds)
        total = add_round(total, trace_round(scene, total, request, part, prepared=prepared))
        spent += time.process_time() - before
        found.append((total.record.rounds, spent, year_of(scene, town, total), measure_errors(scene, town, total)))
    return found


def describe(label, seconds, error, parts):
    """One line of the table."""
    words = " ".join(f"{parts[name]:8.4f}" for name in ("direct", "reflected", "diffuse"))
    return f"{label:52} {seconds:8.1f} {error:7.2f} {words}"


def draw(curves, path):
    """Write the picture: error against processor seconds."""
    with plain_style():
        figure = make_figure(8, 5)
        axes = figure.subplots()
        for mark, (label, points) in zip(MARKS, curves.items(), strict=False):
            axes.plot(*zip(*points, strict=True), marker=mark, label=label)
        make_logarithmic(axes)
        axes.set_xlabel("Processor seconds of tracing, 91,764 triangles, 143 suns")
        axes.set_ylabel("Error of the light of a year, rms over triangles [%]")
        axes.legend()
        figure.savefig(path, dpi=DOTS)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--plot", type=Path)
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--forward", type=int, nargs="*", default=[], help="photons per patch; minutes")
    parser.add_argument("--mitsuba", action="store_true", help="also run the peer (see peers/mitsuba.py)")
    options = parser.parse_args()
    town = np.load(TOWN)
    scene = join_parts([(town["vertices"], town["triangles"])])
    count = len(town["sun"])
    suns = Suns("hourly", town["sun"], np.full(count, 1 / count), np.zeros(count, np.int32), np.arange(count))
    inputs, curves = (scene, suns, town, {}), {}
    trace_gather(scene, suns, Request(**{**SETTINGS, "samples": 64, "shadow_samples": 4}), silent)  # compiles
    print(f"{'':52} {'seconds':>8} {'year, %':>7} {'direct':>8} {'reflect.':>8} {'diffuse':>8}")

    def note(curve, label, found):
        curves.setdefault(curve, []).append(found[:2])
        print(describe(label, *found), flush=True)

    for curve, ladder in LADDERS.items():
        for changes in ladder:
            words = ", ".join(f"{name} {value}" for name, value in changes.items())
            note(curve, f"gather, {words}", run(trace_gather, inputs, changes, options.threads))
    for times, *found in run_rounds(inputs, options.rounds, options.threads):
        note("rounds", f"rounds, together {times * 64} rays and {times * 4} points", found)
    for photons in options.forward:
        note(
            "forward", f"forward, {photons} photons", run(trace_forward, inputs, {"samples": photons}, options.threads)
        )
    if options.mitsuba:
        found = run_mitsuba(options.threads)
        print(f"Mitsuba 3 as ray engine: {found['whole']:.1f} s of wall time, {found['rms']}")
    if options.plot:
        draw(curves, options.plot)


if __name__ == "__main__":
    main()
