"""Which sun: at zenith, on the horizon, in the plane of a wall, along a street; poles, date line
and calendars.
"""

import numpy as np
import pandas as pd
import pytest
from scenes import join, run_gather, strip, suns_towards
from thorough import mark_cases
from towns import turned

from citypv.core.commands.plain_scenes import box
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.sun.solar_position import solar_position, sun_direction
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.sun.suns import Suns
from citypv.core.weather.add_sun import add_sun, complete_irradiance
from citypv.core.weather.climate import clear_sky

HOUR = pd.Timedelta(hours=1)
GROUND = strip([-60, -60, 0], [120, 0, 0], [0, 120, 0], 6)
HOUSE = join([GROUND, *box((-5, -5, 0), (5, 5, 10))])
SOUTH, NORTH, EAST, WEST = (12 + np.arange(2) + 2 * side for side in (2, 3, 4, 5))
ROOF = np.array([12, 13])


def clear_year(latitude, longitude, altitude=0.0, year=2021):
    return add_sun(clear_sky(latitude, longitude, altitude, year), HOUR)


def energy_of(weather, latitude, longitude, way="typical-days:4"):
    """Of the house, under suns chosen from a year of clear sky."""
    suns = choose_suns(way, weather.data.index, HOUR, latitude, longitude)
    return compute_energy(run_gather(HOUSE, suns, shadow_samples=64), weather)


def visible(directions, scene=HOUSE, **settings):
    return run_gather(scene, suns_towards(directions), shadow_samples=64, **settings)


def test_at_zenith():
    transfer = visible([[0, 0, 1], [1e-9, -1e-9, 1]])
    walls = np.concatenate([SOUTH, NORTH, EAST, WEST])
    assert transfer.visible_share[walls].max() == 0
    assert transfer.visible_share[ROOF] == pytest.approx(1)
    ground = np.average(transfer.visible_share[:12], weights=transfer.surfaces.area[:12], axis=0)
    assert ground == pytest.approx(1 - 100 / 120**2, abs=0.005)
    assert transfer.direct_reflected[walls, 0] == pytest.approx(
        transfer.direct_reflected[walls, 1], abs=1e-5
    )


def test_on_the_horizon():
    """No light on level faces, full light on the wall that faces the sun; nothing is NaN."""
    transfer = visible([[0, -1, 0], [0, -1, 1e-9], [0, -1, -1e-9]], max_bounces=3)
    assert transfer.visible_share[ROOF].max() == 0
    assert transfer.visible_share[:12].max() == 0
    assert transfer.visible_share[SOUTH] == pytest.approx(1)
    assert np.isfinite(transfer.direct_reflected).all()
    assert transfer.direct_reflected.min() >= 0


@pytest.mark.parametrize(
    ("turn", "elevation"), [(0.0, 5.0), (17.3, 45.0), (45.0, 5.0), (89.99, 45.0)]
)
def test_exactly_in_the_plane_of_a_wall(turn, elevation):
    """Both walls beside the sun receive nothing, as the sun's cosine is 0 there; the wall that
    faces it everything.
    """
    parts = [
        (turned(points, turn), faces) for points, faces in [GROUND, *box((-5, -5, 0), (5, 5, 10))]
    ]
    e = np.radians(elevation)
    transfer = visible(turned([[0, -np.cos(e), np.sin(e)]], turn), join(parts))
    assert transfer.visible_share[EAST].max() == transfer.visible_share[WEST].max() == 0
    assert transfer.visible_share[SOUTH] == pytest.approx(1)


@pytest.mark.parametrize("elevation", [2.0, 30.0])
def test_exactly_along_a_street(elevation):
    """A street of 10 m between two blocks: its floor is lit over its whole length, its walls not at
    all.
    """
    blocks = box((-50, 5, 0), (50, 15, 20)) + box((-50, -15, 0), (50, -5, 20))
    floor = strip([-50, -5, 0], [100, 0, 0], [0, 10, 0], 4)
    e = np.radians(elevation)
    transfer = visible([[np.cos(e), 0, np.sin(e)]], join([floor, *blocks]), max_bounces=0)
    assert transfer.visible_share[:8] == pytest.approx(1)
    towards_street = [8 + 4, 8 + 5, 8 + 12 + 6, 8 + 12 + 7]
    assert transfer.surfaces.normal[towards_street, 1] == pytest.approx([-1, -1, 1, 1])
    assert transfer.visible_share[towards_street].max() == 0


def test_azimuth_0_is_azimuth_360():
    both = sun_direction(np.array([60.0, 60.0]), np.array([0.0, 360.0]))
    assert both[0] == pytest.approx(both[1], abs=1e-15)
    transfer = visible(both)
    assert np.array_equal(transfer.visible_share[:, 0], transfer.visible_share[:, 1])
    assert transfer.direct_reflected[:, 0] == pytest.approx(
        transfer.direct_reflected[:, 1], abs=1e-6
    )


