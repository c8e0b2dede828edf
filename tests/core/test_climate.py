"""The built-in climate against the grids it is made from, measured years, closed forms and the
limits of physics.
"""

import hashlib
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pvlib
import pytest
from thorough import mark_cases
from weathers import BARROW, HOUR, PVGIS, TMY3

from citypv.core.run.study import read_year
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request
from citypv.core.weather.climate import (
    cleanest_sky,
    climate,
    look_up_altitude,
    make_climates,
    monthly_sums,
)
from citypv.core.weather.climate_grid import is_land, look_up_normals, measure_land_influence
from citypv.core.weather.draw_clearness import (
    draw_days,
    draw_normals,
    exponential_quantile,
    rank_days,
    scale_to_sums,
    solve_exponential,
)
from citypv.core.weather.read_weather import read_weather

# Cells of the 0.25° grid as its source gives them: temperature [°C], rms of wind speed [ms⁻¹].
CELLS = {
    (52.625, 13.375): (9.852, 3.766),  # Berlin
    (-33.375, -70.625): (16.141, 2.611),  # Santiago
    (71.125, -156.625): (-8.383, 5.797),  # Utqiagvik
    (66.875, 179.625): (-7.969, 3.695),  # Chukotka, east of Greenwich
    (66.875, -179.625): (-7.945, 3.85),  # Chukotka, west of Greenwich
}
# The cells of the Atlas around a place, as its file gives them [kWh/m² per day]; without any, SSE's
# cell.
ATLAS = {
    (52.625, 13.375): (2.944, 2.933, 2.91, 2.905),
    (-33.375, -70.625): (5.385, 5.29, 5.571, 5.312),
    (21.31, -157.86): (5.47, 5.397, 5.61, 5.307),  # Honolulu
    (13.48, 144.8): (5.638, 5.627, 5.789),  # Guam
    (-20.89, 55.52): (5.015, 4.824, 5.228, 5.447),  # Réunion
    (37.74, -25.67): (4.235, 3.865, 3.713),  # the Azores
    (0.5, -29.5): (6.17, 5.86, 6.21),  # the Atlantic: SSE
}
# Months at 33° S, 60° W as MERRA-2's grid of 3° gives them [Wm⁻²], and SSE's of 1° [kWh/m² per
# day].
MONTHS = np.array(
    [
        [323.6, 274.6, 245.0, 185.9, 133.9, 117.5, 124.2, 157.4, 205.8, 258.5, 299.4, 329.4],
        [6.96, 6.02, 5.07, 3.75, 2.92, 2.38, 2.69, 3.58, 4.74, 5.51, 6.61, 6.94],
    ]
)
DAYS = np.array([31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31])


def monthly(data, column="ghi"):
    """Sums of the months in UTC."""
    return np.bincount(data.index.month, data[column])[1:]


@pytest.fixture(scope="module")
def cells():
    """A year of each cell, and its Weather."""
    return {place: read_weather("climate", *place) for place in CELLS}


# --- the grids


@pytest.mark.parametrize("place", mark_cases(CELLS, kept=2, single=True))
def test_air_is_that_of_the_grid(place, cells):
    temp_air, wind_speed = CELLS[place]
    data = cells[place].data
    assert data["temp_air"].mean() == pytest.approx(
        temp_air, abs=0.051
    )  # half the step that is kept
    assert data["wind_speed"].mean() == pytest.approx(np.sqrt(np.pi / 4) * wind_speed, abs=0.051)


@pytest.mark.parametrize("place", ATLAS)
def test_the_year_lies_between_the_cells_around(place):
    ghi = climate(*place).data["ghi"].sum() / 365_000
    assert min(ATLAS[place]) - 0.006 <= ghi <= max(ATLAS[place]) + 0.006


def test_months_share_the_year_as_in_their_sources():
    data = climate(-33.0, -60.0).data
    found, known = monthly(data) / data["ghi"].sum(), MONTHS * DAYS / (MONTHS @ DAYS)[:, None]
    room = 0.08 * known.mean(axis=0) + 0.001  # both are means of several cells here
    assert (found >= known.min(axis=0) - room).all() and (found <= known.max(axis=0) + room).all()
    assert np.abs(found - known.mean(axis=0)).max() < 0.006


@pytest.mark.slow
def test_months_are_met_to_the_rounding():
    places = list(CELLS)
    made = [record.data for record in make_climates(*zip(*places, strict=True))]
    normals = [look_up_normals(*place) for place in places]
    annual = np.array([[found.ghi] for found in normals]) * 365_000
    sky = cleanest_sky(
        places, made[0].index, np.array([[look_up_altitude(*place)] for place in places]), annual
    )
    target = monthly_sums(annual, normals, sky, made[0].index)
    np.testing.assert_allclose(target.sum(axis=1, keepdims=True), annual, rtol=1e-9)
    for data, sums in zip(made, target, strict=True):
        np.testing.assert_allclose(monthly(data), sums, rtol=1e-5, atol=0.05)


