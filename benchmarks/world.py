"""Numbers of docs/validation/paper.md: the paper's at 10° E, what the shift in time costs, and the
cost of a place.

    python benchmarks/world.py A=DIR B=DIR C=DIR [--sky isotropic|perez] [--shift] [--cost]
    [--threads N]
    python benchmarks/world.py A=DIR B=DIR C=DIR --parallel     the United States between their coasts, along parallels
    python benchmarks/world.py CITY… --scatter 16               stated errors against traces with so many seeds
    python benchmarks/world.py unshaded --reading               seconds to read ERA5 on 0.25°, from a made file

The environments are folders of runs with --suns sky-grid:N. Without options: the table at 10° E,
under the built-in climate (off land the clear sky), with the sky of --sky and the default settings
else, and with --method paper.
"""

import argparse
import tempfile
import time
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray

from citypv.core.energy.pv_system import build_system, dc_system
from citypv.core.run.make_world import modules_alone
from citypv.core.run.study import read_scene, read_year, trace_scene
from citypv.core.settings.presets import METHODS
from citypv.core.settings.request import Request
from citypv.core.weather.grid_sources import Places, grid_places, grid_source, model_source
from citypv.core.weather.read_era5 import open_era5_grid
from citypv.core.world.compute_world import compute_world
from citypv.core.world.environment import build_environment, read_environments
from citypv.core.world.merge_surfaces import merge_surfaces

