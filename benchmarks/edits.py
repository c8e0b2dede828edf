"""Seconds of edits of a city, of their previews and of full runs of the edited cities, and rays that end elsewhere.

python benchmarks/edits.py examples/berlin/berlin_3910_5817.gml --edits 30 --full 3
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

if __package__ in (None, ""):
    sys.path.insert(0, str(Path(__file__).parents[2]))

from citypv.core.city.edit_city import Change, edit_city, take_polygons
from citypv.core.light.edit_light import prepare_edit, trace_editable
from citypv.core.photons.specular_light import specular_of
from citypv.core.settings.request import Request
from citypv.core.study import place_city, read_buildings, read_year, stand_city, trace_base, trace_edit


def read_clock():
    return np.array([time.perf_counter(), time.process_time()])


def draw_change(city, generator):
    """A building removed, moved by up to 10 m, raised by 3 to 20 m, or put a second time beside itself: Change."""
    name = generator.choice(list(dict.fromkeys(city.building_id)))
    east, north = generator.uniform(-10, 10, 2)
    twice = take_polygons(city, np.array(city.building_id) == name)
    twice = edit_city(twice, Change(moved={name: (25 + east, north)}))
    return [
        Change(removed=[name]),
        Change(moved={name: (east, north)}),
        Change(raised={name: generator.uniform(3, 20)}),
        Change(added=(twice,)),
    ][generator.integers(4)]


def count_apart(one, other):
    """Number of hits that only one of two traced cities has."""
    keys = []
    for city in (one, other):
        rows = city.traced.form_factors.rows
        patch = np.concatenate([np.repeat(part.chosen, np.diff(part.start)) for part in rows]).astype(np.int64)
        keys.append(np.sort(patch << 32 | np.concatenate([part.key for part in rows]).astype(np.int64)))
    return max(len(part) for part in keys) - len(np.intersect1d(*(number_equal(part) for part in keys)))


def number_equal(keys):
    """Sorted keys, each with its number among equal ones, so that all differ."""
    return np.stack([keys, np.arange(len(keys)) - np.searchsorted(keys, keys)], axis=1).copy().view("i8,i8").ravel()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("city", nargs="+")
    parser.add_argument("--edits", type=int, default=30)
    parser.add_argument("--full", type=int, default=3, help="so many of them are traced in full as well")
    parser.add_argument("--suns", default="days:24")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    request = Request(weather=["clear-sky"], suns=options.suns, threads=2)
    city = read_buildings(options.city, request)
    scene = place_city(city, request)
    weather, generator, told, full = read_year(scene.site, request), np.random.default_rng(options.seed), [], []
    base = trace_base(scene, weather, request)
    trace_edit(base, city)  # compiles
    for number in range(options.edits):
        changed, seen = edit_city(city, draw_change(city, generator), scene.site.convergence), []
        start = read_clock()
        edited = trace_edit(base, changed, preview=lambda *_, seen=seen: seen.append(read_clock()))
        end, record = read_clock(), edited.transfer.record
        told.append([*(seen[0] - start), *(end - start), record.hemisphere_rays, record.shadow_rays])
        if number < options.full:
            start = read_clock()
            again = stand_city(changed, request, like=replace(scene, trail=None))
            whole = trace_editable(prepare_edit(base, again, request), base.suns, request, specular=specular_of)
            full.append(
                [*(read_clock() - start), whole.transfer.record.hemisphere_rays, whole.transfer.record.shadow_rays]
            )
            print(f"  rays apart: {count_apart(edited.leaf, whole.leaf)} of {whole.transfer.record.hemisphere_rays:,}")
    print("preview s, CPU s; exact s, CPU s; hemisphere and shadow rays, medians:", np.median(told, axis=0).round(2))
    print("full run s, CPU s; rays:", np.median(full, axis=0).round(2))


if __name__ == "__main__":
    main()
