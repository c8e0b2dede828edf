"""The hours of the months' average days against pvlib called directly, pandas, and the yearly
energy.
"""

from dataclasses import replace

import numpy as np
import pandas as pd
import pvlib
import pytest
from thorough import mark_cases
from transfers import Horizons, unshaded_transfer
from weathers import HOUR

from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.pv_system import dc_system
from citypv.core.energy.timeline import (
    Timeline,
    mean_of_months,
    month_hours,
    relative_direct,
)
from citypv.core.sun.sun_sampling import choose_suns

TILT, AZIMUTH = [90, 90, 90, 90, 30, 0, 110], [180, 90, 270, 0, 200, 0, 150]
LATITUDE, LONGITUDE = 52.51, 13.39


@pytest.mark.slow
@pytest.mark.parametrize("way", mark_cases(["hourly", "days:24", "sky-grid:300"], kept=1))
def test_unshaded_surfaces_have_the_irradiance_of_pvlib(berlin, way):
    transfer = unshaded_transfer(choose_suns(way, *berlin.axis), TILT, AZIMUTH)
    times = month_hours(2017, LONGITUDE)
    relative, direction = relative_direct(transfer, times, HOUR, LATITUDE, LONGITUDE)
    sun = pvlib.solarposition.get_solarposition(times + HOUR / 2, LATITUDE, LONGITUDE)
    zenith, azimuth = sun["apparent_zenith"].to_numpy(), sun["azimuth"].to_numpy()
    lit = zenith < 88
    np.testing.assert_allclose(direction[:, 2], np.cos(np.radians(zenith)), atol=1e-9)
    for row, (tilt, turn) in enumerate(zip(TILT, AZIMUTH, strict=True)):
        cosine = np.maximum(pvlib.irradiance.aoi_projection(tilt, turn, zenith, azimuth), 0)
        ground = 0.25 * (1 - np.cos(np.radians(tilt))) / 2 * np.cos(np.radians(zenith))
        np.testing.assert_allclose(relative[:, row], np.where(lit, cosine + ground, 0), atol=2e-6)


@pytest.mark.law
def test_shaded_surfaces_have_the_shares_of_their_skyline(berlin):
    # With a traced sun for every hour, the error is that of the nearest hour of the year: some
    # degrees of a soft edge.
    horizons = Horizons(40)
    transfer = horizons.transfer(choose_suns("hourly", *berlin.axis))
    relative, direction = relative_direct(
        transfer, month_hours(2017, LONGITUDE), HOUR, LATITUDE, LONGITUDE
    )
    lit = direction[:, 2] > np.sin(np.radians(2))
    height = np.maximum(direction[lit, 2:], 0)
    expected = horizons.visible(direction[lit]).T * np.maximum(
        direction[lit] @ transfer.surfaces.normal.T, 0
    )
    expected += horizons.reflected[:, 0] + height * 0.25 * transfer.far_ground_view_factor
    assert np.abs(relative[lit] - expected).mean() < 0.005
    assert not relative[~lit].any()


def test_the_average_days_are_those_of_the_monthly_mean_declination():
    # Klein's days: solar declination within 1° of the month's mean.
    times = month_hours(2021, 0.0)
    assert (len(times), times[0], times[-1]) == (
        288,
        pd.Timestamp("2021-01-17", tz="UTC"),
        times[264] + 23 * HOUR,
    )
    every = pd.date_range("2021-01-01 12:00", "2021-12-31 12:00", tz="UTC")
    declination = np.degrees(
        pvlib.solarposition.declination_spencer71(every.day_of_year.to_numpy())
    )
    mean = pd.Series(declination, every).groupby(every.month).mean().to_numpy()
    own = np.degrees(pvlib.solarposition.declination_spencer71(times[::24].day_of_year.to_numpy()))
    np.testing.assert_allclose(own, mean, atol=1.0)


def test_hours_are_those_of_the_standard_time():
    assert month_hours(2021, 139.7)[0] == pd.Timestamp("2021-01-16 15:00", tz="UTC")  # Tokyo, UTC+9
    assert month_hours(2021, -74.0)[0] == pd.Timestamp(
        "2021-01-17 05:00", tz="UTC"
    )  # New York, UTC-5


def test_the_weather_of_an_hour_is_its_mean_over_the_month(berlin):
    found = mean_of_months(berlin.data["dni"], berlin.data.index, berlin.interval, LONGITUDE)
    local = (berlin.data.index + berlin.interval / 2).tz_convert("Etc/GMT-1")
    pivot = berlin.data["dni"].groupby([local.month, local.hour]).mean()
    np.testing.assert_allclose(found, pivot.to_numpy(), rtol=1e-12)
    some = berlin.data.index < "2017-02-01"
    part = mean_of_months(
        berlin.data["dni"][some], berlin.data.index[some], berlin.interval, LONGITUDE
    )
    assert np.isnan(part[48:]).all()


def test_the_months_add_up_to_the_year(berlin):
    transfer, system = (
        unshaded_transfer(choose_suns("days:4", *berlin.axis), TILT, AZIMUTH),
        dc_system(),
    )
    energy = compute_energy(transfer, berlin, system)
    timeline = Timeline.build(transfer, berlin, energy)
    whole = energy.sum_potential(energy.eligible, transfer.surfaces.area)
    assert timeline.energy_by_month.sum() == pytest.approx(whole["mwh_per_year"], rel=1e-9)
    noon = 5 * 24 + 12
    np.testing.assert_allclose(
        timeline.irradiance(noon), timeline.relative[noon] * timeline.dni[noon], rtol=1e-6
    )
    text = timeline.describe(noon)
    assert text.startswith("June 12–13 h (UTC+1), sun 6")
    assert text.endswith(" MWh in June")
    assert "night" in timeline.describe(0)
    zones = [replace(timeline, zone=zone).describe(0).split("(")[1][:5] for zone in (0, -5)]
    assert zones == ["UTC),", "UTC−5"]