ERA5 = Path(__file__).parent.parent / "examples" / "berlin" / "era5_berlin_2017.nc"
VARIABLES = ("ssrd", "fdir", "t2m", "u10", "v10", "sp")
MERIDIAN = 10.0
SHIFT_LATITUDES, SHIFT_LONGITUDES = (
    np.array([-50.0, -30, 0, 20, 40, 60, 70, 80]),
    [2.0, 7.5, 10, 52.5, 97.5, 180 - 1e-6],
)
# from the Pacific to the Atlantic, without Mexico and Canada
PARALLELS = (
    34.0,
    36.0,
    38.0,
    39.0,
    40.0,
    41.0,
)
SHOWN = ["facade_south", "facade_east", "facade_west", "facade_north", "roof_south", "roof_east"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("environments", nargs="+", metavar="NAME=DIR")
    parser.add_argument(
        "--sky", choices=("isotropic", "perez"), default="isotropic", help="of the default settings"
    )
    parser.add_argument(
        "--shift", action="store_true", help="errors of the paper's shift by latitude and longitude"
    )
    parser.add_argument(
        "--cost",
        action="store_true",
        help="seconds per place against surfaces, and error of merging",
    )
    parser.add_argument("--parallel", action="store_true", help="south facades from coast to coast")
    parser.add_argument(
        "--scatter",
        type=int,
        metavar="SEEDS",
        help="trace a city again and again, on 145 directions",
    )
    parser.add_argument(
        "--reading", action="store_true", help="seconds per point of a file of ERA5"
    )
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    if options.scatter:
        print_scatter(options)
    elif options.reading:
        print_reading()
    elif options.parallel:
        print_parallel(options)
    elif options.shift:
        print_shift(options)
    elif options.cost:
        print_cost(options)
    else:
        print_meridian(options)


def print_meridian(options):
    places = grid_places(np.arange(0.0, 73.0), np.array([MERIDIAN]))
    for method, way in ((None, "exact"), ("paper", "paper")):
        request = modules_alone(Request(**METHODS.get(method, {}), method=method))
        wanted = "isotropic" if method else options.sky
        environments, sky = read_environments(
            [*options.environments, "unshaded"], build_system(request), wanted
        )
        source = model_source(places, "climate", request, "clear-sky")
        world = compute_world(
            environments, source, build_system(request), way, sky=sky, threads=options.threads
        )
        print(f"\n--method {method}, --way {way}, --sky {sky}")
        hours, plain = world.full_load_hours[..., 0], world.without_reflections[..., 0]
        groups = ["_".join(pair) for pair in world.groups]
        for number, name in enumerate(world.environments):
            row = hours[20, number]
            print(name, "20° N:", *(f"{group} {row[groups.index(group)]:,.0f}" for group in SHOWN))
            for group in ("facade_south", "facade_east"):
                own = (
                    hours[:, number, groups.index(group)] / plain[:, number, groups.index(group)]
                    - 1
                )
                print(
                    f"  gain of {group} from 0 to 72° N: {100 * own.min():.1f} to "
                    f"{100 * own.max():.1f} %"
                )
            east, south = (
                hours[:, number, groups.index(f"facade_{side}")] for side in ("east", "south")
            )
            crossing = np.flatnonzero(east < south)
            print(
                f"  south beats east from {places.latitude[crossing[0]]:g}° N on"
                if len(crossing)
                else "  never"
            )


def print_parallel(options):
    """Least, largest, and both coasts' full load hours along parallels of the United States, on
    land.
    """
    environments, _ = read_environments(
        [*options.environments, "unshaded"], dc_system(), options.sky
    )
    for north in PARALLELS:
        places = grid_places(np.array([north]), np.arange(-125.0, -65.0))
        source = model_source(places, "climate", Request())
        world = compute_world(
            environments, source, dc_system(), sky=options.sky, threads=options.threads
        )
        groups = ["_".join(pair) for pair in world.groups]
        for number, name in enumerate(world.environments):
            hours = world.full_load_hours[:, number, groups.index("facade_south"), 0]
            land = np.flatnonzero(np.isfinite(hours))
            hours, east = hours[land], places.longitude[land]
            low, high = hours.argmin(), hours.argmax()
            coasts, range_ = hours[[0, -1]], hours[[low, high]]
            print(
                f"{north:g}° N, {name}: coasts {hours[0]:,.0f} h ({east[0]:g}°), {hours[-1]:,.0f} "
                f"h ({east[-1]:g}°): "
                f"{100 * (coasts.max() / coasts.min() - 1):.0f} %; extremes {hours[low]:,.0f} h "
                f"({east[low]:g}°), {hours[high]:,.0f} h ({east[high]:g}°): "
                f"{100 * (range_[1] / range_[0] - 1):.0f} %"
            )


def print_reading():
    """Processor seconds to read the points of a made file of one year, beside those of the built-in
    climate.
    """
    north, east = 52 - np.arange(8) / 4, 9 + np.arange(32) / 4
    # as hard to pack as real data
    noise = np.random.default_rng(0).normal(1, 1e-3, (8760, 8, 32)).astype(np.float32)
    for title, chunks in (
        ("whole years of 32 points", (8760, 1, 32)),
        ("whole maps of 24 hours", (24, 8, 32)),
    ):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "era5.nc"
            with xarray.open_dataset(ERA5) as one:
                point = one.isel(latitude=0, longitude=0, drop=True)
                wide = (
                    point[list(VARIABLES)]
                    .expand_dims(latitude=north, longitude=east)
                    .transpose("time", ...)
                )
                wide = wide.astype(np.float32)
                wide[list(VARIABLES[2:])] *= (
                    noise  # of all but radiation, which is checked against the sun
                )
                settings = {"zlib": True, "complevel": 1, "shuffle": True, "chunksizes": chunks}
                wide.to_netcdf(path, engine="h5netcdf", encoding=dict.fromkeys(wide, settings))
            with ExitStack() as stack:
                grid = open_era5_grid([path], stack)
                places = grid_places(grid.latitude, grid.longitude)
                source = grid_source(
                    grid, places, (np.arange(len(north)), np.arange(len(east))), Request()
                )
                print(
                    f"{title}: {time_reading(source):.4f} s per point, "
                    f"{path.stat().st_size / 256e3:,.0f} kB each"
                )
    print(
        f"built-in climate: {time_reading(model_source(places, 'climate', Request())):.4f} s per "
        "point"
    )


def time_reading(source):
    """Processor seconds per place."""
    started = time.process_time()
    for chunk in source.chunks:
        source.read(chunk)
    return (time.process_time() - started) / len(source.places)


def print_scatter(options):
    """Scatter over seeds against stated errors of the year, its months and the gain, root mean
    square.
    """
    base = Request(threads=options.threads, suns="sky-grid:145", samples=64)
    scene = read_scene(options.environments, base)
    places = Places(np.array([52.0, 20.0]), np.array([13.0, 10.0]))
    source, worlds = model_source(places, "clear-sky", base), []
    for seed in range(1, options.scatter + 1):
        request = replace(base, seed=seed)
        transfer = trace_scene(scene, read_year(scene.site, request), request)
        environment = build_environment(str(seed), "trace", transfer, dc_system())
        worlds.append(compute_world([environment], source, dc_system(), threads=options.threads))
    periods = np.array([world.full_load_hours[..., :13] for world in worlds])
    gain = np.array(
        [world.full_load_hours[..., 0] / world.without_reflections[..., 0] for world in worlds]
    )
    for name, found, stated in (
        ("year", periods[..., 0], [world.standard_error[..., 0] for world in worlds]),
        ("months", periods[..., 1:], [world.standard_error[..., 1:] for world in worlds]),
        ("gain", gain, [world.gain_error for world in worlds]),
    ):
        ratio = found.var(axis=0, ddof=1) / (np.array(stated) ** 2).mean(axis=0)
        print(
            f"{name}: scatter over stated {np.sqrt(np.nanmean(ratio)):.2f}, largest "
            f"{np.sqrt(np.nanmax(ratio)):.2f}"
        )


def print_shift(options):
    environments, _ = read_environments([*options.environments, "unshaded"], dc_system())
    grid = np.meshgrid(SHIFT_LATITUDES, SHIFT_LONGITUDES, indexing="ij")
    places = Places(grid[0].ravel(), grid[1].ravel())
    source = model_source(places, "clear-sky", Request(horizon_cut="neglect"))
    exact, paper = (
        compute_world(environments, source, dc_system(), way, threads=options.threads)
        for way in ("exact", "paper")
    )
    groups = ["_".join(pair) for pair in exact.groups]
    for number, name in enumerate(exact.environments):
        for group in ("facade_south", "facade_east", "facade_north", "roof_south"):
            own = [
                world.full_load_hours[:, number, groups.index(group)] for world in (exact, paper)
            ]
            error = 100 * (own[1] - own[0])[:, 0] / own[0][:, 0]
            hourly = np.abs(own[1] - own[0])[:, 37:].sum(axis=1) / own[0][:, 0] * 100
            print(f"\n{name}, {group}: error of the year [%] (of solar hours, mean absolute [%])")
            print("latitude |", *(f"{east:g}° |" for east in SHIFT_LONGITUDES))
            for north, row, part in zip(
                SHIFT_LATITUDES,
                error.reshape(grid[0].shape),
                hourly.reshape(grid[0].shape),
                strict=True,
            ):
                print(
                    f"{north:g}° |",
                    *(f"{one:+.2f} ({two:.2f}) |" for one, two in zip(row, part, strict=True)),
                )


def print_cost(options):
    places = Places(np.array([0.0, 20, 40, 52, 65, -30]), np.array([25.0, 10, -100, 10, 25, 140]))
    source = model_source(places, "climate", Request())
    system = dc_system()
    for one in read_environments([*options.environments, "unshaded"], system)[0]:
        compute_world([one], source, system, threads=1)  # compiles
        exact, seconds = measure(one, source, system)
        print(f"{one.name}: {len(one.weight):,} surfaces, {seconds:.3f} processor s per place")
        for most in (100, 400, 800, 1600):
            if most >= len(one.weight):
                break
            world, seconds = measure(merge_surfaces(one, most), source, system)
            error = 100 * np.abs(world.full_load_hours[..., 0] / exact.full_load_hours[..., 0] - 1)
            facades = [number for number, (kind, _) in enumerate(world.groups) if kind == "facade"]
            roofs = [number for number, (kind, _) in enumerate(world.groups) if kind == "roof"]
            wall, roof = error[:, 0, facades].max(), error[:, 0, roofs].max(initial=0)
            print(
                f"  {most:,}: {seconds:.3f} processor s, off by up to {wall:.3f} % (facades), "
                f"{roof:.3f} % (roofs)"
            )


def measure(environment, source, system):
    """World of one environment, and median processor seconds per place of three runs."""
    seconds = []
    for _ in range(3):
        start = time.process_time()
        world = compute_world([environment], source, system, threads=1)
        seconds.append((time.process_time() - start) / len(source.places))
    return world, float(np.median(seconds))


if __name__ == "__main__":
    main()
