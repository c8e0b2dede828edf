"""What each way of choosing suns costs in error: full load hours of patches against every hour's sun.

    python benchmarks/suns.py [CITY] [--weather FILE]

First hits only, on 500 patches of the eligible surfaces drawn by area, as in the error check of every run. Printed: the
number of suns (the time to trace grows with it), bias and root mean square in percent of the mean full load hours.
"""

import argparse
from dataclasses import replace
from pathlib import Path

from citypv.core.request import Request
from citypv.core.study import measure_sun_sampling, read_scene, read_year, trace_scene

BERLIN = Path(__file__).parents[1] / "examples" / "berlin"
WAYS = [f"typical-days:{count}" for count in (4, 12, 24, 52)] + [f"sky-grid:{count}" for count in (673, 1654, 3219)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("city", nargs="*", default=[BERLIN / "berlin_3910_5817.gml"])
    parser.add_argument("--weather", default=str(BERLIN / "era5_berlin_2017.nc"))
    options = parser.parse_args()
    scene = weather = None
    print("| way | suns | bias | rms |\n|---|--:|--:|--:|")
    for way in WAYS:
        # The pilot has rays of its own: of the whole city only the diffuse part is needed, roughly.
        request = Request(weather=options.weather, suns=way, max_bounces=0, samples=16)
        if scene is None:
            scene = read_scene(options.city, request)
            weather = read_year(scene.site, request)
        transfer = trace_scene(scene, weather, replace(request, shadow_samples=1))
        error = measure_sun_sampling(scene, weather, transfer, request)
        print(f"| {way} | {len(transfer.suns):,} | {error['bias']:+.2f} % | {error['rms']:.2f} % |", flush=True)


if __name__ == "__main__":
    main()
