"""Which suns are traced, and how well they stand for the year."""

import numpy as np
import pandas as pd
import pvlib
import pytest
from thorough import mark_cases
from weathers import HOUR, year_of

from citypv.core.settings.errors import InputError
from citypv.core.sun.sky_grid import sky_grid_suns
from citypv.core.sun.solar_position import (
    is_sunny,
    solar_days,
    solar_position,
    sun_direction,
    whole_solar_days,
)
from citypv.core.sun.sun_sampling import choose_suns, match_suns

PLACES = [
    (0.0, 0.0),
    (30.0, 0.0),
    (52.5, 13.4),
    (-33.4, -70.8),
    (12.0, 7.4),
    (66.56, 25.0),
    (90.0, 0.0),
    (-90.0, 0.0),
]
DATE_LINE = [(-17.0, 179.9), (-17.0, -179.9)]


def sunny_directions(times, interval, latitude, longitude):
    """Directions of the suns above 2°, straight from pvlib."""
    sun = pvlib.solarposition.get_solarposition(times + interval / 2, latitude, longitude)
    zenith, azimuth = (
        np.radians(sun["apparent_zenith"].to_numpy()),
        np.radians(sun["azimuth"].to_numpy()),
    )
    direction = [np.sin(zenith) * np.sin(azimuth), np.sin(zenith) * np.cos(azimuth), np.cos(zenith)]
    return np.stack(direction, 1), sun["apparent_elevation"].to_numpy() >= 2.0


def mismatch(suns, times, latitude, longitude, interval=HOUR):
    """Angle between each sunny interval's own sun and what stands for it [°]."""
    match = match_suns(suns, times, interval, latitude, longitude)
    direction, sunny = sunny_directions(times, interval, latitude, longitude)
    assert match.index.dtype == np.int32 and match.weight.dtype == np.float64
    np.testing.assert_allclose(match.weight.sum(axis=1), sunny, atol=1e-6)
    assert (match.index[~sunny] == 0).all()
    rebuilt = (suns.direction[match.index] * match.weight[:, :, None]).sum(axis=1)[sunny]
    rebuilt /= np.linalg.norm(rebuilt, axis=1, keepdims=True)
    return np.degrees(np.arccos(np.clip((rebuilt * direction[sunny]).sum(axis=1), -1, 1)))


def test_axes_of_the_world():
    directions = sun_direction([90.0, 90.0, 90.0, 90.0, 0.0], [0.0, 90.0, 180.0, 270.0, 123.0])
    expected = [[0, 1, 0], [1, 0, 0], [0, -1, 0], [-1, 0, 0], [0, 0, 1]]
    np.testing.assert_allclose(directions, expected, atol=1e-15)


def test_the_sun_of_the_spa_report():
    """NREL/TP-560-34302, table A5.1: Golden, 17 October 2003, 12:30:30 at UTC-7."""
    time = pd.DatetimeIndex(["2003-10-17T12:30:30-07:00"])
    sun = solar_position(time, pd.Timedelta(0), 39.742476, -105.1786).iloc[0]
    assert sun["solar_azimuth"] == pytest.approx(194.34024, abs=2e-4)
    # The report's 50.11162° hold 0.016332° of refraction at its 820 mbar and 11 °C; ours are those
    # at sea level.
    assert sun["solar_zenith"] - 0.016332 == pytest.approx(50.11162, abs=2e-4)
    assert sun["apparent_zenith"] == pytest.approx(50.11162, abs=0.005)


def test_times_without_a_zone_are_refused():
    with pytest.raises(TypeError, match="time zone"):
        solar_position(pd.date_range("2021-01-01", periods=3, freq="h"), HOUR, 0, 0)


