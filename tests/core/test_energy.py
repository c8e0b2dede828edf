"""Irradiance and full load hours against pvlib called directly."""

from dataclasses import replace

import numpy as np
import pytest
from planes import run_chain
from transfers import Horizons, unshaded_transfer
from weathers import HOUR

from citypv.core.energy import compute_energy as module_under_test
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.sum_block import filled_share
from citypv.core.sun.sun_sampling import choose_suns

TILT = [90, 90, 90, 90, 30, 30, 0, 45, 60, 90, 15, 75]
AZIMUTH = [180, 90, 270, 0, 180, 0, 0, 135, 350, 210, 45, 300]


def suns_of(weather, way):
    return choose_suns(way, *weather.axis)


@pytest.mark.parametrize(
    ("plain", "way"), [(True, "hourly"), (False, "days:24"), (True, "typical-days:12"), (False, "sky-grid:300")]
)
def test_unshaded_surfaces_equal_pvlib(berlin, way, plain, monkeypatch):
    monkeypatch.setattr(module_under_test, "PLAIN_LIMIT", 1e12 if plain else 0)
    transfer = unshaded_transfer(suns_of(berlin, way), TILT, AZIMUTH)
    energy = compute_energy(transfer, berlin)
    tolerance = 1e-9 if plain else 1e-4
    for row, (tilt, azimuth) in enumerate(zip(TILT, AZIMUTH, strict=True)):
        poa, capacity_factor = run_chain(berlin.data, tilt, azimuth)
        month = (capacity_factor.index + HOUR / 2).month
        by_month = capacity_factor.groupby(month).sum()
        assert energy.poa_global_annual[row] == pytest.approx(poa.sum() / 1000, rel=min(tolerance, 1e-6))
        assert energy.full_load_hours[row] == pytest.approx(capacity_factor.sum(), rel=tolerance)
        np.testing.assert_allclose(energy.full_load_hours_by_month[row], by_month, rtol=10 * tolerance, atol=1e-3)
    assert energy.years == 1


def test_hourly_shaded_surfaces_equal_pvlib_hour_by_hour(berlin):
    """One surface at a time, with the visible share of every hour put into pvlib by hand."""
    horizons = Horizons(5, 1)
    suns = suns_of(berlin, "hourly")
    transfer = horizons.transfer(suns)
    energy = compute_energy(transfer, berlin)
    data = berlin.data
    sunny = (data["apparent_zenith"] <= 88).to_numpy()
    for row in range(5):
        share, reflected = np.zeros(len(data)), np.zeros(len(data))
        share[sunny] = transfer.visible_share[row]
        reflected[sunny] = transfer.direct_reflected[row]
        ground = 0.25 * transfer.far_ground_view_factor[row] * np.cos(np.radians(data["apparent_zenith"]))
        diffuse = data["dhi"] * transfer.diffuse_relative[row] + data["dni"] * (reflected + ground)
        plane = horizons.tilt[row], horizons.azimuth[row]
        poa, capacity_factor = run_chain(berlin.data, *plane, share=share, diffuse=diffuse)
        assert energy.full_load_hours[row] == pytest.approx(capacity_factor.sum(), rel=1e-6)
        assert energy.poa_global_annual[row] == pytest.approx(poa.sum() / 1000, rel=1e-6)


@pytest.mark.once
def test_typical_days_and_sky_grid_come_near_every_hour(berlin):
    horizons = Horizons(300, 5)
    reference = compute_energy(horizons.transfer(suns_of(berlin, "hourly")), berlin)
    bounds = {"days:12": (0.01, 1e-3), "days:24": (0.003, 2e-4), "sky-grid:1654": (0.02, 2e-3)}
    bounds |= {"typical-days:12": (0.03, 5e-3), "typical-days:52": (0.01, 2e-3)}
    for way, (rms, bias) in bounds.items():
        energy = compute_energy(horizons.transfer(suns_of(berlin, way)), berlin)
        ratio = energy.full_load_hours / reference.full_load_hours - 1
        assert np.sqrt(np.mean(ratio**2)) < rms
        assert abs(energy.full_load_hours.sum() / reference.full_load_hours.sum() - 1) < bias


def test_ground_and_downward_have_no_full_load_hours(berlin):
    transfer = unshaded_transfer(suns_of(berlin, "typical-days:12"), [90, 135, 0], [180, 180, 0])
    transfer.surfaces.kind[2] = "ground"
    energy = compute_energy(transfer, berlin)
    assert np.isnan(energy.full_load_hours).tolist() == [False, True, True]
    assert np.isnan(energy.full_load_hours_standard_error).tolist() == [False, True, True]
    poa, _ = run_chain(berlin.data, 135, 180)
    assert energy.poa_global_annual[1] == pytest.approx(poa.sum() / 1000, rel=1e-9)
    assert energy.poa_global_annual[2] == pytest.approx(berlin.data["ghi"].sum() / 1000, rel=1e-6)


def test_standard_errors(berlin):
    """The weather's own sums carry the relative errors over."""
    transfer = Horizons(20, 0).transfer(suns_of(berlin, "typical-days:12"))
    energy = compute_energy(transfer, berlin)
    sums = berlin.data[["dni", "dhi"]].sum() / 1000
    poa_error = np.hypot(0.003 * sums["dni"], 0.002 * sums["dhi"])
    expected = energy.full_load_hours * poa_error / energy.poa_global_annual
    np.testing.assert_allclose(energy.full_load_hours_standard_error, expected)
    np.testing.assert_array_equal(energy.direct_relative_annual_standard_error, 0.003)


def test_result_does_not_depend_on_threads_and_is_reported(berlin, monkeypatch):
    monkeypatch.setattr(module_under_test, "PLAIN_LIMIT", 0)
    monkeypatch.setattr(module_under_test, "BLOCK", 64)
    transfer = Horizons(300, 2).transfer(suns_of(berlin, "typical-days:4"))
    reports = []
    one = compute_energy(transfer, berlin, threads=1)
    three = compute_energy(transfer, berlin, threads=3, progress=lambda *report: reports.append(report))
    np.testing.assert_array_equal(one.full_load_hours, three.full_load_hours)
    np.testing.assert_array_equal(one.capacity_factor, three.capacity_factor)
    done = [report[1] for report in reports]
    assert len(reports) > 3 and done == sorted(done) and done[-1] == reports[-1][2] > 0


def test_a_sun_behind_takes_the_share_of_the_sky_in_front(berlin):
    """An east wall that sees half of its sky: suns in front keep what was traced, those behind stand for half of it."""
    suns = suns_of(berlin, "typical-days:2")
    transfer = unshaded_transfer(suns, [90.0], [90.0])
    front = suns.direction[:, 0] > 0
    transfer = replace(transfer, visible_share=np.where(front, 0.3, 0.0)[None], sky_view_factor=np.array([0.25]))
    np.testing.assert_allclose(filled_share(transfer, slice(None))[:, 0], np.where(front, 0.3, 0.5), rtol=1e-6)
