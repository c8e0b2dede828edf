"""Trees: predicted against measured light below forests, and full load hours of a block with and
without its trees.

    python benchmarks/trees.py stands PLOT.inv…
    python benchmarks/trees.py city CITY… [--weather FILE] [--samples N] [--shadow-samples M]
    [--threads N]

`stands` repeats each plot around itself and prints means, rank correlation and spread of the light
at its sensors (total, diffuse, direct), from May to October under the built-in climate. `city` cuts
the walls into cells of a storey and prints the full load hours of eligible surfaces that stand
among the trees.
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "core"))
from forest_stand import predict_light, read_stand, repeat_stand

from citypv.core.run.study import compute_energy, read_scene, read_year, trace_scene
from citypv.core.settings.request import Request

STOREY = 3.0  # [m]
PARTS = ("total", "diffuse", "direct")
STORIES = ("1", "2", "3", "4", "5", "6 and above")


def compare_stand(path, samples):
    """Print predicted and measured light of one plot."""
    stand = read_stand(path)
    print(
        f"{path.stem}: {len(stand.trees)} trees, {len(repeat_stand(stand))} with copies, "
        f"{len(stand.sensors)} sensors"
    )
    predicted, measured = predict_light(stand, samples=samples), stand.sensors[:, 4:7]
    print("| light | predicted | measured | difference | rank correlation | rms difference |")
    print("|---|--:|--:|--:|--:|--:|")
    for name, one, other in zip(PARTS, predicted.T, measured.T, strict=True):
        rank, rms = spearmanr(one, other).statistic, np.sqrt(((one - other) ** 2).mean())
        apart = one.mean() - other.mean()
        print(
            f"| {name} | {one.mean():.3f} | {other.mean():.3f} | {apart:+.3f} | {rank:.2f} | "
            f"{rms:.3f} |"
        )


def find_stories(scene):
    """Storey of each surface above the lowest point of its building, from 0: (n,) int; and its
    middle: (n, 3) [m].
    """
    own, count = scene.triangle_surface, len(scene.surfaces)
    mine = own >= 0
    middle, area = scene.vertices[scene.triangles[mine]].mean(axis=1), np.ones(mine.sum())
    places = np.column_stack(
        [np.bincount(own[mine], middle[:, axis] * area, count) for axis in range(3)]
    )
    places /= np.maximum(np.bincount(own[mine], area, count), 1)[:, None]
    building = np.unique(scene.surfaces.building_id, return_inverse=True)[1]
    lowest = np.full(building.max() + 1, np.inf)
    np.minimum.at(lowest, building[own[mine]], scene.vertices[scene.triangles[mine], 2].min(axis=1))
    return ((places[:, 2] - lowest[building]) // STOREY).astype(int), places


def compare_city(paths, settings):
    """Print full load hours of walls by storey and of roofs, without trees, with them, and what
    they take.
    """
    request = Request(grid_size=STOREY, **settings)
    scene = read_scene(paths, request)
    weather = read_year(scene.site, request)
    hours = {}
    for name, effects in (("without", {"trees": False}), ("with", {})):
        started = time.perf_counter()
        transfer = trace_scene(scene, weather, replace(request, effects=effects))
        energy = compute_energy(transfer, weather, request)
        hours[name] = (
            energy.full_load_hours,
            energy.full_load_hours_standard_error,
            energy.counted_area,
        )
        print(f"{name} trees: {time.perf_counter() - started:.1f} s")
    storey, places = find_stories(scene)
    low, high = scene.trees.vertices.min(axis=0), scene.trees.vertices.max(axis=0)
    among = ((places >= low) & (places <= high))[:, :2].all(axis=1) & energy.eligible
    wall = scene.surfaces.kind == "facade"
    rows = {
        name: wall & (np.minimum(storey, len(STORIES) - 1) == k) for k, name in enumerate(STORIES)
    }
    rows = {f"walls, storey {name}": chosen for name, chosen in rows.items()}
    print("| surfaces | area [m²] | without [h] | with [h] | loss | worst tenth loses at least |")
    print("|---|--:|--:|--:|--:|--:|")
    for name, kind in (rows | {"all walls": wall, "roofs": scene.surfaces.kind == "roof"}).items():
        chosen = kind & among
        if not chosen.any():
            continue
        area = hours["with"][2][chosen]
        bare, shaded = (
            np.average(hours[key][0][chosen], weights=area) for key in ("without", "with")
        )
        loss = 1 - hours["with"][0][chosen] / np.maximum(hours["without"][0][chosen], 1e-9)
        order = np.argsort(-loss)
        tenth = loss[order][np.searchsorted(np.cumsum(area[order]), 0.1 * area.sum())]
        print(
            f"| {name} | {area.sum():,.0f} | {bare:.0f} | {shaded:.0f} | {1 - shaded / bare:.1%} | "
            f"{tenth:.0%} |"
        )


def main():
    """Run one of the two comparisons."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("stands", "city"))
    parser.add_argument("paths", nargs="+", type=Path)
    parser.add_argument("--weather", default="climate")
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--shadow-samples", type=int, default=16)
    parser.add_argument("--threads", type=int)
    given = parser.parse_args()
    if given.what == "stands":
        for path in given.paths:
            compare_stand(path, max(given.samples, 4096))
        return
    settings = {
        "samples": given.samples,
        "shadow_samples": given.shadow_samples,
        "threads": given.threads,
    }
    compare_city(given.paths, {"weather": [given.weather], **settings})


if __name__ == "__main__":
    main()
