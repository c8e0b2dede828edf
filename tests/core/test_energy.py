"""Irradiance and full load hours against pvlib called directly."""

from dataclasses import replace

import numpy as np
import pvlib
import pytest
from planes import DC, run_chain
from transfers import Horizons, unshaded_transfer
from weathers import BARROW, HOUR

from citypv.core.energy import compute_energy as module_under_test
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.hours import prepare_hours
from citypv.core.energy.pv_system import build_system, dc_system
from citypv.core.energy.sum_block import filled_share
from citypv.core.settings.request import Request
from citypv.core.sun.sky_models import split_sky
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.weather.read_weather import read_weather

TILT = [90, 90, 90, 90, 30, 30, 0, 45, 60, 90, 15, 75]
AZIMUTH = [180, 90, 270, 0, 180, 0, 0, 135, 350, 210, 45, 300]


def suns_of(weather, way):
    return choose_suns(way, *weather.axis)


def test_cell_temperature_of_the_chain():
    """The same from the slope that the tables use."""
    weather = read_weather("clear-sky", 0.0, 0.0)
    weather.data["temp_air"], weather.data["wind_speed"] = 20.0, 5.0
    hours = prepare_hours(suns_of(weather, "hourly"), weather, dc_system(), split_sky(weather, "isotropic"))
    assert 900 * hours.heating[0, 0] + hours.temp_air[0, 0] == pytest.approx(40.291, abs=5e-4)


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


def test_relative_direct_irradiance_of_unshaded_surfaces(berlin):
    """Mean over the intervals above 2° of paper, Eq. 11."""
    transfer = unshaded_transfer(suns_of(berlin, "typical-days:12"), TILT, AZIMUTH)
    energy = compute_energy(transfer, berlin)
    data = berlin.data[berlin.data["apparent_zenith"] <= 88]
    for row, (tilt, azimuth) in enumerate(zip(TILT, AZIMUTH, strict=True)):
        aoi = pvlib.irradiance.aoi_projection(tilt, azimuth, data["apparent_zenith"], data["solar_azimuth"])
        ground = (1 - np.cos(np.radians(tilt))) / 2
        relative = np.maximum(aoi, 0) + 0.25 * ground * np.cos(np.radians(data["apparent_zenith"]))  # Eq. 11
        assert energy.direct_relative_annual[row] == pytest.approx(relative.mean(), rel=1e-9)


@pytest.mark.once
def test_polar_weather_and_another_module():
    barrow = read_weather(BARROW, 71.3, -156.8)
    name = "Canadian_Solar_CS5P_220M___2009_"
    transfer = unshaded_transfer(suns_of(barrow, "typical-days:12"), TILT, AZIMUTH)
    energy = compute_energy(transfer, barrow, build_system(Request(module=name, **DC)))
    for row in (0, 3, 4, 6):
        poa, capacity_factor = run_chain(barrow.data, TILT[row], AZIMUTH[row], name=name)
        assert energy.full_load_hours[row] == pytest.approx(capacity_factor.sum(), rel=1e-9)
        assert energy.poa_global_annual[row] == pytest.approx(poa.sum() / 1000, rel=1e-9)
    assert np.isfinite(energy.full_load_hours).all()
    assert (energy.full_load_hours_by_month[:, 11] < 1).all()  # December is night


@pytest.mark.parametrize("way", ["days:24", "sky-grid:1000", "hourly"])
def test_tables_equal_pvlib_on_shaded_surfaces(berlin, way, monkeypatch):
    transfer = Horizons(200, 3).transfer(suns_of(berlin, way))
    monkeypatch.setattr(module_under_test, "PLAIN_LIMIT", 1e12)
    plain = compute_energy(transfer, berlin)
    monkeypatch.setattr(module_under_test, "PLAIN_LIMIT", 0)
    fast = compute_energy(transfer, berlin)
    np.testing.assert_allclose(fast.full_load_hours, plain.full_load_hours, rtol=5e-5)
    np.testing.assert_allclose(fast.poa_global_annual, plain.poa_global_annual, rtol=1e-6)
    np.testing.assert_allclose(fast.direct_relative_annual, plain.direct_relative_annual, rtol=1e-6)
    np.testing.assert_allclose(fast.capacity_factor, plain.capacity_factor, atol=5e-5)


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


def test_no_surface_at_all(berlin):
    energy = compute_energy(unshaded_transfer(suns_of(berlin, "typical-days:4"), [], []), berlin)
    assert len(energy.full_load_hours) == 0 and energy.groups == [] and energy.capacity_factor.shape == (8760, 0)


def test_a_sun_behind_takes_the_share_of_the_sky_in_front(berlin):
    """An east wall that sees half of its sky: suns in front keep what was traced, those behind stand for half of it."""
    suns = suns_of(berlin, "typical-days:2")
    transfer = unshaded_transfer(suns, [90.0], [90.0])
    front = suns.direction[:, 0] > 0
    transfer = replace(transfer, visible_share=np.where(front, 0.3, 0.0)[None], sky_view_factor=np.array([0.25]))
    np.testing.assert_allclose(filled_share(transfer, slice(None))[:, 0], np.where(front, 0.3, 0.5), rtol=1e-6)
