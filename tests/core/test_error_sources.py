"""The error budget by source: parts add up to the whole, and each stands for what it names."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import run_gather
from test_closed_forms import SUNS
from test_tracing import three_houses

from citypv.core.accuracy.error_budget import budget_groups, suggest_more
from citypv.core.accuracy.yield_errors import SOURCES, split_errors
from citypv.core.effects.beyond_scene import change_unshaded
from citypv.core.energy.compute_energy import compute_energy

pytestmark = pytest.mark.once
MEASURED = {"bias": 0.5, "rms": 2.0, "groups": {"facade south": {"bias": -1.0, "rms": 3.0}}}


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
    budget = budget_groups(transfer, weather, energy, 0.4)
    for name, stated in zip(energy.groups, energy.group_standard_error, strict=True):
        found = budget[" ".join(name)]
        parts = [found[source]["hours"] for source in ("sampling", "sun_sampling", "patch_size")]
        assert np.sqrt(np.sum(np.square(parts))) == pytest.approx(stated, rel=1e-6)
        assert found["cut_reflections"]["percent"] == pytest.approx(0.4)
    assert budget["facade south"]["sun_sampling"]["percent"] == pytest.approx(-1.0)


def test_the_last_sentence_names_the_largest_part(run):
    transfer, weather, energy = run
    many = replace(transfer, record=replace(transfer.record, sun_sampling={"rms": 50.0}))
    assert "most of it is due to the choice of suns: --suns" in suggest_more(many, weather, energy)
    nothing = np.zeros(len(transfer.surfaces))
    parts = replace(transfer.error_parts, diffuse_discretisation=nothing, direct_discretisation=nothing)
    alone = replace(transfer, error_parts=parts, record=replace(transfer.record, sun_sampling=None))
    assert "s more would halve it" in suggest_more(alone, weather, energy)


def test_the_sky_model_moves_walls_as_published(berlin):
    """Perez over isotropic, Berlin 2017, by pvlib: south wall +12.1, north wall -8.4 %, and nothing on level ground."""
    planes = np.array([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    south, north, level = change_unshaded(berlin, planes, 0.2)
    assert [south, north] == pytest.approx([0.121, -0.084], abs=0.003) and level == pytest.approx(0, abs=1e-3)


def test_the_sky_model_of_a_group_is_that_of_its_planes(run):
    transfer, weather, energy = run
    found = budget_groups(transfer, weather, energy, 0.4)["facade south"]["sky_model"]["percent"]
    south = np.array([[0.0, -1.0, 0.0]])
    assert found == pytest.approx(100 * change_unshaded(weather, south, transfer.ground_albedo)[0], abs=0.01)


def test_a_scene_without_eligible_surfaces_has_no_sources(run):
    transfer, weather, _ = run
    dark = replace(transfer, surfaces=replace(transfer.surfaces, eligible=np.zeros(len(transfer.surfaces), bool)))
    energy = compute_energy(dark, weather, threads=1)
    assert len(split_errors(dark, weather, energy).hours) == 0
    assert not suggest_more(dark, weather, energy)