def test_a_leap_year_has_a_day_more():
    normals = look_up_normals(52.5, 13.4)
    data = climate(52.5, 13.4, 2020).data
    assert len(data) == 8784
    assert data["ghi"].sum() / 1000 == pytest.approx(366 * normals.ghi, rel=1e-6)
    with pytest.raises(InputError, match="1850"):
        climate(52.5, 13.4, 1850)


@pytest.mark.slow
@pytest.mark.parametrize("place", [(56.0, 3.0), (-50.0, 180.0)])
def test_the_sea_has_a_climate(place):
    weather, clear = read_weather("climate", *place), read_weather("clear-sky", *place)
    assert "climatology" in weather.label and "upper bound" not in weather.label
    assert 0.3 < weather.data["ghi"].sum() / clear.data["ghi"].sum() < 0.95
    assert not is_land(*place)


@pytest.mark.parametrize("place", [(-90.0, 0.0), (-75.0, 60.0)])
def test_antarctica_is_refused_and_no_clear_sky(place):
    with pytest.raises(InputError, match=r"ends at 60° S.*clear-sky as an upper bound"):
        read_weather("climate", *place)
    with pytest.raises(InputError, match="ends at 60° S"):
        make_climates([52.5, place[0]], [13.4, place[1]])


def test_every_longitude_means_the_same_place():
    for place in ((52.5, 13.4), (66.9, 179.9), (-17.8, 178.0)):
        one, other = look_up_normals(*place), look_up_normals(place[0], place[1] - 360)
        assert (one.ghi, one.temp_air) == pytest.approx((other.ghi, other.temp_air), rel=1e-12)
        np.testing.assert_allclose(one.clearness, other.clearness, rtol=1e-9)


def test_air_from_the_land_is_told_from_air_from_the_sea():
    land = np.zeros((576, 1440), bool)
    land[:, :720] = True  # the western half of the map
    assert measure_land_influence(land, 45.0, 0.125) > 0.9  # a west wind comes over land
    assert measure_land_influence(land, 0.0, 0.125) < 0.1  # a trade wind over sea
    yakutsk, dublin = look_up_normals(62.0, 129.7), look_up_normals(53.3, -6.4)
    assert yakutsk.land_influence > 3 * dublin.land_influence


# --- what is drawn


@pytest.mark.slow
def test_the_seed_orders_the_days_and_leaves_the_sums():
    same, first, second = (
        climate(52.5, 13.4).data,
        climate(52.5, 13.4, seed=0).data,
        climate(52.5, 13.4, seed=1).data,
    )
    pd.testing.assert_frame_equal(same, first)
    np.testing.assert_allclose(monthly(first), monthly(second), rtol=1e-5)
    assert (
        np.corrcoef(first["ghi"].resample("D").sum(), second["ghi"].resample("D").sum())[0, 1] < 0.9
    )
    assert first["dni"].sum() == pytest.approx(second["dni"].sum(), rel=0.03)
    place = SimpleNamespace(latitude=52.5, longitude=13.4, altitude=34.0)
    np.testing.assert_array_equal(
        read_year(place, Request(weather_seed=1)).data["ghi"], second["ghi"]
    )


@pytest.mark.slow
def test_many_places_at_once_are_those_one_by_one():
    places = list(CELLS)[:4]
    made = make_climates(*zip(*places, strict=True), seed=3)
    for record, place in zip(made, places, strict=True):
        pd.testing.assert_frame_equal(record.data, climate(*place, seed=3).data, check_exact=True)


@pytest.mark.slow
def test_the_same_bits_everywhere():
    """Irradiance is rounded so far above a processor's own rounding that its bytes are the same on
    all of them.
    """
    made = make_climates([52.5, -33.4, 71.1], [13.4, -70.7, -156.6])
    light = b"".join(
        one.data[name].to_numpy("<f8").tobytes() for name in ("ghi", "dni") for one in made
    )
    assert hashlib.sha256(light).hexdigest()[:16] == "bf97043e800d7e51"


# --- physics


