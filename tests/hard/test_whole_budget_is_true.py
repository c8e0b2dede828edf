"""The whole stated error holds: random settings and choices of suns against every hour's sun, finer patches and more
reflections."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scenes import scene_of_triangles
from test_budget_is_true import PATCH, SCENES, assert_shares, count_within, random_request
from thorough import draw_count
from weathers import ERA5

from citypv.core.accuracy.sun_sampling import CityYear, measure_ways
from citypv.core.city.refine import refine_triangles
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.light.trace_gather import trace_gather
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.weather.read_weather import read_weather

pytestmark = pytest.mark.thorough

WAYS = ("days:3", "days:6", "days:12", "days:24", "typical-days:4", "typical-days:12", "sky-grid:169", "sky-grid:673")
FINE = PATCH / 2  # [m] of the reference
TRUE = Request(samples=1024, shadow_samples=16, max_bounces=6, threads=1, seed=77, effects={"receivers": False})


@cache
def year():
    return read_weather(ERA5, 52.5, 13.4)


def choose(way):
    return choose_suns(way, year().data.index, year().interval, 52.5, 13.4)


@cache
def reference(name):
    """Scene of small surfaces, and the energy of the same surfaces cut further, under every hour's sun."""
    whole = SCENES[name]()
    vertices, triangles, _ = refine_triangles(whole.vertices, whole.triangles, PATCH)
    points, pieces, surface = refine_triangles(vertices, triangles, FINE)
    transfer = trace_gather(scene_of_triangles(points, pieces, surface), choose("hourly"), TRUE, silent)
    return scene_of_triangles(vertices, triangles), compute_energy(transfer, year(), threads=1)


def share_within(name, generator):
    scene, known = reference(name)
    request = replace(random_request(generator), max_bounces=int(generator.integers(3, 6)))
    transfer = trace_gather(scene, choose(str(generator.choice(WAYS))), request, silent)
    sampling = measure_ways(CityYear(scene, None, year(), request), transfer, [transfer.suns])[0]
    transfer = replace(transfer, record=replace(transfer.record, sun_sampling=sampling))
    return count_within(compute_energy(transfer, year(), threads=1), known)


def test_whole_errors_hold_on_four_scenes():
    found = []
    for number, name in enumerate(SCENES):
        generator = np.random.default_rng(50 + number)
        found += [share_within(name, generator) for _ in range(draw_count(30, 3))]
    assert_shares(found)