def test_days_of_local_solar_time():
    times = pd.DatetimeIndex(
        ["2021-06-01T00:00Z", "2021-06-01T11:00Z", "2021-06-01T12:00Z", "2021-06-01T23:00Z"]
    )
    for longitude, days, steps in (
        (0, [0, 0, 0, 0], [0, 11, 12, 23]),
        (180, [0, 0, 1, 1], [12, 23, 0, 11]),
    ):
        day, step = solar_days(times, HOUR, longitude)
        assert (day - day[0]).tolist() == days and step.tolist() == steps
    _, step = solar_days(times, HOUR, -90)
    assert step.tolist() == [18, 5, 6, 17]


@pytest.mark.parametrize("longitude", [0.0, 13.4, -70.8, 179.9, -179.9])
def test_whole_days_cover_the_year_once(longitude):
    for times in (year_of(2021), year_of(2020), year_of(2021).append(year_of(2023))):
        axis = whole_solar_days(times, HOUR, longitude)
        assert len(axis) == len(times)
        day, step = solar_days(axis, HOUR, longitude)
        assert (step.reshape(-1, 24) == np.arange(24)).all()
        assert (day.reshape(-1, 24) == day.reshape(-1, 24)[:, :1]).all()
        # In phase with the axis it was made from.
        assert len(axis.difference(times)) <= 2 * 24


@pytest.mark.slow
@pytest.mark.parametrize(("latitude", "longitude"), mark_cases(PLACES + DATE_LINE, kept=3))
def test_hourly_is_the_sun_itself(latitude, longitude):
    times = year_of()
    suns = choose_suns("hourly", times, HOUR, latitude, longitude)
    direction, sunny = sunny_directions(times, HOUR, latitude, longitude)
    np.testing.assert_allclose(suns.direction, direction[sunny], atol=1e-12)
    assert suns.weight.sum() == pytest.approx(1)
    match = match_suns(suns, times, HOUR, latitude, longitude)
    assert match.index[sunny, 0].tolist() == list(range(len(suns)))
    # Another year is at most a quarter of a day off in the calendar and some minutes in the
    # equation of time.
    assert mismatch(suns, year_of(2020), latitude, longitude).max() < 0.5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("latitude", "longitude"), mark_cases([*PLACES[::2], DATE_LINE[0]], kept=2)
)
def test_typical_days_stay_near(latitude, longitude):
    times = year_of()
    suns = choose_suns("typical-days:12", times, HOUR, latitude, longitude)
    np.testing.assert_allclose(np.linalg.norm(suns.direction, axis=1), 1, atol=1e-12)
    assert suns.direction[:, 2].min() >= np.sin(np.radians(2.0))
    assert suns.weight.sum() == pytest.approx(1) and suns.weight.min() > 0
    assert len(np.unique(suns.day * 24 + suns.step)) == len(suns)
    angles = mismatch(suns, times, latitude, longitude)
    # Twelve days over 47° of declination: each stands for some 2° to either side, and for the
    # equation of time.
    assert angles.mean() < 3.2 and angles.max() < 6


@pytest.mark.slow
def test_more_typical_days_stand_nearer():
    times = year_of()
    chosen = [choose_suns(f"typical-days:{count}", times, HOUR, 30, 0) for count in (1, 4, 12, 52)]
    angles = [mismatch(suns, times, 30, 0).mean() for suns in chosen]
    assert angles[0] > 2 * angles[1] > 4 * angles[2] > 6 * angles[3]


@pytest.mark.slow
def test_weights_are_the_shares_of_the_year():
    times = year_of()
    for way in ("days:24", "typical-days:12", "sky-grid:400", "hourly"):
        suns = choose_suns(way, times, HOUR, 52.5, 0.0)
        match = match_suns(suns, times, HOUR, 52.5, 0.0)
        share = np.bincount(match.index.ravel(), weights=match.weight.ravel(), minlength=len(suns))
        share = np.maximum(share, 0)  # of a sun that only bends an interpolation it may be negative
        np.testing.assert_allclose(suns.weight, share / share.sum(), atol=1e-9)


