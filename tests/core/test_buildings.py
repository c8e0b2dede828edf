"""What buildings yield: their sums, errors, hours and poor years."""

import numpy as np
import pandas as pd
import pytest
from transfers import Horizons

from citypv.core.energy.compute_energy import compute_building_power, compute_energy
from citypv.core.energy.energy import exceeded_energy, sum_potential
from citypv.core.energy.pv_system import build_system
from citypv.core.results.write_buildings import write_buildings
from citypv.core.settings.request import Request
from citypv.core.sun.sun_sampling import choose_suns

KWP = 5.431181  # [m²/kWp] of the default module: 1.631 m², 300.303 W


def test_buildings_sum_up(berlin, tmp_path):
    suns = choose_suns("typical-days:4", *berlin.axis)
    transfer = Horizons(60, 4).transfer(suns)
    transfer.covered_share[::3] = 0.4
    system = build_system(Request(losses=10.0, inverter=None, usable={"facade": 0.7}))
    energy = compute_energy(transfer, berlin, system)
    write_buildings(tmp_path / "buildings.csv", transfer, energy, system, berlin, monthly=True)
    table = pd.read_csv(tmp_path / "buildings.csv").set_index("building_id")
    assert sorted(table.index) == sorted(set(transfer.surfaces.building_id))
    total = sum_potential(energy.eligible, transfer.surfaces.area, energy, system)
    for name in ("eligible_area", "module_area", "kwp", "mwh_per_year", "mwh_dc_per_year"):
        assert table[name].sum() == pytest.approx(total[name], rel=1e-4)
    assert total["mwh_per_year"] == pytest.approx(0.9 * total["mwh_dc_per_year"], rel=1e-9)
    # Noise of own rays is independent from surface to surface, and with it those of a building's energy.
    kwp = np.where(energy.eligible, energy.module_area / KWP * transfer.surfaces.area, 0)
    kwp = np.divide(kwp, energy.counted_area, out=np.zeros(60), where=energy.counted_area > 0)
    ids = np.array(transfer.surfaces.building_id)
    noise = (kwp * np.nan_to_num(energy.full_load_hours_standard_error)) ** 2
    expected = [np.sqrt(noise[ids == name].sum()) / 1000 for name in table.index]
    np.testing.assert_allclose(table["mwh_standard_error"], expected, rtol=1e-4)
    parts = table[[f"{part}_mwh_per_year" for part in ("facade", "roof", "flat_roof")]].sum(axis=1)
    np.testing.assert_allclose(parts, table["mwh_per_year"], rtol=1e-4)
    # Of every hour: kW of a building is what its surfaces give one by one.
    names, power = compute_building_power(transfer, berlin, energy, system, threads=1)
    assert names.tolist() == table.index.tolist()
    series = compute_energy(transfer, berlin, system, series=np.arange(60)).series.capacity_factor * kwp
    for column, name in enumerate(names):
        np.testing.assert_allclose(power[:, column], series[:, ids == name].sum(axis=1), atol=2e-3)
    np.testing.assert_allclose(power.sum(axis=0) / 1000, table["mwh_per_year"], rtol=1e-4)
    months = table[[f"full_load_hours_{month:02d}" for month in range(1, 13)]].sum(axis=1)
    np.testing.assert_allclose(months, table["full_load_hours"].fillna(0), rtol=1e-4)
    some = table[table["kwp"] > 0]
    np.testing.assert_allclose(some["full_load_hours"] * some["kwp"], 1000 * some["mwh_per_year"], rtol=1e-4)


def test_energy_that_is_exceeded():
    """Of nine years the lowest is the tenth part's bound, of 19 the second."""
    years = np.random.default_rng(0).permutation(np.arange(1.0, 20.0))
    assert exceeded_energy(years) == {"p50": 10.0, "p90": pytest.approx(2.0)}
    assert exceeded_energy(years[years < 10]) == {"p50": 5.0, "p90": pytest.approx(1.0)}
    assert exceeded_energy(np.array([[3.0, 7.0], [1.0, 9.0]]))["p90"].tolist() == [1.0, 7.0]
    assert exceeded_energy(years[:1]) == {}
