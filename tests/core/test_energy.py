"""Irradiance and full load hours against pvlib called directly, and what buildings yield."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from planes import run_chain
from thorough import mark_cases
from transfers import Horizons, unshaded_transfer
from weathers import HOUR

from citypv.core.energy import compute_energy as module_under_test
from citypv.core.energy.building_power import compute_building_hours, compute_building_power
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.energy import exceeded_energy
from citypv.core.energy.pv_system import build_system, dc_system
from citypv.core.energy.sum_block import filled_share
from citypv.core.results.write_buildings import write_buildings
from citypv.core.settings.request import Request
from citypv.core.sun.sun_sampling import choose_suns

TILT = [90, 90, 90, 90, 30, 30, 0, 45, 60, 90, 15, 75]
AZIMUTH = [180, 90, 270, 0, 180, 0, 0, 135, 350, 210, 45, 300]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("plain", "way"),
    mark_cases(
        [(True, "hourly"), (False, "days:24"), (True, "typical-days:12"), (False, "sky-grid:300")],
        law=(0, 1),
    ),
)
def test_unshaded_surfaces_equal_pvlib(berlin, way, plain, monkeypatch):
    monkeypatch.setattr(module_under_test, "PLAIN_LIMIT", 1e12 if plain else 0)
    transfer = unshaded_transfer(choose_suns(way, *berlin.axis), TILT, AZIMUTH)
    energy = compute_energy(transfer, berlin)
    tolerance = 1e-9 if plain else 1e-4
    for row, (tilt, azimuth) in enumerate(zip(TILT, AZIMUTH, strict=True)):
        poa, capacity_factor = run_chain(berlin.data, tilt, azimuth)
        month = (capacity_factor.index + HOUR / 2).month
        by_month = capacity_factor.groupby(month).sum()
        assert energy.poa_global_annual[row] == pytest.approx(
            poa.sum() / 1000, rel=min(tolerance, 1e-6)
        )
        assert energy.full_load_hours[row] == pytest.approx(capacity_factor.sum(), rel=tolerance)
        np.testing.assert_allclose(
            energy.full_load_hours_by_month[row], by_month, rtol=10 * tolerance, atol=1e-3
        )
    assert energy.years == 1


@pytest.mark.slow
def test_hourly_shaded_surfaces_equal_pvlib_hour_by_hour(berlin):
    """One surface at a time, with the visible share of every hour put into pvlib by hand."""
    horizons = Horizons(5, 1)
    suns = choose_suns("hourly", *berlin.axis)
    transfer = horizons.transfer(suns)
    energy = compute_energy(transfer, berlin)
    data = berlin.data
    sunny = (data["apparent_zenith"] <= 88).to_numpy()
    for row in range(5):
        share, reflected = np.zeros(len(data)), np.zeros(len(data))
        share[sunny] = transfer.visible_share[row]
        reflected[sunny] = transfer.direct_reflected[row]
        ground = (
            0.25
            * transfer.far_ground_view_factor[row]
            * np.cos(np.radians(data["apparent_zenith"]))
        )
        diffuse = data["dhi"] * transfer.diffuse_relative[row] + data["dni"] * (reflected + ground)
        plane = horizons.tilt[row], horizons.azimuth[row]
        poa, capacity_factor = run_chain(berlin.data, *plane, share=share, diffuse=diffuse)
        assert energy.full_load_hours[row] == pytest.approx(capacity_factor.sum(), rel=1e-6)
        assert energy.poa_global_annual[row] == pytest.approx(poa.sum() / 1000, rel=1e-6)


@pytest.mark.slow
def test_typical_days_and_sky_grid_come_near_every_hour(berlin):
    horizons = Horizons(300, 5)
    reference = compute_energy(horizons.transfer(choose_suns("hourly", *berlin.axis)), berlin)
    bounds = {"days:12": (0.01, 1e-3), "days:24": (0.003, 2e-4), "sky-grid:1654": (0.02, 2e-3)}
    bounds |= {"typical-days:12": (0.03, 5e-3), "typical-days:52": (0.01, 2e-3)}
    for way, (rms, bias) in bounds.items():
        energy = compute_energy(horizons.transfer(choose_suns(way, *berlin.axis)), berlin)
        ratio = energy.full_load_hours / reference.full_load_hours - 1
        assert np.sqrt(np.mean(ratio**2)) < rms
        assert abs(energy.full_load_hours.sum() / reference.full_load_hours.sum() - 1) < bias


@pytest.mark.slow
def test_ground_and_downward_have_no_full_load_hours(berlin):
    transfer = unshaded_transfer(
        choose_suns("typical-days:12", *berlin.axis), [90, 135, 0], [180, 180, 0]
    )
    transfer.surfaces.kind[2] = "ground"
    energy = compute_energy(transfer, berlin)
    assert np.isnan(energy.full_load_hours).tolist() == [False, True, True]
    assert np.isnan(energy.full_load_hours_standard_error).tolist() == [False, True, True]
    poa, _ = run_chain(berlin.data, 135, 180)
    assert energy.poa_global_annual[1] == pytest.approx(poa.sum() / 1000, rel=1e-9)
    assert energy.poa_global_annual[2] == pytest.approx(berlin.data["ghi"].sum() / 1000, rel=1e-6)


@pytest.mark.slow
def test_standard_errors(berlin):
    """The weather's own sums carry the relative errors over."""
    transfer = Horizons(20, 0).transfer(choose_suns("typical-days:12", *berlin.axis))
    energy = compute_energy(transfer, berlin)
    sums = berlin.data[["dni", "dhi"]].sum() / 1000
    poa_error = np.hypot(0.003 * sums["dni"], 0.002 * sums["dhi"])
    expected = energy.full_load_hours * poa_error / energy.poa_global_annual
    np.testing.assert_allclose(energy.full_load_hours_standard_error, expected)
    np.testing.assert_array_equal(energy.direct_relative_annual_standard_error, 0.003)


