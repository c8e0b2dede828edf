"""What each effect costs and what it is worth: seconds and full load hours with everything on, as
planned, and without.

    python benchmarks/effects.py CITY [CITY …] [--brief] [--runs N] [--suns days:24] [--sky auto]
    [--patch-size M]
                                 [--latitude D --longitude D]

Everything on means that nothing is left out and nothing is spared: rays from all patches to the
whole sky and to every sun in front of them, all surfaces sampled alike, eight reflections. The
other rows are the plan's choice, and the plan with one effect switched off; two more show what
everything on would take with rays to suns behind the faces as well, and with no more reflections
than the plan's. Seconds are processor seconds of one thread, for tracing and for the pilot, medians
of interleaved runs, so that other work on the machine counts little; reading and electricity are
the same for all. A group is a kind and orientation. `--brief` prints the first of the tables.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np

from citypv.core.effects.table import TABLE
from citypv.core.energy.pv_system import ELECTRIC
from citypv.core.run.study import compute_energy, prepare_study, read_scene, read_year, trace_scene
from citypv.core.settings.request import Request

BOUNCES = 8
EVERYTHING = {"sky-rays": True, "receivers": False}  # the others are on where they are called for
BEHIND = {**EVERYTHING, "shadow-rays": True}
CITIES = (
    "| city | everything on [s] | the plan's choice [s] | share | off by | worst "
    "|\n|---|--:|--:|--:|--:|--:|"
)
ROWS = "| run | seconds | share | full load hours | off by | worst |\n|---|--:|--:|--:|--:|--:|"


def main():
    """Print the table of all cities, or one for each of them, in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("city", nargs="+", type=Path)
    parser.add_argument("--suns", default="days:24")
    parser.add_argument("--sky", default="auto")
    parser.add_argument("--weather", default="climate")
    parser.add_argument("--latitude", type=float)
    parser.add_argument("--longitude", type=float)
    parser.add_argument("--patch-size", type=float, default=10.0)
    parser.add_argument("--runs", type=int, default=1, help="of which the median seconds are taken")
    parser.add_argument(
        "--brief", action="store_true", help="everything on and the plan's choice only"
    )
    options = parser.parse_args()
    names = ("suns", "sky", "weather", "latitude", "longitude", "patch_size")
    settings = {name: getattr(options, name) for name in names}
    if options.brief:
        print(CITIES, flush=True)
    for path in options.city:
        scene = read_scene([path], Request(**settings, threads=1))
        weather = read_year(scene.site, Request(**settings, threads=1))
        compare(
            path.stem.split(".")[0], (scene, weather, settings), options.runs, brief=options.brief
        )


def compare(title, given, runs, *, brief):
    """Run a city in all ways, several times in turn, and print its row or its table."""
    scene, _, settings = given
    whole = {"report": "all", "max_bounces": BOUNCES, "effects": EVERYTHING}
    for ways in (whole, {}):  # compile the loops of both
        run(given, {**ways, "suns": "days:1"})
    planned = run(given, {})
    ways = {"everything on": whole, "the plan's choice": {}}
    if not brief:
        ways["everything on, and rays to suns behind faces"] = {**whole, "effects": BEHIND}
        ways[f"everything on, {planned['bounces']} reflections"] = {
            **whole,
            "max_bounces": planned["bounces"],
        }
        ways |= {f"`{key}` off": {"effects": {key: False}} for key in TABLE if planned["on"][key]}
    found = {}
    for turn in range(runs):
        for name, way in ways.items():
            electric = any(key in ELECTRIC for key in way.get("effects", ()))
            row = (
                run(given, way, planned["transfer"] if electric else None)
                if way or turn
                else planned
            )
            # which is large
            known = found.setdefault(name, {**row, "seconds": [], "transfer": None})
            known["seconds"] += (
                found["the plan's choice"]["seconds"][-1:] if electric else [row["seconds"]]
            )
            print(
                f"{title}, {name}: {known['seconds'][-1]:.1f} s ({turn + 1} of {runs})",
                file=sys.stderr,
                flush=True,
            )
    if brief:
        show_city(f"{title}, {settings['suns']}, patches of {settings['patch_size']:g} m", found)
        return
    eligible = int(scene.surfaces.eligible.sum())
    print(f"\n{title}: {len(scene.surfaces):,} surfaces, {eligible:,} of them eligible\n\n{ROWS}")
    for name, row in found.items():
        show_row(name, row, found["everything on"])


def run(given, way, transfer=None):
    """One run: dict with seconds, full load hours by group, areas, the effects' states and the
    Transfer.
    """
    scene, weather, settings = given
    request = Request(**{**settings, **way}, threads=1)
    started = time.process_time()
    if transfer is None:
        prepared = prepare_study(scene, weather, request)
        transfer = trace_scene(scene, weather, request, prepared=prepared)
    seconds = time.process_time() - started
    energy = compute_energy(transfer, weather, request)
    hours = (
        energy.capacity_factor.sum(axis=0) * energy.interval.total_seconds() / 3600 / energy.years
    )
    record = transfer.record
    on = {effect["key"]: effect["on"] for effect in record.effects}
    found = {
        "seconds": seconds,
        "hours": hours,
        "area": energy.group_area,
        "on": on,
        "bounces": record.max_bounces,
    }
    return {**found, "transfer": transfer}


def compare_with(row, whole):
    """Seconds over those of everything on, mean full load hours, and how far they are off, on
    average and at worst.
    """
    share = np.median(row["seconds"]) / np.median(whole["seconds"])
    mean, expected = (np.average(one["hours"], weights=one["area"]) for one in (row, whole))
    return share, mean, mean / expected - 1, np.abs(row["hours"] / whole["hours"] - 1).max()


def show_city(name, found):
    """Print the row of a city."""
    whole, planned = found["everything on"], found["the plan's choice"]
    share, _, off, worst = compare_with(planned, whole)
    seconds = " | ".join(f"{np.median(row['seconds']):.1f}" for row in (whole, planned))
    print(f"| {name} | {seconds} | {share:.0%} | {off:+.2%} | {worst:.2%} |", flush=True)


def show_row(name, row, whole):
    """Print the row of one way to run a city."""
    share, mean, off, worst = compare_with(row, whole)
    seconds = np.median(row["seconds"])
    print(
        f"| {name} | {seconds:.1f} | {share:.0%} | {mean:.1f} | {off:+.2%} | {worst:.2%} |",
        flush=True,
    )


if __name__ == "__main__":
    main()
