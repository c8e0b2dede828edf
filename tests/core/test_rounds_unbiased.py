"""Rounds end where long runs do, and no further from them than they say: on ground that no ray of
the first round meets, under each single sun, and in full load hours.

Long runs have 16 times the rays at once and no rounds, and several seeds stand for more points:
nothing in them goes on from few rays. With more points in one run elements would be lit at other
places.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from cities import box, make_city
from scipy import stats
from thorough import mark_cases

from citypv.core.city.build_scene import build_scene
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.pv_system import build_system
from citypv.core.energy.standard_errors import errors_of_energy
from citypv.core.light.trace_run import trace_run
from citypv.core.run.study import prepare_study, read_year
from citypv.core.settings.request import Request

REQUEST = Request(samples=64, shadow_samples=16, suns="days:2", threads=1, weather=["clear-sky"])
SEEDS, SIZES = range(6), (1, 2, 4, 8)
# on generated ground, which reaches far beyond them: x, y, width, depth, foot and height [m]
HOUSES = {
    "alone": [(0, 0, 10, 10, 0, 8)],
    "street": [(0, 0, 30, 10, 0, 15), (0, 18, 30, 10, 0, 9)],
    "court": [
        (0, 0, 30, 8, 0, 12),
        (0, 22, 30, 8, 0, 12),
        (0, 8, 8, 14, 0, 12),
        (22, 8, 8, 22, 0, 6),
    ],
    "tower": [(0, 0, 12, 12, 0, 60), (20, -5, 30, 25, 0, 6)],
    "rows": [(x, y, 9, 9, 0, 5 + (x + 2 * y) % 7) for x in (0, 16, 32) for y in (0, 16)],
}


@cache
def street(name):
    """Scene, weather and PreparedScene of some houses."""
    city = make_city(
        [side for number, bounds in enumerate(HOUSES[name]) for side in box(f"b{number}", *bounds)]
    )
    scene = build_scene(city, latitude=50.0, longitude=10.0)
    weather = read_year(scene.site, REQUEST)
    return scene, weather, prepare_study(scene, weather, REQUEST).build_tree(REQUEST)


def run_of(name, request, sizes=()):
    """Transfer after rounds of some sizes, and its Energy."""
    scene, weather, prepared = street(name)
    prepared = replace(prepared.reseed(request.seed), rounds=bool(sizes))
    run = trace_run(scene, weather, request, prepared=prepared)
    for size in sizes:
        run = run.add_round(size)
    return run.transfer, compute_energy(run.transfer, weather, build_system(request), 1)


def mean_hours(name, transfer, energy):
    """Mean full load hours of the eligible area, with the variance from rays and points that is
    stated: two float.
    """
    errors, lit = (
        errors_of_energy(transfer, street(name)[1], energy),
        np.flatnonzero(energy.eligible),
    )
    weight = energy.counted_area[lit] / energy.counted_area[lit].sum()
    return weight @ energy.full_load_hours[lit], errors.noise_of_mean(weight, lit)


@pytest.mark.slow
@pytest.mark.parametrize("name", mark_cases(HOUSES, kept=2))
def test_rounds_end_where_long_runs_do(name):
    """Six seeds, each within what it states of the long runs, and their mean too."""
    long = [run_of(name, replace(REQUEST, samples=1024, seed=100 + seed)) for seed in range(16)]
    known = np.array([mean_hours(name, *one) for one in long])
    true, left = known[:, 0].mean(), max(known[:, 1].mean(), known[:, 0].var(ddof=1)) / len(known)
    found = np.array(
        [mean_hours(name, *run_of(name, replace(REQUEST, seed=seed), SIZES)) for seed in SEEDS]
    )
    deviation = (found[:, 0] - true) / np.sqrt(found[:, 1] + left)
    assert np.sqrt(found[:, 1]).max() < 0.001 * true  # a tenth of what ground that is black takes
    # Four replicates state each error: t of three degrees of freedom, of which 14 % lie beyond two.
    assert np.abs(deviation).max() < stats.t.ppf(0.9995, 3)
    assert (np.abs(deviation) > 2).sum() <= 2
    assert np.abs(found[:, 0].mean() - true) < 3 * np.sqrt(found[:, 1].mean() / len(found) + left)


@pytest.mark.thorough
def test_each_sun_becomes_known_better_with_every_round():
    """What a facade receives of single suns by reflection scatters less, in proportion to the
    number of samples.
    """
    scatter = []
    for sizes in ((1,), (1, 2, 4, 8, 16)):
        light = [
            run_of("alone", replace(REQUEST, seed=seed), sizes)[0].direct_reflected
            for seed in SEEDS
        ]
        scatter.append(np.mean(np.var(light, axis=0, ddof=1)))
    assert 0.5 < scatter[0] / scatter[1] / 16 < 2.5