@pytest.mark.slow
def test_result_does_not_depend_on_threads_and_is_reported(berlin, monkeypatch):
    monkeypatch.setattr(module_under_test, "PLAIN_LIMIT", 0)
    monkeypatch.setattr(module_under_test, "BLOCK", 64)
    transfer = Horizons(300, 2).transfer(choose_suns("typical-days:4", *berlin.axis))
    reports = []
    one = compute_energy(transfer, berlin, threads=1)
    three = compute_energy(
        transfer, berlin, threads=3, progress=lambda *report: reports.append(report)
    )
    np.testing.assert_array_equal(one.full_load_hours, three.full_load_hours)
    np.testing.assert_array_equal(one.capacity_factor, three.capacity_factor)
    done = [report[1] for report in reports]
    assert len(reports) > 3 and done == sorted(done) and done[-1] == reports[-1][2] > 0


@pytest.mark.slow
def test_a_sun_behind_takes_the_share_of_the_sky_in_front(berlin):
    """An east wall that sees half of its sky: suns in front keep what was traced, those behind
    stand for half of it.
    """
    suns = choose_suns("typical-days:2", *berlin.axis)
    transfer = unshaded_transfer(suns, [90.0], [90.0])
    front = suns.direction[:, 0] > 0
    transfer = replace(
        transfer, visible_share=np.where(front, 0.3, 0.0)[None], sky_view_factor=np.array([0.25])
    )
    np.testing.assert_allclose(
        filled_share(transfer, slice(None))[:, 0], np.where(front, 0.3, 0.5), rtol=1e-6
    )


KWP = 5.431181  # [m²/kWp] of the default module: 1.631 m², 300.303 W


@pytest.mark.slow
def test_buildings_sum_up(berlin, tmp_path):
    suns = choose_suns("typical-days:4", *berlin.axis)
    transfer = Horizons(60, 4).transfer(suns)
    transfer.covered_share[::3] = 0.4
    system = build_system(Request(losses=10.0, inverter=None, usable={"facade": 0.7}))
    energy = compute_energy(transfer, berlin, system)
    write_buildings(tmp_path / "buildings.csv", transfer, energy, berlin, monthly=True)
    table = pd.read_csv(tmp_path / "buildings.csv").set_index("building_id")
    assert sorted(table.index) == sorted(set(transfer.surfaces.building_id))
    total = energy.sum_potential(energy.eligible, transfer.surfaces.area)
    for name in ("eligible_area", "module_area", "kwp", "mwh_per_year", "mwh_dc_per_year"):
        assert table[name].sum() == pytest.approx(total[name], rel=1e-4)
    assert total["mwh_per_year"] == pytest.approx(0.9 * total["mwh_dc_per_year"], rel=1e-9)
    # Noise of own rays is independent from surface to surface, and with it those of a building's
    # energy.
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
    series = (
        compute_energy(transfer, berlin, system, series=np.arange(60)).series.capacity_factor * kwp
    )
    for column, name in enumerate(names):
        np.testing.assert_allclose(power[:, column], series[:, ids == name].sum(axis=1), atol=2e-3)
    np.testing.assert_allclose(power.sum(axis=0) / 1000, table["mwh_per_year"], rtol=1e-4)
    # By month and hour of the day: means of these hours; Berlin lies nearest to 15° east.
    middle = berlin.data.index + berlin.interval / 2
    places = [middle.month, middle.tz_convert("Etc/GMT-1").hour]
    expected = pd.DataFrame(power.astype(float)).groupby(places).mean().to_numpy()
    names, by_hour, _ = compute_building_hours(transfer, berlin, energy, system)
    assert names.tolist() == table.index.tolist() and by_hour.shape == (len(names), 12, 24)
    np.testing.assert_allclose(
        by_hour.reshape(-1, 288).T, expected, rtol=1e-4, atol=1e-4 * expected.max()
    )
    months = table[[f"full_load_hours_{month:02d}" for month in range(1, 13)]].sum(axis=1)
    np.testing.assert_allclose(months, table["full_load_hours"].fillna(0), rtol=1e-4)
    some = table[table["kwp"] > 0]
    np.testing.assert_allclose(
        some["full_load_hours"] * some["kwp"], 1000 * some["mwh_per_year"], rtol=1e-4
    )


@pytest.mark.slow
def test_hours_of_many_years_are_those_of_every_day(berlin):
    """Three equal years, of which every third day counts: all days of a year, each once."""
    transfer = unshaded_transfer(choose_suns("typical-days:1", *berlin.axis), [90, 30], [180, 90])
    years = [berlin.data.set_index(berlin.data.index + pd.Timedelta(days=k)) for k in (0, 365, 730)]
    three = replace(berlin, data=pd.concat(years))
    hours = [
        compute_building_hours(transfer, weather, compute_energy(transfer, weather), dc_system())[1]
        for weather in (berlin, three)
    ]
    np.testing.assert_allclose(hours[1], hours[0], rtol=1e-5, atol=1e-5)


def test_energy_that_is_exceeded():
    """Of nine years the lowest is the tenth part's bound, of 19 the second."""
    years = np.random.default_rng(0).permutation(np.arange(1.0, 20.0))
    assert exceeded_energy(years) == {"p50": 10.0, "p90": pytest.approx(2.0)}
    assert exceeded_energy(years[years < 10]) == {"p50": 5.0, "p90": pytest.approx(1.0)}
    assert exceeded_energy(np.array([[3.0, 7.0], [1.0, 9.0]]))["p90"].tolist() == [1.0, 7.0]
    assert exceeded_energy(years[:1]) == {}
