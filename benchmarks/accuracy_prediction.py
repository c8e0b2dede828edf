"""Predicted against measured seconds and errors: how far the price list of `citypv accuracy` can be
believed.

    python benchmarks/accuracy_prediction.py [CITY …] [--threads N] [--settings NAME …]

For each setting the city is traced as `citypv simulate` would, and its processor seconds of tracing
and errors of full load hours (half and 95 % of the eligible area, sampling and choice of suns)
stand beside those predicted from one pilot of the same run, as lines of a table. Of cities whose
runs take less than a second, the median of seven seeds counts: with few surfaces their errors
scatter. `--wall` prints wall time instead of processor time, for a quiet machine.
"""

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from town import WEATHER, write_town

from citypv.core.accuracy.cost_curve import predict_costs
from citypv.core.accuracy.yield_errors import split_errors
from citypv.core.light.prepare_scene import prepare_scene
from citypv.core.run.study import (
    compute_energy,
    measure_sun_sampling,
    read_scene,
    read_year,
    trace_scene,
)
from citypv.core.settings.presets import PRESETS
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request

ROOT = Path(__file__).parents[1]
DATA = ROOT / "tests/data"
CLEAR = {"weather": "clear-sky"}
NEW_YORK = {"latitude": 40.757, "longitude": -73.97, **CLEAR}
CITIES = {  # name -> file (None: written first), further settings
    "zurich": (DATA / "citygml/zurich_lod2_v1.xml.gz", CLEAR),
    "hannover": (DATA / "citygml/hannover_LGLN_LoD2_32_550_5802_3bld.gml", CLEAR),
    "delft": (DATA / "citygml/delft_lod1_v2.xml.gz", CLEAR),
    "vienna": (DATA / "citygml/vienna_Fichtegasse.gml.gz", CLEAR),
    "yokosuka": (DATA / "citygml/plateau_yokosuka_52397519_bldg.gml.gz", CLEAR),
    "nrw": (DATA / "citygml/nrw_LoD2_32_280_5659_1_NW.gml.gz", CLEAR),
    "lyon_tower": (
        DATA / "obj/lyon_tour_part_dieu.obj.gz",
        {"latitude": 45.76, "longitude": 4.85, **CLEAR},
    ),
    "berlin_part": (DATA / "citygml/berlin_opendata_part_v1.gml.gz", CLEAR),
    "new_york_tower": (DATA / "obj/nyc_tower_yup.obj.gz", NEW_YORK),
    "berlin": (ROOT / "examples/berlin/berlin_3910_5817.gml", {"weather": str(WEATHER)}),
    "the_hague": (ROOT / "examples/world/denhaag_01_lod2_v1.gml.gz", CLEAR),
    "town": (None, {"weather": str(WEATHER), "ground": "none", "patch_size": None}),
    "midtown": (DATA / "obj/nyc_midtown_citicorp_1km.obj.gz", NEW_YORK),
}
SEEDS, QUICK = 7, 1.0  # of runs that take less than so many seconds
SETTINGS = {
    **PRESETS,
    "--shadow-samples 64": {"shadow_samples": 64},
    "--samples 1024": {"samples": 1024},
    "--suns days:52": {"suns": "days:52"},
    "--max-bounces 1": {"max_bounces": 1},
    "--suns typical-days:12": {"suns": "typical-days:12"},
}
USUAL = ("draft", "standard", "--samples 1024")


def measure(scene, weather, request):
    """Wall and processor seconds of tracing, and errors [%] of half and of 95 % of the area."""
    prepared = prepare_scene(scene, request, weather=weather).build_tree(request)
    clock = time.perf_counter()
    transfer = trace_scene(scene, weather, request, silent, prepared=prepared)
    wall, processor = time.perf_counter() - clock, sum(transfer.record.processor_seconds.values())
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
    spent = time.process_time()
    listed = predict_costs(scene, weather, request, progress=silent)
    pilot = time.process_time() - spent
    prices = {one.name: one for one in listed.prices}
    for setting in options.settings:
        price, own = prices[setting], replace(request, **SETTINGS[setting])
        traced = scene if own.patch_size == request.patch_size else read_scene([path], own)
        found = [measure(traced, weather, own)]
        if found[0][1] < QUICK:
            found += [
                measure(traced, weather, replace(own, seed=seed)) for seed in range(2, SEEDS + 1)
            ]
        wall, processor, half, most = np.median(found, axis=0)
        pair = (price.tracing, wall) if options.wall else (price.processor, processor)
        rows = (pair, (price.median, half), (price.error, most))
        words = " | ".join(f"{one:.3g} | {other:.3g} | {one / other:.2f}" for one, other in rows)
        print(f"| {name} | {listed.patches:,} | {pilot:.1f} | {setting} | {words} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("city", nargs="*", choices=[[], *CITIES], help="all if none is named")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--settings", nargs="+", choices=SETTINGS, default=USUAL)
    parser.add_argument(
        "--wall", action="store_true", help="wall time of tracing in place of processor time"
    )
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for name in options.city or CITIES:
            compare(name, options, Path(folder))


if __name__ == "__main__":
    main()
