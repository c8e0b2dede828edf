"""What each effect costs and what it is worth: seconds and full load hours with everything on, as planned, and without.

    python benchmarks/effects.py CITY [CITY …] [--suns days:24] [--latitude D --longitude D] [--patch-size M] [--brief]

Everything on means that nothing is left out and nothing is spared: a ray wherever one could be sent, all surfaces
sampled alike, eight reflections. The other rows are the plan's choice, and the plan with one effect switched (off, or
on where the plan has it off). Seconds are processor seconds of one thread, for tracing and for the pilot, so that other
work on the machine counts little; reading and electricity are the same for all. A group is a kind and orientation.
"""

import argparse
import time
from pathlib import Path

import numpy as np

from citypv.core.effects.table import TABLE
from citypv.core.energy.pv_system import ELECTRIC
from citypv.core.request import Request
from citypv.core.study import compute_energy, prepare_study, read_scene, read_year, trace_scene

SPARING = ("receivers", "reflectors")  # change the time, and at most the noise
WASTING = ("sky-rays", "shadow-rays")  # switched on, they send rays that are known to be free
BOUNCES = 8


def main():
    """Print one table for each city, in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("city", nargs="+", type=Path)
    parser.add_argument("--suns", default="days:24")
    parser.add_argument("--weather", default="climate")
    parser.add_argument("--latitude", type=float)
    parser.add_argument("--longitude", type=float)
    parser.add_argument("--patch-size", type=float, default=10.0)
    parser.add_argument("--brief", action="store_true", help="everything on and the plan's choice only")
    options = parser.parse_args()
    settings = {name: getattr(options, name) for name in ("suns", "weather", "latitude", "longitude", "patch_size")}
    for path in options.city:
        scene = read_scene([path], Request(**settings, threads=1))
        weather = read_year(scene.site, Request(**settings, threads=1))
        compare(path.stem, scene, weather, settings, brief=options.brief)


def compare(title, scene, weather, settings, *, brief):
    """Run a city with everything on, as planned and with single effects switched; print each row when it is done."""
    print(f"\n{title}: {len(scene.surfaces):,} surfaces, {int(scene.surfaces.eligible.sum()):,} of them eligible\n")
    print("| run | seconds | share | full load hours | off by | worst group |\n|---|--:|--:|--:|--:|--:|", flush=True)
    everything = {key: key not in SPARING for key in TABLE if key in (*SPARING, *WASTING)}
    run(scene, weather, {**settings, "samples": 4, "shadow_samples": 4, "suns": "days:1"})  # compiles the loops
    whole = run(scene, weather, {**settings, "report": "all", "max_bounces": BOUNCES, "effects": everything})
    show("everything on", whole, whole)
    planned = run(scene, weather, {**settings, "max_bounces": None})
    show("the plan's choice", planned, whole)
    for key, on in {} if brief else planned["on"].items():
        effects = {"effects": {key: not on}, "max_bounces": None}
        of_modules = key in ELECTRIC
        row = run(scene, weather, {**settings, **effects}, transfer=planned["transfer"] if of_modules else None)
        show(f"{key} {'off' if on else 'on'}", {**row, "seconds": planned["seconds"]} if of_modules else row, whole)


def run(scene, weather, settings, transfer=None):
    """One run: dict with seconds, full load hours by group, areas, the effects' states and the Transfer."""
    request = Request(**settings, threads=1)
    started = time.process_time()
    if transfer is None:
        prepared = prepare_study(scene, weather, request)
        transfer = trace_scene(scene, weather, request, prepared=prepared)
    seconds = time.process_time() - started
    energy = compute_energy(transfer, weather, request)
    hours = energy.capacity_factor.sum(axis=0) * energy.interval.total_seconds() / 3600 / energy.years
    on = {effect["key"]: effect["on"] for effect in transfer.record.effects}
    return {"seconds": seconds, "hours": hours, "area": energy.group_area, "on": on, "transfer": transfer}


def show(name, row, whole):
    """Print a row: seconds, their share of everything's, full load hours, and how far they are off, also by group."""
    mean, expected = (np.average(one["hours"], weights=one["area"]) for one in (row, whole))
    worst = np.abs(row["hours"] / whole["hours"] - 1).max()
    share = row["seconds"] / whole["seconds"]
    figures = f"{row['seconds']:.1f} | {share:.0%} | {mean:.1f} | {mean / expected - 1:+.2%} | {worst:.2%}"
    print(f"| {name} | {figures} |", flush=True)


if __name__ == "__main__":
    main()
