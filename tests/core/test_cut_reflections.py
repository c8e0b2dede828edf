"""What cut reflections would add at most, held against a run that follows 40 of them.

Both runs have the same rays, so that nothing but the reflections differs.
"""

from dataclasses import replace

import numpy as np
import pytest
from test_rounds_unbiased import REQUEST, street
from thorough import mark_cases

from citypv.core.accuracy.error_budget import bound_cut_reflections
from citypv.core.accuracy.sun_sampling import name_groups
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.pv_system import build_system
from citypv.core.light.solve_radiosity import bound_further
from citypv.core.light.trace_run import trace_run
from citypv.core.run.join_tiles import _largest_of_groups
from citypv.core.run.study import prepare_study
from citypv.core.sky.sky_models import choose_sky

MANY = 40


def trace(name, rounds=(), **changes):
    """Transfer, weather and Energy of some houses."""
    scene, weather, _ = street(name)
    request = replace(REQUEST, **changes)
    prepared = replace(
        prepare_study(scene, weather, request).build_tree(request), rounds=bool(rounds)
    )
    run = trace_run(scene, weather, request, prepared=prepared)
    for size in rounds:
        run = run.add_round(size)
    energy = compute_energy(
        run.transfer, weather, build_system(request), 1, sky=choose_sky(request, run.transfer)
    )
    return run.transfer, weather, energy


def hours_of_groups(transfer, energy):
    """Hours times counted area of each kind and orientation and of all: dict."""
    names, hours = (
        name_groups(transfer.surfaces),
        energy.counted_area * np.nan_to_num(energy.full_load_hours),
    )
    groups = {" ".join(name): names == " ".join(name) for name in energy.groups} | {
        "all": np.ones(len(names), bool)
    }
    return {name: hours[members & energy.eligible].sum() for name, members in groups.items()}


def assert_bounded(name, bounces, rounds=(), most=None, **changes):
    """The bound of each group is above what more reflections add, and where told below so many
    times that.
    """
    few, many = (trace(name, rounds, max_bounces=count, **changes) for count in (bounces, MANY))
    hours, more = hours_of_groups(few[0], few[2]), hours_of_groups(many[0], many[2])
    stated = bound_cut_reflections(*few)
    assert set(stated) == set(hours) and len(stated) > 5
    missing = {group: more[group] / hours[group] - 1 for group in hours}
    assert missing["all"] > 1e-5
    for group, share in stated.items():
        assert missing[group] <= share + 1e-9, (group, missing[group], share)
        assert most is None or share < most * missing[group] + 1e-9, (group, missing[group], share)


@pytest.mark.slow
@pytest.mark.parametrize("name", mark_cases(["alone", "street", "court", "tower"], kept=2))
@pytest.mark.parametrize(
    ("albedo", "bounces", "most"), [(0.3, 1, 5), (0.3, 2, 5), (0.6, 5, 5), (0.9, 5, None)]
)
def test_forty_reflections_add_no_more_than_is_stated(name, albedo, bounces, most):
    assert_bounded(name, bounces, most=most, albedo=albedo, ground_albedo=albedo)


@pytest.mark.slow
def test_without_reflections_and_after_rounds():
    assert_bounded("street", 0)
    assert_bounded("street", 2, rounds=(1, 2))


def test_a_bound_of_matrices_holds():
    """Of random matrices of which some patches see nothing or only dark ones; the closed form sums
    all reflections.
    """
    rng = np.random.default_rng(1)
    for count in range(1, 30):
        matrix = rng.random((count, count)) * (rng.random((count, count)) < 0.3)
        matrix *= rng.uniform(0.3, 0.95) / np.maximum(matrix.sum(axis=1), 1e-9).max()
        last = rng.random(count) * (rng.random(count) < 0.4)
        beyond = np.linalg.solve(np.eye(count) - matrix, last) - last
        bound = bound_further(lambda light, matrix=matrix: matrix @ light, last)
        assert (beyond <= bound * (1 + 1e-9) + 1e-15).all()
        assert (
            bound <= 40 * np.abs(beyond).max() + 1e-15
        ).all()  # of a series whose ratio is 0.95 at most


def test_light_that_never_leaves_has_no_bound():
    swapped = np.array([[0.0, 1.0], [1.0, 0.0]])
    assert np.isinf(bound_further(lambda light: swapped @ light, np.array([1.0, 0.5]))).all()


def test_of_tiles_the_largest_counts():
    tiles = [
        {"all": {"sky": 0.1, "suns": 0.2}},
        {"all": {"sky": 0.3, "suns": None}, "flat none": {"sky": 0.0}},
    ]
    assert _largest_of_groups(tiles) == {
        "all": {"sky": 0.3, "suns": None},
        "flat none": {"sky": 0.0},
    }
    assert _largest_of_groups([*tiles, None]) is None
