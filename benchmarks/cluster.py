"""A city in tiles: seconds and memory by its size, and the efficiency of two workers.

    python benchmarks/cluster.py growth --sides 1 2 4 7        a city file repeated side by side; some tiles are traced
    python benchmarks/cluster.py efficiency --side 2           one and two workers, by the clock, on a quiet machine
    python benchmarks/cluster.py ground --sides 1 4            reading side² files against building their ground

Seconds of `growth` and `ground` are processor seconds of one thread.
"""

import argparse
import json
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from citypv.core.cluster.plan_tiles import plan_tiles
from citypv.core.cluster.take_part import prepare_whole
from citypv.core.cluster.tiles import assign_tiles
from citypv.core.cluster.trace_part import trace_part
from citypv.core.cluster.trace_tiles import ClusterSettings, make_tasks, trace_tiles
from citypv.core.ground.build_ground import build_ground
from citypv.core.request import Request
from citypv.core.scene import build_scene as building
from citypv.core.study import place_city, read_buildings, read_year

CITY = Path(__file__).parent.parent / "examples" / "berlin" / "berlin_3910_5817.gml"
GAP = 10.0  # [m] between copies


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("growth", "efficiency", "ground"))
    parser.add_argument("--city", default=str(CITY))
    parser.add_argument("--sides", type=int, nargs="+", default=[1, 2, 4])
    parser.add_argument("--side", type=int, default=2)
    parser.add_argument("--tile", type=float, default=1000.0)
    parser.add_argument("--sample", type=int, default=2, help="tiles traced of each city")
    options = parser.parse_args()
    request = Request(threads=1)
    city = read_buildings([options.city], request)
    {"growth": measure_growth, "efficiency": measure_efficiency, "ground": measure_ground}[options.what](
        city, request, options
    )


def repeat_city(city, side):
    """The city side × side times, on a grid."""
    step = np.ceil(np.ptp(city.points[:, :2], axis=0)) + GAP
    places = [(x, y) for y in range(side) for x in range(side)]
    names = [f"_{x}_{y}" for x, y in places]

    def starts(one):
        return np.concatenate([[0], *[one[1:] + number * one[-1] for number in range(len(places))]])

    repeated = replace(
        city,
        surface_id=[name + end for end in names for name in city.surface_id],
        building_id=[name + end for end in names for name in city.building_id],
        thematic=city.thematic * len(places),
        points=np.concatenate([city.points + np.array([x * step[0], y * step[1], 0]) for x, y in places]),
        ring_start=starts(city.ring_start),
        polygon_start=starts(city.polygon_start),
        lod=city.lod and city.lod * len(places),
        material=city.material and city.material * len(places),
    )
    return repeated, float(step.prod()) * len(places) / 1e6


def measure_growth(city, request, options):
    print("km2  triangles  tiles | scene s/km2 | in a tile: own of all triangles, s/km2 of its own, peak MB")
    for side in options.sides:
        whole, area = repeat_city(city, side)
        started = time.process_time()
        scene = place_city(whole, request)
        built = time.process_time() - started
        weather = read_year(scene.site, request)
        settings = ClusterSettings("serial", options.tile)
        prepared = plan_tiles(scene, weather, request, settings, print)
        scene = prepare_whole(prepared.scene)
        squares = assign_tiles(scene, options.tile)
        sample = pick(squares, options.sample)
        with tempfile.TemporaryDirectory() as folder:
            found = []
            tasks = list(
                make_tasks(scene, sample, (prepared, weather, request, settings), Path(folder), (set(), found))
            )
            figures = [run_alone(task) for task in tasks]
        share = sum(len(rows) for _, rows in sample) / len(scene.surfaces)  # of the city's area, by surfaces
        own, every = (sum(one[key] for one in figures) for key in ("own_triangles", "triangles"))
        seconds = sum(one["processor_seconds"] for one in figures)
        peak = max(one["peak_memory_bytes"] for one in figures) / 1e6
        print(
            f"{area:5.1f} {len(scene.triangles):9,} {len(squares):5} | {built / area:6.1f} | "
            f"{own:,} of {every:,}, {seconds / (share * area):6.1f}, {peak:,.0f}",
            flush=True,
        )


def pick(squares, count):
    """Tiles with the median number of surfaces and above, spread evenly over their list."""
    sizes = np.array([len(rows) for _, rows in squares])
    full = np.flatnonzero(sizes >= np.median(sizes))
    return [squares[one] for one in np.unique(full[np.linspace(0, len(full) - 1, count + 2).round().astype(int)[1:-1]])]


def run_alone(task):
    """Figures of a tile that a process of its own has traced."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        result = pool.submit(trace_part, *task).result()
    return json.loads(Path(result).with_suffix(".json").read_text("utf-8"))


def measure_efficiency(city, request, options):
    whole, area = repeat_city(city, options.side)
    scene = place_city(whole, request)
    weather = read_year(scene.site, request)
    seconds = {}
    for count in (1, 2, 1, 2):
        settings = ClusterSettings(f"local:{count}", options.tile)
        prepared = plan_tiles(scene, weather, request, settings, print)
        with tempfile.TemporaryDirectory() as folder:
            started = time.monotonic()
            trace_tiles(prepared, weather, request, settings, folder, tell=lambda line: None)
            seconds.setdefault(count, []).append(time.monotonic() - started)
    one, two = (min(seconds[count]) for count in (1, 2))
    print(f"{area:.1f} km2: 1 worker {one:.1f} s, 2 workers {two:.1f} s, efficiency {one / two / 2:.0%}")


def measure_ground(city, request, options):
    for side in options.sides:
        started = time.process_time()
        for _ in range(side**2):
            read_buildings([options.city], request)
        read = time.process_time() - started
        whole, _ = repeat_city(city, side)
        spent = []

        def timed(*arguments, spent=spent, **more):
            started = time.process_time()
            found = build_ground(*arguments, **more)
            spent.append(time.process_time() - started)
            return found

        building.build_ground = timed
        place_city(whole, request)
        print(f"{side**2} tiles: reading {read:.2f} s, ground {spent[0]:.2f} s")


if __name__ == "__main__":
    main()
