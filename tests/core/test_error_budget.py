"""The error budget: what averages out and what does not, what counts, and parts by source that add
up to the whole.
"""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scenes import run_gather
from test_closed_forms import SUNS
from test_tracing import three_houses
from transfers import unshaded_transfer

from citypv.core.accuracy.error_budget import budget_errors, budget_groups, suggest_more
from citypv.core.accuracy.yield_errors import SOURCES, seconds_of_rounds, split_errors
from citypv.core.effects.beyond_scene import change_unshaded
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.light.transfer import ErrorParts
from citypv.core.sun.sun_sampling import choose_suns

COUNT = 52
OPEN = np.where(np.arange(COUNT) % 2, 1.0, 0.6)  # share of each wall
# error of the mean over that of a wall, if they are independent
APART = np.sqrt((OPEN**2).sum()) / OPEN.sum()
NOISE = 0.01  # of the diffuse light
# deviations of four replicates: variance of their mean 1/3
SIGNS = np.array([1.0, -1.0, 1.0, -1.0])


@pytest.fixture(scope="module")
def walls(berlin):
    """Transfer of walls to the south, all of the same area, half of them covered by 40 %; and a
    weather.
    """
    suns = choose_suns("typical-days:4", *berlin.axis)
    transfer = unshaded_transfer(suns, np.full(COUNT, 90.0), np.full(COUNT, 180.0))
    transfer.surfaces.area[:] = 10.0
    transfer.surfaces.eligible[:] = True
    transfer.covered_share[:] = 1 - OPEN
    transfer.diffuse_relative[:] *= OPEN  # covered parts are dark
    transfer.far_ground_view_factor[:] *= OPEN
    transfer.visible_share[:] *= OPEN[:, None].astype(np.float32)
    return transfer, berlin


def with_noise(transfer, own, shared):
    """The Transfer with noise in the light of what is open: standard deviation of each surface,
    signs of the shared.
    """
    own, deviations = OPEN * own, NOISE * np.sqrt(3) * np.outer(OPEN * shared, SIGNS)
    parts = ErrorParts(deviations, np.zeros((COUNT, 4)), *np.zeros((4, COUNT)))
    error = np.sqrt(own**2 + deviations.var(axis=1, ddof=1) / 4)
    return replace(transfer, diffuse_relative_standard_error=error, error_parts=parts)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("own", "shared", "expected"),
    [
        (NOISE, 0.0, APART),
        (0.0, 1.0, 1.0),
        (0.0, np.where(np.arange(COUNT) // 2 % 2, 1.0, -1.0), 0.0),
    ],
    ids=["own", "shared", "shared with opposite signs"],
)
def test_own_noise_averages_out_and_shared_noise_does_not(walls, own, shared, expected):
    """All walls receive shared noise from the same places: in percent of the mean, over that of one
    surface.
    """
    transfer, weather = walls
    noisy = with_noise(transfer, np.full(COUNT, own), np.full(COUNT, 1.0) * shared)
    energy = compute_energy(noisy, weather)
    single = 100 * energy.full_load_hours_standard_error / energy.full_load_hours
    assert np.ptp(single) < 1e-3 * single[0]
    found = budget_errors(noisy, energy, weather)["sampling_total"] / single[0]
    assert found == pytest.approx(expected, rel=1e-4, abs=1e-4)


def test_covered_area_is_not_counted(walls):
    """The mean is over the open area, 8 of 10 m²: error and hours grow alike, and so does the
    group's error.
    """
    transfer, weather = walls
    noisy = with_noise(transfer, np.full(COUNT, NOISE), np.zeros(COUNT))
    energy = compute_energy(noisy, weather)
    assert energy.counted_area.sum() == pytest.approx(8 * COUNT)
    single = energy.full_load_hours_standard_error[1]  # of an open one
    assert energy.sampling_error == pytest.approx(single * APART, rel=1e-4)
    assert energy.group_standard_error[0] == pytest.approx(energy.sampling_error, rel=1e-9)


def test_a_wall_whose_error_is_unknown(walls):
    """It makes that of the mean unknown; one that is not counted does not."""
    transfer, weather = walls
    noisy = with_noise(transfer, np.full(COUNT, NOISE), np.zeros(COUNT))
    noisy.diffuse_relative_standard_error[3] = np.nan
    assert np.isnan(compute_energy(noisy, weather).sampling_error)
    hidden = replace(noisy, covered_share=np.where(np.arange(COUNT) == 3, 0.9, 0.0))
    assert compute_energy(hidden, weather).sampling_error > 0


# -- a year in leaf and bare: each state counts with its share of the year's light --

SUMMER = (5, 6, 7, 8, 9, 10)


@pytest.mark.parametrize(("leaf", "bare"), [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0)])
def test_each_state_has_its_share_of_the_year(walls, leaf, bare):
    """Noise in the diffuse light of one state makes an error in proportion to DHI of its months,
    from the weather.
    """
    transfer, weather = walls
    own = np.full(COUNT, NOISE)
    in_leaf, without = (with_noise(transfer, one * own, np.zeros(COUNT)) for one in (leaf, bare))
    seasonal = replace(in_leaf, bare=without, leaf_months=SUMMER)
    energy = compute_energy(seasonal, weather)
    summer = np.isin((weather.data.index + pd.Timedelta(minutes=30)).month, SUMMER)
    dhi = weather.data["dhi"].to_numpy() / 1000
    light = leaf * dhi[summer].sum() + bare * dhi[~summer].sum()
    expected = 100 * NOISE * light / energy.poa_global_annual[1]
    errors = split_errors(seasonal, weather, energy)
    assert errors.relative() == pytest.approx(np.full(COUNT, expected), rel=2e-4)
    group = budget_groups(seasonal, weather, energy, {})["facade south"]["sampling"]["percent"]
    assert group == pytest.approx(expected * APART, rel=2e-4)
    # Both states take their time.
    took = replace(seasonal.record, seconds={"suns": 2.0})
    timed = replace(
        seasonal, record=took, bare=replace(without, record=replace(took, seconds={"suns": 3.0}))
    )
    assert seconds_of_rounds(timed) == 5.0


