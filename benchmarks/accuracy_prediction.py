"""Predicted against measured seconds and errors: how far the price list of `citypv accuracy` can be believed.

    python benchmarks/accuracy_prediction.py [berlin the_hague town midtown] [--threads N] [--settings NAME …]

For each setting the city is traced as `citypv simulate` would, and its processor seconds of tracing and errors of full
load hours (half and 95 % of the eligible area, sampling and choice of suns) stand beside those predicted from one pilot
of the same run, as lines of the table in docs/accuracy.md. On a machine with other work on it, processor time is the
one to compare; `--wall` prints wall time instead, for a quiet one.
"""

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from town import WEATHER, write_town

from citypv.core.accuracy.price_list import list_prices
from citypv.core.accuracy.yield_errors import split_errors
from citypv.core.light.prepare_scene import build_tree, prepare_scene
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request
from citypv.core.study import compute_energy, measure_sun_sampling, read_scene, read_year, trace_scene

ROOT = Path(__file__).parents[1]
CITIES = {  # name -> file (None: written first), further settings
    "berlin": (ROOT / "examples/berlin/berlin_3910_5817.gml", {"weather": str(WEATHER)}),
    "the_hague": (ROOT / "examples/world/denhaag_01_lod2_v1.gml.gz", {}),
    "town": (None, {"weather": str(WEATHER), "ground": "none", "patch_size": None}),
    "midtown": (
        ROOT / "tests/data/obj/nyc_midtown_citicorp_1km.obj.gz",
        {"latitude": 40.757, "longitude": -73.97},
    ),
}
SETTINGS = {
    "draft": {"samples": 64, "shadow_samples": 4, "suns": "days:12"},
    "standard": {},
    "--shadow-samples 64": {"shadow_samples": 64},
    "--samples 1024": {"samples": 1024},
    "--suns days:52": {"suns": "days:52"},
    "--max-bounces 1": {"max_bounces": 1},
    "--suns typical-days:12": {"suns": "typical-days:12"},
}
USUAL = ("draft", "standard", "--shadow-samples 64", "--samples 1024", "--suns days:52")


def measure(scene, weather, request):
    """Wall and processor seconds of tracing, and errors [%] of half and of 95 % of the area."""
    prepared = build_tree(prepare_scene(scene, request, weather=weather), request)
    clock, processor = time.perf_counter(), time.process_time()
    transfer = trace_scene(scene, weather, request, silent, prepared=prepared)
    wall, processor = time.perf_counter() - clock, time.process_time() - processor
    sampling = measure_sun_sampling(scene, weather, transfer, request, prepared=prepared)
    transfer = replace(transfer, record=replace(transfer.record, sun_sampling=sampling))
    errors = split_errors(transfer, weather, compute_energy(transfer, weather, request))
    return wall, processor, errors.at_share(share=0.5), errors.at_share()


def compare(name, options, folder):
    """Print the lines of one city."""
    path, settings = CITIES[name]
    if path is None:
        path = folder / "town.gml"
        write_town(path)
    request = Request(threads=options.threads, **settings)
    scene = read_scene([path], request)
    weather = read_year(scene.site, request)
    started, spent = time.perf_counter(), time.process_time()
    listed = list_prices(scene, weather, request, progress=silent)
    pilot = time.perf_counter() - started, time.process_time() - spent
    print(f"{name}: {listed.patches:,} patches, pilot {pilot[0]:.1f} s, {pilot[1]:.1f} s of processor time", flush=True)
    prices = {one.name: one for one in listed.prices}
    for setting in options.settings:
        price = prices[setting]
        wall, processor, half, most = measure(scene, weather, replace(request, **SETTINGS[setting]))
        pair = (price.tracing, wall) if options.wall else (price.processor, processor)
        rows = (pair, (price.median, half), (price.error, most))
        words = " | ".join(f"{one:.3g} | {other:.3g} | {one / other:.2f}" for one, other in rows)
        print(f"| {name} | {setting} | {words} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("city", nargs="*", choices=[[], *CITIES], help="all four if none is named")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--settings", nargs="+", choices=SETTINGS, default=USUAL)
    parser.add_argument("--wall", action="store_true", help="wall time of tracing in place of processor time")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for name in options.city or CITIES:
            compare(name, options, Path(folder))


if __name__ == "__main__":
    main()
