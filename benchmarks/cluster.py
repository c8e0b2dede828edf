"""A city in tiles: seconds and memory by its size, and the efficiency of two workers.

    python benchmarks/cluster.py growth --sides 1 3 7 --out berlin.json
                                                               a city file repeated side by side;
                                                               some tiles are traced
    python benchmarks/cluster.py plot berlin.json the_hague.json --out growth.png
    python benchmarks/cluster.py efficiency --side 2           one and two workers, by the clock, on a quiet machine
    python benchmarks/cluster.py ground --sides 1 4            reading side² files against building their ground

Seconds of `growth` and `ground` are processor seconds of one thread. `growth` reads, places and
cuts the whole city, and writes every tile to disk; it traces the sample.
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

from citypv.core.city import lay_ground
from citypv.core.city.build_ground import build_ground
from citypv.core.results.write_summary import peak_memory
from citypv.core.run.study import make_located_scene, read_buildings, read_year
from citypv.core.run.tiles import assign_tiles, prepare_whole
from citypv.core.run.trace_part import trace_part
from citypv.core.run.trace_tiles import ClusterSettings, make_tasks, plan_tiles, trace_tiles
from citypv.core.settings.request import Request

CITY = Path(__file__).parent.parent / "examples" / "berlin" / "berlin_3910_5817.gml"
GAP = 10.0  # [m] between copies


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("growth", "plot", "efficiency", "ground"))
    parser.add_argument("files", nargs="*", help="of growth --out, to plot")
    parser.add_argument("--city", default=str(CITY))
    parser.add_argument("--sides", type=int, nargs="+", default=[1, 2, 4])
    parser.add_argument("--side", type=int, default=2)
    parser.add_argument("--tile", type=float, default=1000.0)
    parser.add_argument("--sample", type=int, default=2, help="tiles traced of each city")
    parser.add_argument("--latitude", type=float)
    parser.add_argument("--longitude", type=float)
    parser.add_argument("--name", help="of the city in the plot")
    parser.add_argument("--out", help="file of figures of growth, or of the plot")
    options = parser.parse_args()
    if options.what == "plot":
        return draw_growth(options.files, options.out)
    request = Request(threads=1, latitude=options.latitude, longitude=options.longitude)
    city = read_buildings([options.city], request)
    {"growth": measure_growth, "efficiency": measure_efficiency, "ground": measure_ground}[
        options.what
    ](city, request, options)


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
        points=np.concatenate(
            [city.points + np.array([x * step[0], y * step[1], 0]) for x, y in places]
        ),
        ring_start=starts(city.ring_start),
        polygon_start=starts(city.polygon_start),
        lod=city.lod and city.lod * len(places),
        material=city.material and city.material * len(places),
    )
    return repeated, float(step.prod()) * len(places) / 1e6


def measure_growth(city, request, options):
    print(
        "km2  triangles  tiles | read, place, cut s/km2, peak MB | in a tile: own of all, s/km2 of "
        "its own, peak MB"
    )
    rows = []
    for side in options.sides:
        rows.append(grow(city, side, request, options))
        print(
            "{area:5.1f} {triangles:9,} {tiles:5} | {read:.2f} {place:.2f} {cut:.2f}, "
            "{client_peak:,.0f} | "
            "{own_triangles:,} of {tile_triangles:,}, {trace:6.1f}, {worker_peak:,.0f}".format(
                **rows[-1]
            ),
            flush=True,
        )
        if options.out:
            Path(options.out).write_text(
                json.dumps({"name": options.name or Path(options.city).stem, "rows": rows})
            )


def grow(city, side, request, options):
    """Figures of a city, side × side times: read, placed and cut into tiles on disk; a sample of
    tiles is traced.
    """
    clock = [time.process_time()]

    def lap():
        clock.append(time.process_time())
        return clock[-1] - clock[-2]

    read_buildings([options.city], request)
    read = lap() * side**2
    whole, area = repeat_city(city, side)
    lap()
    scene = make_located_scene(whole, request)
    del whole
    place = lap()
    weather = read_year(scene.site, request)
    settings = ClusterSettings("serial", options.tile)
    prepared = plan_tiles(scene, weather, request, settings, lambda line: None)
    lap()
    scene = prepare_whole(prepared.scene)
    squares = assign_tiles(scene, options.tile)
    sample = pick(squares, options.sample)
    with tempfile.TemporaryDirectory() as folder:
        chosen, wanted = [], {name for name, _ in sample}
        for task in make_tasks(
            scene, squares, (prepared, weather, request, settings), Path(folder), (set(), [])
        ):
            part = Path(task[1])
            if part.name.rpartition("_")[0] in wanted:
                chosen.append(task)
            else:
                part.unlink()  # written as in a run, but the disk need not hold them all
        cut = lap()
        peak = peak_memory() / 1e6
        figures = [run_alone(task) for task in chosen]
    # of the city's area, by surfaces
    share = sum(len(rows) for _, rows in sample) / len(scene.surfaces)
    return {
        "side": side,
        "area": area,
        "triangles": len(scene.triangles),
        "surfaces": len(scene.surfaces),
        "tiles": len(squares),
        "read": read / area,
        "place": place / area,
        "cut": cut / area,
        "client_peak": peak,
        "own_triangles": sum(one["own_triangles"] for one in figures),
        "tile_triangles": sum(one["triangles"] for one in figures),
        "trace": sum(one["processor_seconds"] for one in figures) / (share * area),
        "worker_peak": max(one["peak_memory_bytes"] for one in figures) / 1e6,
    }


def draw_growth(files, out):
    """Seconds per km², and peak memory of a worker and of the process that cuts, by area."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (left, right) = pyplot.subplots(1, 2, figsize=(9, 3.6), constrained_layout=True)
    for number, file in enumerate(files):
        found = json.loads(Path(file).read_text("utf-8"))
        area = [row["area"] for row in found["rows"]]
        colour = f"C{number}"
        left.loglog(
            area,
            [row["trace"] for row in found["rows"]],
            "o-",
            color=colour,
            label=f"{found['name']}: trace",
        )
        prepare = [row["read"] + row["place"] + row["cut"] for row in found["rows"]]
        left.loglog(area, prepare, "s--", color=colour, label=f"{found['name']}: read, place, cut")
        right.loglog(area, [row["worker_peak"] for row in found["rows"]], "o-", color=colour)
        right.loglog(area, [row["client_peak"] for row in found["rows"]], "s--", color=colour)
    right.plot([], [], "o-", color="0.3", label="worker")
    right.plot([], [], "s--", color="0.3", label="process that reads, places and cuts")
    left.set(xlabel="area [km²]", ylabel="processor seconds per km²")
    right.set(xlabel="area [km²]", ylabel="peak memory [MB]")
    for axes in (left, right):
        axes.set_ylim(top=10 * axes.get_ylim()[1])  # room for the legend
        axes.legend(fontsize=7, handlelength=4, loc="upper left")
    figure.savefig(out, dpi=120)