@pytest.mark.parametrize("place", CELLS)
def test_limits_of_physics(place, cells):
    data = cells[place].data
    cosine = np.maximum(np.cos(np.radians(data["apparent_zenith"])), 0)
    extra = pvlib.irradiance.get_extra_radiation(data.index + HOUR / 2).to_numpy()
    np.testing.assert_allclose(data["ghi"], data["dhi"] + data["dni"] * cosine, atol=2e-6)
    assert (data[["ghi", "dhi", "dni", "wind_speed"]].to_numpy() >= 0).all()
    assert (data["ghi"] <= extra * cosine + 1e-3).all()
    assert (
        data["ghi"] <= 1.5 * extra * cosine**1.2 + 100
    ).all()  # BSRN's physically possible limit
    assert (data["dni"] < 0.85 * extra).all()
    assert (data["ghi"][data["apparent_zenith"] > 91] == 0).all()
    assert (data["ghi"][data["apparent_zenith"] < 85] > 0).all()
    assert data["pressure"].between(60e3, 103e3).all()
    assert data.notna().all().all()


def test_afternoons_are_the_warmest_and_sunny_ones_above_all():
    data = climate(52.5, 13.4).data
    local = data.shift(freq="53min")  # mean solar time
    assert local["temp_air"].groupby(local.index.hour).mean().idxmax() in (14, 15, 16)
    summer = data["2021-06-01":"2021-08-31"]
    days = summer.resample("D").agg({"ghi": "sum", "temp_air": "max"})
    assert np.corrcoef(days["ghi"], days["temp_air"])[0, 1] > 0.5
    assert np.average(data["temp_air"], weights=data["ghi"]) > data["temp_air"].mean() + 3.5


# --- stations


@pytest.mark.slow
@pytest.mark.parametrize(
    ("path", "ghi", "dni", "temp_air"),
    # The annual GHI of the grid is off by as much as the first (benchmarks/results/climate.md); the
    # arctic is worst.
    [(TMY3, 10, 20, 2), (PVGIS, 10, 20, 4), (BARROW, 30, 140, 5)],
)
def test_errors_at_stations(path, ghi, dni, temp_air):
    station = read_weather(path, 0, 0)
    data = read_weather("climate", station.latitude, station.longitude).data
    assert abs(data["ghi"].sum() / station.data["ghi"].sum() - 1) < ghi / 100
    assert abs(data["dni"].sum() / station.data["dni"].sum() - 1) < dni / 100
    weighted = [np.average(one["temp_air"], weights=one["ghi"]) for one in (data, station.data)]
    assert abs(weighted[0] - weighted[1]) < temp_air


# -- the distributions that the built-in climate draws its days from, against their closed forms --


def test_the_exponential_distribution_has_its_mean():
    # Mean of exp(γx) on 0 to 1: 1/(1 - exp(-γ)) - 1/γ; 0.58198 for γ = 1.
    assert solve_exponential(np.array([0.581976706869, 0.5, 0.418023293131])) == pytest.approx(
        [1, 0, -1], abs=1e-7
    )
    quantile = (np.arange(10000) + 0.5) / 10000
    for mean in (0.1, 0.3, 0.5, 0.7, 0.9):
        assert exponential_quantile(
            solve_exponential(np.array(mean)), quantile
        ).mean() == pytest.approx(mean, abs=1e-4)


def test_days_spread_as_bendt_has_it():
    """The share of days below a clearness index against Bendt's formula with γ of Herzog's fit."""
    month = np.repeat(np.arange(12), 400)
    quantile = rank_days(draw_normals(0, (4800,)), month)
    mean, least, largest = np.full((1, 12), 0.5), 0.05, 0.7
    days = draw_days(mean, np.full((1, 4800), largest), quantile, month)[0]
    assert days.mean() == pytest.approx(0.5, abs=0.002)
    xi = (largest - least) / (largest - 0.5)
    gamma = -1.498 + (1.184 * xi - 27.182 * np.exp(-1.5 * xi)) / (largest - least)
    for index in (0.2, 0.3, 0.4, 0.5, 0.6):
        below = (np.exp(gamma * least) - np.exp(gamma * index)) / (
            np.exp(gamma * least) - np.exp(gamma * largest)
        )
        assert (days < index).mean() == pytest.approx(below, abs=0.02)


def test_days_follow_each_other_as_graham_has_it():
    quantile = rank_days(draw_normals(1, (36500,)), np.zeros(36500, int))
    assert np.corrcoef(quantile[1:], quantile[:-1])[0, 1] == pytest.approx(
        0.28, abs=0.02
    )  # 0.29 of normal numbers
    np.testing.assert_allclose(np.sort(quantile), (np.arange(36500) + 0.5) / 36500)


def test_sums_are_met_below_the_ceiling():
    rng = np.random.default_rng(0)
    clearness, outside = rng.uniform(0, 0.8, (3, 48)), np.ones((3, 48))
    scaled = scale_to_sums(
        clearness, np.full((3, 48), 0.75), outside, np.array([[5.0, 17.9]] * 3), np.array([0, 24])
    )
    np.testing.assert_allclose(
        np.add.reduceat(scaled, [0, 24], axis=1), [[5.0, 17.9]] * 3, rtol=1e-9
    )
    assert scaled.max() <= 0.75