def test_no_sun_above_the_horizon():
    """Polar night: no direct light, no NaN, the sky shines all the same."""
    none = np.zeros(0, np.int32)
    transfer = run_gather(HOUSE, Suns("hourly", np.zeros((0, 3)), np.zeros(0), none, none))
    assert (
        transfer.visible_share.shape == transfer.direct_reflected.shape == (len(HOUSE.surfaces), 0)
    )
    assert transfer.direct_annual_standard_error == pytest.approx(0)
    assert transfer.diffuse_relative[ROOF] == pytest.approx(1, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    "place",
    mark_cases([(0.0, 10.0), (90.0, 0.0), (-33.9, 18.4), (-16.8, 180.0)], kept=2, single=True),
)
def test_places(place):
    """A year of clear sky at the equator, a pole, in the south and on the date line: finite, dark
    while the sun is down, and the same beside the line as on it."""
    weather = clear_year(*place)
    assert np.isfinite(weather.data.to_numpy()).all()
    assert (weather.data["dni"][weather.data["apparent_zenith"] >= 90] == 0).all()
    assert weather.data["dni"].max() < 1200
    energy = energy_of(weather, *place)
    assert np.isfinite(energy.poa_global_annual).all()
    assert (energy.full_load_hours[ROOF] > 400).all()
    if place[0] < -30:
        assert energy.poa_global_annual[NORTH].mean() > 1.5 * energy.poa_global_annual[SOUTH].mean()
    elif place[1] == 180:
        west = place[0], -179.99
        assert energy_of(clear_year(*west), *west).poa_global_annual == pytest.approx(
            energy.poa_global_annual, rel=0.02
        )


def test_midnight_sun_and_polar_night():
    """At 80° N the sun is up around the clock in June and never in December."""
    weather = clear_year(80.0, 15.0).data
    june, december = weather.loc["2021-06-21"], weather.loc["2021-12-21"]
    assert (june["dni"] > 0).all()
    assert (december[["ghi", "dhi", "dni"]] == 0).all().all()


def test_equator_at_equinox_sees_the_sun_at_zenith():
    position = solar_position(pd.DatetimeIndex(["2021-03-20T12:07:30Z"]), pd.Timedelta(0), 0.0, 0.0)
    assert position["solar_zenith"].iloc[0] < 0.3
    direction = sun_direction(position["apparent_zenith"], position["solar_azimuth"])
    assert visible(direction).visible_share[ROOF] == pytest.approx(1)


@pytest.mark.slow
@pytest.mark.parametrize("zone", ["Europe/Berlin", "Australia/Lord_Howe"])
def test_summer_time_moves_no_sun(zone):
    """The same instants, named in a zone whose clocks jump."""
    times = pd.date_range("2021-01-01", "2022-01-01", freq=HOUR, inclusive="left", tz="UTC")
    utc = solar_position(times, HOUR, 52.5, 13.4).to_numpy()
    assert np.array_equal(solar_position(times.tz_convert(zone), HOUR, 52.5, 13.4).to_numpy(), utc)
    one, other = (
        choose_suns("typical-days:4", axis, HOUR, 52.5, 13.4)
        for axis in (times, times.tz_convert(zone))
    )
    assert np.array_equal(one.direction, other.direction)


@pytest.mark.slow
@pytest.mark.parametrize(("year", "hours"), [(2021, 8760), (2016, 8784), (1900, 8760)])
def test_leap_years_and_years_with_leap_seconds(year, hours):
    """2016 ended with a leap second; 1900 is divisible by four and no leap year."""
    weather = clear_year(52.5, 13.4, 40.0, year)
    assert len(weather.data) == hours
    assert np.isfinite(weather.data.to_numpy()).all()
    energy = energy_of(weather, 52.5, 13.4, "typical-days:2")
    assert energy.years == pytest.approx(1, abs=0.003)
    assert 900 < energy.full_load_hours[ROOF].mean() < 2500


@pytest.mark.parametrize("zenith", [80.0, 87.9, 88.0, 88.1, 89.999, 90.0, 90.001, 120.0])
def test_direct_normal_irradiance_towards_the_horizon(zenith):
    """DNI = (GHI - DHI)/cos θ ends 2° above the horizon; what comes then counts as diffuse."""
    given = {"ghi": np.array([30.0]), "dhi": np.array([20.0])}
    found = complete_irradiance(given, np.array([zenith]))
    dni, dhi = (10 / np.cos(np.radians(zenith)), 20) if zenith <= 88 else (0, 30)
    assert found["dni"] == pytest.approx(dni)
    assert found["dhi"] == dhi
