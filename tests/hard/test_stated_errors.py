"""Stated standard errors are as large as the scatter over seeds, where light comes by way of others
too.

Remakes of real cases: a penthouse over a flat roof, a courtyard, walls in a gap, walls partly
hidden by a lower neighbour. Each is traced with many seeds; what their values scatter is held
against what each of them states.
"""

from functools import cache

import numpy as np
import pytest
from scenes import rms, run_gather
from towns import boxes

from citypv.core.energy.compute_energy import compute_energy
from citypv.core.run.study import read_year
from citypv.core.settings.request import Request
from citypv.core.sun.sun_sampling import choose_suns

SEEDS = 16
PLACE = (52.5, 13.4)
LEAST, MOST = 0.8, 1.25  # scatter over stated, as root mean squares over many surfaces
SINGLE = 5  # the largest of a single surface
SCENES = {  # boxes, low and high corners [m]
    "penthouse": [
        ((0, 0, 0), (30, 30, 12)),
        ((8, 8, 12), (22, 22, 15)),
        ((50, 0, 0), (70, 30, 20)),
    ],
    "courtyard": [
        ((0, 0, 0), (40, 10, 15)),
        ((0, 30, 0), (40, 40, 15)),
        ((0, 10, 0), (10, 30, 15)),
        ((30, 10, 0), (40, 30, 15)),
        ((55, 0, 0), (70, 40, 25)),
    ],
    "row": [((12 * k, 0, 0), (12 * k + 12, 11, 8 + 5 * (k * 3 % 4))) for k in range(5)]
    + [((9 * k, 22, 0), (9 * k + 9, 30, 7 + 4 * (k * 2 % 5))) for k in range(7)],
}


@cache
def year_and_suns():
    weather = read_year(boxes(SCENES["penthouse"]).site, Request())
    return weather, choose_suns("typical-days:4", weather.data.index, weather.interval, *PLACE)


def traced(name):
    """Full load hours and their stated errors of all seeds, (SEEDS, n) each; the scene; cover."""
    scene, (weather, suns), runs = boxes(SCENES[name]), year_and_suns(), []
    for seed in range(SEEDS):
        transfer = run_gather(scene, suns, seed=seed)
        energy = compute_energy(transfer, weather)
        runs.append((energy.full_load_hours, energy.full_load_hours_standard_error))
    return [np.array(part) for part in zip(*runs, strict=True)], scene, transfer.covered_share


@pytest.mark.thorough
@pytest.mark.slow
def test_errors_are_as_large_as_the_scatter():
    """Of each scene the walls and roofs that modules may stand on, wherever their light comes from;
    of all scenes together surfaces by how much of them is covered."""
    columns = []
    for name in SCENES:
        (hours, stated), scene, covered = traced(name)
        scatter, error, eligible = (
            hours.std(axis=0, ddof=1),
            rms(stated, axis=0),
            scene.surfaces.eligible,
        )
        members = eligible & (covered < 0.01)
        noisy = members & (scatter > 0.1)  # [h]
        # A dozen surfaces and sixteen seeds know it to a tenth.
        assert LEAST - 0.1 <= rms(scatter[members]) / rms(error[members]) <= MOST + 0.1, name
        assert (scatter[noisy] / error[noisy]).max() < SINGLE, name
        columns.append((scatter, error, covered, eligible))
    scatter, error, share, eligible = (
        np.concatenate(column) for column in zip(*columns, strict=True)
    )
    partly = (share > 0.01) & (share < 0.99)
    for members, least in ((~partly, LEAST), (partly, LEAST - 0.1)):
        assert least <= rms(scatter[members & eligible]) / rms(error[members & eligible]) <= MOST


@pytest.mark.slow
def test_light_that_seen_patches_pass_on_counts():
    """More rays leave the error of sun on the roof, of which a penthouse's walls see four patches;
    not so before.
    """
    scene, (_, suns) = boxes(SCENES["penthouse"]), year_and_suns()
    runs = [run_gather(scene, suns, samples=samples) for samples in (256, 4096)]
    parts = [run.error_parts.direct_passed_on.std(axis=1, ddof=1) / 2 for run in runs]
    north = 6 + 4  # wall of the penthouse
    assert scene.surfaces.orientation[north] == "north"
    assert parts[1][north] > 0.3 * parts[0][north] > 0
