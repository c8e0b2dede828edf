"""Predicted against measured seconds and errors: how far the price list of `citypv accuracy` can be believed.

    python benchmarks/accuracy_prediction.py CITY [--latitude D --longitude D] [--threads N] [--settings NAME …]

For each setting the city is traced as `citypv simulate` would, and its tracing time, processor time and errors of full
load hours (median and 95 % of the eligible area, sampling and choice of suns) are put beside those predicted from one
pilot. On a machine with other work on it only processor time can be compared.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

from citypv.core.accuracy.price_list import list_prices
from citypv.core.accuracy.yield_errors import split_errors
from citypv.core.progress import silent
from citypv.core.request import Request
from citypv.core.study import compute_energy, measure_sun_sampling, read_scene, read_year, trace_scene
from citypv.core.transfer.prepare_scene import build_tree, prepare_scene

SETTINGS = {
    "draft": {"samples": 64, "shadow_samples": 4, "suns": "days:12"},
    "standard": {},
    "--samples 1024": {"samples": 1024},
    "--shadow-samples 64": {"shadow_samples": 64},
    "--max-bounces 1": {"max_bounces": 1},
    "--suns typical-days:12": {"suns": "typical-days:12"},
    "--suns days:52": {"suns": "days:52"},
}


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


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("city", type=Path, nargs="+")
    parser.add_argument("--weather", default="clear-sky")
    parser.add_argument("--latitude", type=float)
    parser.add_argument("--longitude", type=float)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--settings", nargs="+", choices=SETTINGS, default=list(SETTINGS))
    options = parser.parse_args()
    request = Request(
        latitude=options.latitude, longitude=options.longitude, threads=options.threads, weather=options.weather
    )
    scene = read_scene(options.city, request)
    weather = read_year(scene.site, request)
    listed = list_prices(scene, weather, request, progress=silent)
    predicted = {one.name: one for one in listed.prices}
    print(
        f"{listed.patches:,} patches, pilot and choices of suns {listed.pilot_seconds:.1f} s, {options.threads} threads"
    )
    print(
        f"{'predicted, measured':24} {'wall s':>15} {'processor s':>15} {'ratio':>6} "
        f"{'half of area %':>15} {'95 % of area %':>15} {'ratio':>6}"
    )
    for name in options.settings:
        one, (wall, processor, half, most) = (
            predicted[name],
            measure(scene, weather, replace(request, **SETTINGS[name])),
        )
        print(
            f"{name:24} {one.tracing:7.1f} {wall:7.1f} {one.processor:7.1f} {processor:7.1f} "
            f"{one.processor / processor:6.2f} {one.median:7.2f} {half:7.2f} {one.error:7.2f} {most:7.2f} "
            f"{one.error / most:6.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