def test_sky_grid_shares_the_sky_equally():
    suns = sky_grid_suns(2000)
    np.testing.assert_allclose(np.linalg.norm(suns.direction, axis=1), 1, atol=1e-12)
    # Mean height and mean cosine-weighted height over a hemisphere: 1/2 and 1/3; no side is
    # preferred.
    assert suns.direction[:, 2].mean() == pytest.approx(0.5, abs=1e-3)
    assert (suns.direction[:, 2] ** 2).mean() == pytest.approx(1 / 3, abs=1e-3)
    assert np.abs(suns.direction[:, :2].mean(axis=0)).max() < 1e-3
    cosine = suns.direction @ suns.direction.T
    np.fill_diagonal(cosine, -1)
    nearest = np.degrees(np.arccos(cosine.max(axis=1)))
    spacing = np.degrees(np.sqrt(2 * np.pi / 2000))
    assert nearest.min() > 0.6 * spacing and nearest.max() < 1.2 * spacing


@pytest.mark.parametrize(
    ("latitude", "longitude"),
    mark_cases([(0.0, 0.0), (52.5, 13.4), (-33.4, -70.8), (90.0, 0.0)], kept=2, law=(1,)),
)
def test_sky_grid_interpolates_any_latitude(latitude, longitude):
    suns = sky_grid_suns(1654)
    match = match_suns(suns, year_of(), HOUR, latitude, longitude)
    assert match.index.shape[1] == 3 and match.weight.min() >= 0
    direction, sunny = sunny_directions(year_of(), HOUR, latitude, longitude)
    # The three corners are the neighbours, and a linear function of the direction is met closely.
    corners = suns.direction[match.index[sunny]]
    near = np.einsum("tki,ti->tk", corners, direction[sunny])
    assert np.degrees(np.arccos(np.clip(near[match.weight[sunny] > 0.01], -1, 1))).max() < 7
    high = direction[sunny][:, 2] > 0.15
    rebuilt = (corners * match.weight[sunny][:, :, None]).sum(axis=1)
    assert np.abs(rebuilt - direction[sunny])[high].max() < 2e-3


def test_where_the_sun_never_rises_nothing_is_matched():
    night = pd.date_range("2021-12-01", periods=240, freq="h", tz="UTC")
    suns = choose_suns("typical-days:2", night, HOUR, 85.0, 0.0)
    assert len(suns) == 0
    match = match_suns(suns, night, HOUR, 85.0, 0.0)
    assert match.weight.sum() == 0
    assert len(choose_suns("hourly", night, HOUR, 85.0, 0.0)) == 0
    assert choose_suns("sky-grid:50", night, HOUR, 85.0, 0.0).weight.sum() == pytest.approx(1)


def test_suns_too_low_to_be_traced_are_matched_by_the_nearest():
    """Of all typical days: the lowest sun of their own may stand far above them."""
    times, place = year_of(), (52.5, 13.4)
    suns = choose_suns("typical-days:12", times, HOUR, *place)
    match, sun = (
        match_suns(suns, times, HOUR, *place, lowest=0.0),
        solar_position(times, HOUR, *place),
    )
    low = ((sun["apparent_zenith"] > 88) & (sun["apparent_zenith"] <= 90)).to_numpy()
    assert low.sum() > 100
    cosine = (
        sun_direction(sun["apparent_zenith"][low], sun["solar_azimuth"][low]) @ suns.direction.T
    )
    assert (match.index[low, 0] == cosine.argmax(axis=1)).all()


def test_two_degrees_are_the_limit():
    assert is_sunny([88.0, 88.001, 0.0, 95.0]).tolist() == [True, False, True, False]


NONSENSE = [
    "daily",
    "days",
    "days:0",
    "days:x",
    "typical-days:",
    "typical-days:-3",
    "typical-days:1.5",
    "hourly:2",
    "",
]


@pytest.mark.parametrize(
    "sampling", [*NONSENSE, "days:400", "typical-days:400", "sky-grid:3", "sky-grid:²"]
)
def test_settings_that_mean_nothing_or_cannot_be(sampling):
    with pytest.raises(InputError, match="--suns"):
        choose_suns(sampling, year_of(), HOUR, 52.5, 13.4)