def pick(squares, count):
    """Tiles with the median number of surfaces and above, spread evenly over their list."""
    sizes = np.array([len(rows) for _, rows in squares])
    full = np.flatnonzero(sizes >= np.median(sizes))
    return [
        squares[one]
        for one in np.unique(
            full[np.linspace(0, len(full) - 1, count + 2).round().astype(int)[1:-1]]
        )
    ]


def run_alone(task):
    """Figures of a tile that a process of its own has traced."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        result = pool.submit(trace_part, *task).result()
    return json.loads(Path(result).with_suffix(".json").read_text("utf-8"))


def measure_efficiency(city, request, options):
    whole, area = repeat_city(city, options.side)
    scene = make_located_scene(whole, request)
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
    print(
        f"{area:.1f} km2: 1 worker {one:.1f} s, 2 workers {two:.1f} s, efficiency "
        f"{one / two / 2:.0%}"
    )


class GroundBuiltError(Exception):
    """Ends the placing of a city after what is measured."""


def measure_ground(city, request, options):
    for side in options.sides:
        started = time.process_time()
        for _ in range(side**2):
            read_buildings([options.city], request)
        read = time.process_time() - started
        whole, _ = repeat_city(city, side)

        def timed(*arguments, **more):
            started = time.process_time()
            build_ground(*arguments, **more)
            raise GroundBuiltError(time.process_time() - started)

        lay_ground.build_ground = timed
        try:
            make_located_scene(whole, request)
        except GroundBuiltError as built:
            print(
                f"{side**2} tiles: reading {read:.2f} s, ground {built.args[0]:.2f} s", flush=True
            )


if __name__ == "__main__":
    main()