MEASURED = {"bias": 0.5, "of_groups": 1.0, "rms": 2.0}


@pytest.fixture(scope="module")
def run(berlin):
    """Transfer of three houses with an error of sun sampling, weather and energy."""
    transfer = run_gather(three_houses(), SUNS, samples=64, shadow_samples=16, threads=1)
    transfer = replace(transfer, record=replace(transfer.record, sun_sampling=MEASURED))
    return transfer, berlin, compute_energy(transfer, berlin, threads=1)


def test_sources_add_up_to_the_stated_error(run):
    transfer, weather, energy = run
    errors = split_errors(transfer, weather, energy)
    chosen = np.isin(energy.full_load_hours, errors.hours) & energy.eligible
    stated = energy.full_load_hours_standard_error[chosen]
    assert np.sqrt(sum(errors.variance.values())) == pytest.approx(stated, rel=1e-9)
    assert set(errors.variance) == set(SOURCES)
    assert all((part >= 0).all() for part in errors.variance.values())
    assert errors.variance["shadows"].max() > 0


def test_groups_add_up_to_their_stated_error(run):
    transfer, weather, energy = run
    budget = budget_groups(transfer, weather, energy, {"facade south": 0.004})
    for name, stated in zip(energy.groups, energy.group_standard_error, strict=True):
        found = budget[" ".join(name)]
        parts = [found[source]["hours"] for source in ("sampling", "sun_sampling", "patch_size")]
        assert np.sqrt(np.sum(np.square(parts))) == pytest.approx(stated, rel=1e-6)
    assert budget["facade south"]["sun_sampling"]["percent"] == pytest.approx(1.0)
    assert budget["facade south"]["cut_reflections"]["percent"] == pytest.approx(0.4)
    assert budget["facade north"]["cut_reflections"]["percent"] is None


def test_the_last_sentence_names_the_largest_part(run):
    transfer, weather, energy = run
    many = replace(transfer, record=replace(transfer.record, sun_sampling={"rms": 50.0}))
    assert "most of it is due to the choice of suns: --suns" in suggest_more(many, weather, energy)
    nothing = np.zeros(len(transfer.surfaces))
    parts = replace(
        transfer.error_parts, diffuse_discretisation=nothing, direct_discretisation=nothing
    )
    alone = replace(transfer, error_parts=parts, record=replace(transfer.record, sun_sampling=None))
    assert "s more would halve it" in suggest_more(alone, weather, energy)
    assert " times the samples would halve it" in suggest_more(alone, weather, energy, timed=False)
    untimed = replace(alone, record=replace(alone.record, seconds={"suns": np.nan}))
    assert " times the samples would halve it" in suggest_more(untimed, weather, energy)


def test_the_sky_model_moves_walls_as_published(berlin):
    """Perez over isotropic, Berlin 2017, by pvlib: south wall +12.1, north wall -8.4 %, and nothing
    on level ground.
    """
    planes = np.array([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    south, north, level = change_unshaded(berlin, planes, 0.2)
    assert [south, north] == pytest.approx([0.121, -0.084], abs=0.003) and level == pytest.approx(
        0, abs=1e-3
    )


def test_the_sky_model_of_a_group_is_that_of_its_planes(run):
    transfer, weather, energy = run
    found = budget_groups(transfer, weather, energy, {})["facade south"]["sky_model"]["percent"]
    south = np.array([[0.0, -1.0, 0.0]])
    assert found == pytest.approx(
        100 * change_unshaded(weather, south, transfer.ground_albedo)[0], abs=0.01
    )


def test_a_scene_without_eligible_surfaces_has_no_sources(run):
    transfer, weather, _ = run
    dark = replace(
        transfer,
        surfaces=replace(transfer.surfaces, eligible=np.zeros(len(transfer.surfaces), bool)),
    )
    energy = compute_energy(dark, weather, threads=1)
    assert len(split_errors(dark, weather, energy).hours) == 0
    assert not suggest_more(dark, weather, energy)
