"""Seconds, silences and memory of edits of a city, and their hours against the edited scenes traced
wholly.

python benchmarks/edits.py examples/berlin/berlin_3910_5817.gml --edits 30 --full 3
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

if __package__ in (None, ""):
    sys.path.insert(0, str(Path(__file__).parents[2]))

from citypv.core.city.edit_city import CityChange, edit_city
from citypv.core.light.change_light import trace_change
from citypv.core.light.editable_city import prepare_decided, trace_editable
from citypv.core.light.rays_file import write_rays
from citypv.core.run.study import (
    change_scene,
    compute_energy,
    make_located_scene,
    read_buildings,
    read_year,
    trace_base,
)
from citypv.core.settings.request import Request


def read_clock():
    return np.array([time.perf_counter(), time.process_time()])


def draw_change(city, generator):
    """A building removed, moved by up to 10 m, raised by 3 to 20 m, or put a second time beside
    itself: CityChange.
    """
    name = generator.choice(list(dict.fromkeys(city.building_id)))
    east, north = generator.uniform(-10, 10, 2)
    twice = city.take(np.array(city.building_id) == name)
    twice = edit_city(twice, CityChange(moved={name: (25 + east, north)}))
    return [
        CityChange(removed=[name]),
        CityChange(moved={name: (east, north)}),
        CityChange(raised={name: generator.uniform(3, 20)}),
        CityChange(added=(twice,)),
    ][generator.integers(4)]


def tell_apart(one, other, weather, request):
    """Hours of two traced cities apart, over the stated error: 95 and 99 % of the area, the
    largest, the total.
    """
    energy = [compute_energy(city.transfer, weather, request) for city in (one, other)]
    hours = [np.nan_to_num(np.asarray(found.full_load_hours)) for found in energy]
    stated, area = (
        np.asarray(energy[1].full_load_hours_standard_error),
        other.transfer.surfaces.area,
    )
    known = np.isfinite(stated) & (area > 0)
    ratio = np.abs(hours[0] - hours[1])[known] / np.maximum(stated[known], 1e-4)
    order = np.argsort(ratio)
    share = np.cumsum(area[known][order]) / area[known].sum()
    quantiles = [ratio[order][np.searchsorted(share, level)] for level in (0.95, 0.99)]
    total = (area @ hours[0]) / (area @ hours[1]) - 1
    return [*quantiles, ratio.max(), total]


class Listener:
    """Progress and preview of an edit: the clocks at the preview, and the longest time that nothing
    was told.
    """

    def __init__(self):
        self.start = self.told = read_clock()
        self.longest, self.seen = np.zeros(2), None

    def progress(self, *_):
        now = read_clock()
        self.told, self.longest = now, np.maximum(self.longest, now - self.told)

    def preview(self, *_):
        self.seen = read_clock() if self.seen is None else self.seen


def count_bytes(value, seen):
    """Bytes of all arrays in memory that a value keeps alive, each counted once; `seen` are ids of
    what was counted.
    """
    if isinstance(value, np.ndarray):
        while isinstance(value.base, np.ndarray):
            value = value.base
    if id(value) in seen or isinstance(value, np.memmap):
        return 0
    seen.add(id(value))
    if isinstance(value, np.ndarray):
        return value.nbytes
    parts = (
        value.values()
        if isinstance(value, dict)
        else value
        if isinstance(value, list | tuple)
        else ()
    )
    return sum(
        count_bytes(part, seen) for part in (*parts, *getattr(value, "__dict__", {}).values())
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("city", nargs="+")
    parser.add_argument("--edits", type=int, default=30)
    parser.add_argument(
        "--full", type=int, default=3, help="so many of them are traced in full as well"
    )
    parser.add_argument("--suns", default="days:24")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--place", type=float, nargs=2, metavar=("LATITUDE", "LONGITUDE"), default=(None, None)
    )
    options = parser.parse_args()
    latitude, longitude = options.place
    place = {"latitude": latitude, "longitude": longitude}
    request = Request(weather=["clear-sky"], suns=options.suns, threads=2, **place)
    city = read_buildings(options.city, request)
    scene = make_located_scene(city, request)
    weather, generator = read_year(scene.site, request), np.random.default_rng(options.seed)
    told, stages, full, apart = [], [], [], []
    base = trace_base(scene, weather, request)
    kept = count_bytes(base, set())
    with TemporaryDirectory() as folder:
        write_rays(folder, base, city)
        size = (Path(folder) / "rays.nc").stat().st_size
    patches = len(base.city.prepared.patches)
    sizes = f"kept {kept / 1e6:.0f} MB, rays.nc {size / 1e6:.1f} MB"
    print(f"{patches:,} patches, {len(base.suns)} suns; {sizes}", flush=True)
    trace_change(base, change_scene(base, city, city, request))  # compiles
    for number in range(options.edits):
        changed = edit_city(city, draw_change(city, generator), scene.site.convergence)
        listener = Listener()
        change = change_scene(base, city, changed, request, listener.progress)
        edited = trace_change(base, change, progress=listener.progress, preview=listener.preview)
        listener.progress()
        end, record = read_clock(), edited.transfer.record
        rays = record.hemisphere_rays, record.shadow_rays
        told.append(
            [*(listener.seen - listener.start), *(end - listener.start), *listener.longest, *rays]
        )
        stages.append(record.processor_seconds)
        if number < options.full:
            start = read_clock()
            prepared = prepare_decided(base.decisions, change.scene, request)
            whole = replace(trace_editable(prepared, base.suns, request), rows=change.rows)
            record = whole.transfer.record
            full.append([*(read_clock() - start), record.hemisphere_rays, record.shadow_rays])
            apart.append(tell_apart(edited, whole, weather, request))
            print(
                "  hours off over stated error, 95 %, 99 %, most; total:",
                np.round(apart[-1], 6),
                flush=True,
            )
    names = "preview s, CPU s; exact s, CPU s; longest silence s, CPU s; hemisphere and shadow rays"
    print(f"edit, medians: {names}:", np.median(told, axis=0).round(2))
    print("edit, largest:", np.max(told, axis=0).round(2))
    print("edit, CPU s of stages, medians:", pd.DataFrame(stages).median().round(2).to_dict())
    if full:
        print("full run, medians: s, CPU s; rays:", np.median(full, axis=0).round(2))
        print(
            "hours off over stated error, 95 %, 99 %, most; total, largest:",
            np.max(np.abs(apart), axis=0).round(6),
        )


if __name__ == "__main__":
    main()
