"""Stated standard errors are as large as the scatter over seeds, where light comes by way of others too.

Remakes of real cases: a penthouse over a flat roof, a courtyard, walls in a gap, walls partly hidden by a lower
neighbour. Each is traced with many seeds; what their values scatter is held against what each of them states.
"""

from functools import cache

import numpy as np
import pytest
from real_cities import SUNS
from scenes import run_gather
from towns import boxes

from citypv.core.energy.compute_energy import compute_energy
from citypv.core.results.transfer_file import read_transfer, write_transfer
from citypv.core.settings.request import Request
from citypv.core.study import read_year
from citypv.core.sun.sun_sampling import choose_suns

SEEDS = 16
PLACE = (52.5, 13.4)
LEAST, MOST = 0.8, 1.25  # scatter over stated, as root mean squares over many surfaces
SINGLE = 5  # the largest of a single surface
SCENES = {  # boxes, low and high corners [m]
    "penthouse": [((0, 0, 0), (30, 30, 12)), ((8, 8, 12), (22, 22, 15)), ((50, 0, 0), (70, 30, 20))],
    "courtyard": [
        ((0, 0, 0), (40, 10, 15)), ((0, 30, 0), (40, 40, 15)), ((0, 10, 0), (10, 30, 15)), ((30, 10, 0), (40, 30, 15)),
        ((55, 0, 0), (70, 40, 25)),
    ],
    "row": [((12 * k, 0, 0), (12 * k + 12, 11, 8 + 5 * (k * 3 % 4))) for k in range(5)]
    + [((9 * k, 22, 0), (9 * k + 9, 30, 7 + 4 * (k * 2 % 5))) for k in range(7)],
}  # fmt: skip


@cache
def year_and_suns():
    weather = read_year(boxes(SCENES["penthouse"]).site, Request())
    return weather, choose_suns("typical-days:4", weather.data.index, weather.interval, *PLACE)


@cache
def traced(name, samples):
    """Full load hours and their stated errors of all seeds, (SEEDS, n) each; the scene; cover."""
    scene, (weather, suns), runs = boxes(SCENES[name]), year_and_suns(), []
    for seed in range(SEEDS):
        transfer = run_gather(scene, suns, seed=seed, samples=samples)
        energy = compute_energy(transfer, weather)
        runs.append((energy.full_load_hours, energy.full_load_hours_standard_error))
    return [np.array(part) for part in zip(*runs, strict=True)], scene, transfer.covered_share


def rms(values, axis=None):
    return np.sqrt(np.mean(np.square(values), axis=axis))


def ratio_of(hours, stated, members):
    """Scatter over stated of some surfaces, and the largest of a single one."""
    scatter, error = hours[:, members].std(axis=0, ddof=1), rms(stated[:, members], axis=0)
    noisy = scatter > 0.1  # [h]
    return rms(scatter) / rms(error), (scatter[noisy] / error[noisy]).max()


@pytest.mark.slow
@pytest.mark.parametrize("samples", [256, pytest.param(2048, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("name", SCENES)
def test_errors_are_as_large_as_the_scatter(name, samples):
    """Walls and roofs that modules may stand on, wherever their light comes from."""
    (hours, stated), scene, covered_share = traced(name, samples)
    members = scene.surfaces.eligible & (covered_share < 0.01)
    ratio, largest = ratio_of(hours, stated, members)
    assert 0.7 <= ratio <= MOST + 0.1  # a dozen surfaces and sixteen seeds know it to a tenth
    assert largest < SINGLE


@pytest.mark.slow
def test_errors_of_all_scenes_together():
    """By kinds of places."""
    columns = []
    for (hours, stated), scene, covered_share in (traced(name, 256) for name in SCENES):
        columns.append((hours.std(axis=0, ddof=1), rms(stated, axis=0), covered_share, scene.surfaces.eligible))
    scatter, error, share, eligible = (np.concatenate(column) for column in zip(*columns, strict=True))
    partly = (share > 0.01) & (share < 0.99)
    for members, least in ((~partly, LEAST), (partly, LEAST - 0.1)):
        # A dozen partly covered walls and sixteen seeds know it to a tenth.
        assert least <= rms(scatter[members & eligible]) / rms(error[members & eligible]) <= MOST


def test_light_that_seen_patches_pass_on_counts():
    """More rays leave the error of sun on the roof, of which a penthouse's walls see four patches; not so before."""
    scene, (_, suns) = boxes(SCENES["penthouse"]), year_and_suns()
    runs = [run_gather(scene, suns, samples=samples) for samples in (256, 4096)]
    parts = [run.error_parts.direct_passed_on.std(axis=1, ddof=1) / 2 for run in runs]
    north = 6 + 4  # wall of the penthouse
    assert scene.surfaces.orientation[north] == "north"
    assert parts[1][north] > 0.3 * parts[0][north] > 0


def test_parts_of_errors_survive_their_file(tmp_path):
    """transfer.nc keeps what the errors of groups are made of."""
    weather, suns = year_and_suns()
    transfer = run_gather(boxes(SCENES["penthouse"]), suns, samples=64)
    write_transfer(tmp_path / "transfer.nc", transfer)
    again = read_transfer(tmp_path / "transfer.nc")
    for name, values in vars(transfer.error_parts).items():
        np.testing.assert_array_equal(getattr(again.error_parts, name), values)
    one, other = (compute_energy(each, weather) for each in (transfer, again))
    np.testing.assert_allclose(other.group_standard_error, one.group_standard_error, rtol=1e-12)
    assert (one.group_standard_error > 0).all()


HALF_COVERED = [((0, 0, 0), (12, 10, 9)), ((12, 0, 0), (24, 10, 18)), ((24, 0, 0), (36, 10, 36))]


def test_a_wall_that_is_half_covered_is_eligible_with_every_seed():
    """Houses twice as high as the one beside them, and one whose neighbour ends in the middle of a row of cells."""
    scene = boxes([*HALF_COVERED, ((60, 0, 0), (72, 10, 9.3)), ((72, 0, 0), (84, 10, 17))])
    runs = [run_gather(scene, SUNS, seed=seed, samples=64, max_bounces=0) for seed in range(8)]
    covered = np.array([run.covered_share for run in runs])
    walls = np.abs(covered.mean(axis=0) - 0.5) < 0.1
    assert walls.sum() == 3
    assert np.ptp(covered, axis=0).max() <= 0.004
    np.testing.assert_array_equal(covered[:, np.flatnonzero(walls)[:2]], 0.5)
    assert covered.mean(axis=0)[np.flatnonzero(walls)[2]] == pytest.approx(9.3 / 17, abs=0.03)
