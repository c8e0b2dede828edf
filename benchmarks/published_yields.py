"""Walls beside what is published of plants without a series: ratios, which are free of module and
losses.

    python benchmarks/published_yields.py

Norway: systems that stand well give about 700 kWh/kWp on walls, about 700 lying nearly level, and
slightly above 900 tilted by 30° or more, ± 5 % (Haumann 2016, thesis EOM-3901, UiT). Switzerland:
one south facade on two clear days, 24.06.2015 and 23.12.2014 (pv2grid.ch): 585 kWh and at most 88
kVA, 686 kWh and 133 kVA. Sheds on open ground stand for the plants; weather, module and losses are
the defaults, of the clear days a clear sky.
"""

import tempfile
from pathlib import Path

import numpy as np
from measured_yields import write_shed

from citypv.core.run.study import compute_energy, read_scene, read_year, trace_scene
from citypv.core.settings.request import Request

NORWAY = {"Oslo": (59.91, 10.75), "Stavanger": (58.97, 5.73), "Bergen": (60.39, 5.32)}
FACADE = 47.0, 8.5
DAYS = (12, 23), (6, 24)


def main():
    """Print both tables in Markdown."""
    print("| | wall : level : 30° | wall, level, 30° [kWh/kWp] |\n|---|--:|--:|")
    print("| measured, several systems | 0.78 : 0.78 : 1 | 700, 700, 900 |")
    found = []
    for name, place in NORWAY.items():
        level, tilted = (trace_shed(place, tilt)[1] for tilt in (0.0, 30.0))
        hours = tilted["facade"], level["flat"], tilted["roof"]
        found.append(hours)
        print(f"| {name} | {ratio(hours)} | {', '.join(f'{one:,.0f}' for one in hours)} |")
    mean = np.mean(found, axis=0)
    print(f"| mean | {ratio(mean)} | {', '.join(f'{one:,.0f}' for one in mean)} |")
    print("\n| ground | energy of 23 December over 24 June | highest power |\n|---|--:|--:|")
    print(f"| measured | {686 / 585:.2f} | {133 / 88:.2f} |")
    for albedo in (0.2, 0.6):
        settings = {"weather": "clear-sky", "ground_albedo": albedo, "suns": "days:52"}
        energy, _ = trace_shed(FACADE, 30.0, **settings)
        power = energy.capacity_factor[:, energy.groups.index(("facade", "south"))]
        days = [power[(energy.times.month == m) & (energy.times.day == d)] for m, d in DAYS]
        winter, summer = ((one.sum(), one.max()) for one in days)
        print(f"| albedo {albedo:g} | {winter[0] / summer[0]:.2f} | {winter[1] / summer[1]:.2f} |")


def trace_shed(place, tilt, **settings):
    """Energy of a shed whose roof falls to the south, and the hours of its south sides by kind."""
    settings = {"weather": "climate"} | settings
    request = Request(latitude=place[0], longitude=place[1], up="z", unit="m", **settings)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shed.obj"
        path.write_text(write_shed(tilt, 180.0), encoding="utf-8")
        scene = read_scene([path], request)
    year = read_year(scene.site, request)
    energy = compute_energy(trace_scene(scene, year, request), year, request)
    own = energy.eligible & ((energy.orientation == "south") | (energy.kind == "flat"))
    return energy, dict(zip(energy.kind[own], energy.full_load_hours[own], strict=True))


def ratio(hours):
    return " : ".join(f"{one / hours[2]:.2f}" for one in hours[:2]) + " : 1"


if __name__ == "__main__":
    main()
