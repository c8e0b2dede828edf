"""The world: values of single places against `yield`, pvlib and closed forms; the sun everywhere on
Earth.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pvlib
import pytest
from thorough import mark_cases

from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.pv_system import dc_system
from citypv.core.light.transfer import SourceLight
from citypv.core.results.write_tables import sum_periods
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request
from citypv.core.sky.horizon import STEPS, TerrainHorizon
from citypv.core.sun.sky_grid import SkyTriangles, sky_grid_suns
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.weather.grid_sources import (
    CLEAR,
    CLIMATE,
    NOTHING,
    Places,
    model_source,
    station_source,
)
from citypv.core.weather.read_weather import read_weather
from citypv.core.world.compute_world import compute_world
from citypv.core.world.environment import build_environment, unshaded_transfer
from citypv.core.world.group_errors import parse_mix
from citypv.core.world.merge_surfaces import merge_surfaces

from .planes import run_chain
from .transfers import Horizons
from .weathers import BARROW, HOUR, PVGIS, year_of

# 55° S to 71° N, both sides of the date line, all on land.
LAND = [
    (-54.8, -68.3),
    (-33.4, -70.6),
    (-15.0, -47.0),
    (0.2, 32.5),
    (13.5, 2.1),
    (24.0, 90.0),
    (36.2, -115.2),
]
LAND += [(52.5, 13.4), (66.5, 179.0), (71.3, -156.8)]
CLOSE = 1e-4  # of full load hours: the tables' error
SYSTEM = dc_system()


@pytest.fixture(scope="module")
def skylines():
    transfer, rng = Horizons(60, seed=3).transfer(sky_grid_suns(400)), np.random.default_rng(4)
    view = np.hypot(*transfer.surfaces.normal[:, :2].T) * rng.random(60)
    return replace(
        transfer, sources={"horizon": SourceLight(view, view + 0.1 * rng.random(60), np.zeros(60))}
    )


def world_of(transfer, places, name="clear-sky", **settings):
    request = Request(horizon_cut=settings.pop("horizon_cut", "measured"))
    source = model_source(places, name, request, settings.pop("off_land", "blank"))
    environment = build_environment(
        "town", "test", transfer, SYSTEM, settings.get("sky", "isotropic")
    )
    return compute_world([environment], source, SYSTEM, threads=1, **settings)


@pytest.mark.parametrize("count", [16, 673])
def test_each_direction_lies_in_its_triangle(count):
    """Also between the lowest ring and the horizon, where four points of grid and mirror image lie
    in one plane.
    """
    suns, rng = sky_grid_suns(count), np.random.default_rng(1)
    direction = rng.normal(size=(4000, 3))
    direction[:, 2] = np.abs(direction[:, 2]) * rng.choice([1.0, 0.02], 4000)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    triangles = SkyTriangles.of(suns)
    index, weight = triangles.match(direction)
    np.testing.assert_allclose(weight.sum(axis=1), 1.0)
    # The weighted corners, mirrored ones below the horizon, point into the direction.
    level = (suns.direction[index][:, :, :2] * weight[:, :, None]).sum(axis=1)
    turn = np.arctan2(*level.T) - np.arctan2(*direction.T[:2])
    assert np.abs((turn + np.pi) % (2 * np.pi) - np.pi).max() < 1e-6
    nearest = np.einsum("tki,ti->tk", suns.direction[index], direction)
    assert np.degrees(np.arccos(nearest.min())) <= triangles.reach


@pytest.mark.slow
@pytest.mark.parametrize(
    ("place", "sky"),
    mark_cases(
        [
            ((52.5, 13.4), "isotropic"),
            ((-33.4, -70.6), "perez"),
            ((9.0, 179.9), "isotropic"),
            ((71.3, -156.8), "perez"),
        ],
        kept=2,
    ),
)
def test_a_place_is_what_yield_gives(skylines, place, sky):
    world = world_of(skylines, Places(*np.array([place]).T), sky=sky)
    weather = read_weather("clear-sky", *place, float(pvlib.location.lookup_altitude(*place)))
    energy = compute_energy(skylines, weather, SYSTEM, threads=1, sky=sky)
    assert world.groups == energy.groups
    expected = np.array(list(sum_periods(energy).values()))
    found = world.full_load_hours[0, 0].T
    np.testing.assert_allclose(found, expected, rtol=CLOSE, atol=1e-3)


@pytest.mark.slow
def test_stations_are_what_yield_gives(skylines):
    """Measured weather of the Arctic, with direct light below 2°, and a typical year."""
    weathers = [read_weather(path, 0.0, 0.0) for path in (BARROW, PVGIS)]
    source = station_source(weathers, ["barrow", "pvgis"])
    environment = build_environment("town", "test", skylines, SYSTEM)
    world = compute_world([environment], source, SYSTEM, threads=2)
    for row, weather in enumerate(weathers):
        energy = compute_energy(skylines, weather, SYSTEM, threads=1)
        expected = energy.capacity_factor.sum(axis=0) / energy.years
        np.testing.assert_allclose(world.full_load_hours[row, 0, :, 0], expected, rtol=CLOSE)


@pytest.mark.slow
def test_unshaded_planes_are_pvlibs():
    """Transposition, cell temperature and module by pvlib itself, at ten places from 55° S to 71°
    N.
    """
    transfer, places = unshaded_transfer(), Places(*np.array(LAND, float).T)
    world = world_of(transfer, places, "climate")
    assert (world.weather == CLIMATE).all()
    surfaces = transfer.surfaces
    for row, place in enumerate(LAND):
        data = read_weather("climate", *place).data
        for group, (tilt, azimuth) in enumerate(
            zip(surfaces.surface_tilt, surfaces.surface_azimuth, strict=True)
        ):
            expected = run_chain(data, tilt, azimuth)[1].sum()
            assert world.full_load_hours[row, 0, group, 0] == pytest.approx(expected, rel=2 * CLOSE)


@pytest.mark.slow
def test_poles_and_date_line():
    """At the pole all facades get the same light within a day's drift; no sun in the
    polar night.
    """
    places = Places(np.array([90.0, 80.0, 20.0, 20.0]), np.array([0.0, 30.0, -180.0, 179.999]))
    world = world_of(unshaded_transfer(), places)
    hours = world.full_load_hours[:, 0]
    walls = hours[0, :4, 0]
    assert np.ptp(walls) / walls.mean() < 0.01
    assert hours[0, :, 1 + 11].max() == 0  # December
    assert hours[0, :, 1 + 5].min() > 50  # June, by day and by night
    by_hour = hours[0, :4, 37:].sum(axis=0)  # of four walls: alike every six hours
    np.testing.assert_allclose(by_hour, np.roll(by_hour, 6), rtol=0.005)
    assert (hours[1, :, 1 + 11] == 0).all()
    # 100 m apart, but in the first and the last cell of the table of turbidities.
    np.testing.assert_allclose(hours[2, :, 0], hours[3, :, 0], rtol=0.01)
    # Solar noon is in the middle of the day at the date line, too.
    assert hours[2, 2, 37:].argmax() in (11, 12)


@pytest.mark.slow
def test_land_and_sea():
    """Off land the climate is blank, or the clear sky, and says which."""
    places = Places(np.array([45.0, 45.0]), np.array([8.0, -30.0]))
    blank = world_of(unshaded_transfer(), places, "climate")
    filled = world_of(unshaded_transfer(), places, "climate", off_land="clear-sky")
    assert blank.weather.tolist() == [CLIMATE, NOTHING]
    assert filled.weather.tolist() == [CLIMATE, CLEAR]
    assert np.isnan(blank.full_load_hours[1]).all()
    np.testing.assert_array_equal(blank.full_load_hours[0], filled.full_load_hours[0])
    assert (filled.full_load_hours[1, :, :, 0] > 300).all()
    assert "clear sky" in filled.label


@pytest.mark.slow
def test_shift_is_exact_at_greenwich_and_close_elsewhere(skylines):
    """At Greenwich nothing is shifted; over half the Earth the sun has moved on by half a day."""
    places = Places(np.full(3, 48.0), np.array([0.0, 97.5, -180.0]))
    exact, paper = (
        world_of(skylines, places, way=way, horizon_cut="neglect").full_load_hours
        for way in ("exact", "paper")
    )
    np.testing.assert_allclose(paper[0], exact[0], rtol=CLOSE, atol=1e-3)
    error = paper[1:, 0, :, 0] / exact[1:, 0, :, 0] - 1
    assert 1e-6 < np.abs(error).max() < 0.02


def test_weights_of_a_mix_that_mean_nothing():
    for text, words in (
        ("town=1.5", "above 0"),
        ("city=1", "no environment"),
        ("town=.5", "add up to 0.5"),
    ):
        with pytest.raises(InputError, match=words):
            parse_mix(text, ["town", "unshaded"])


@pytest.mark.slow
def test_days_with_the_sun_hardly_above_the_horizon_have_numbers():
    """70° N in January: an hour with the sun at 0.0001° and a clearness index of 3.7."""
    places = Places(np.array([70.0]), np.array([-125.0]))
    assert np.isfinite(world_of(unshaded_transfer(), places, "climate").full_load_hours).all()


@pytest.mark.slow
def test_merged_surfaces_keep_what_is_linear(skylines):
    """Half of the surfaces: the same area and light of the sky, and hours within 2 %."""
    environment = build_environment("town", "test", skylines, SYSTEM, "perez")
    assert environment.sources[0].any()
    merged = merge_surfaces(environment, len(environment.weight) // 2)
    assert len(merged.weight) == len(environment.weight) // 2
    assert merged.first[-1] == len(merged.weight)
    for group, (start, stop) in enumerate(pairwise(environment.first)):
        own = slice(*merged.first[group : group + 2])
        assert merged.weight[own].sum() == pytest.approx(environment.weight[start:stop].sum())
        sky = environment.weight[start:stop] @ environment.block.sky[start:stop]
        assert merged.weight[own] @ merged.block.sky[own] == pytest.approx(sky, rel=1e-5)
        direct = [
            one.weight[part]
            @ (np.maximum(one.block.normal.T @ one.sky.direction.T, 0) * one.block.visible_share.T)[
                part
            ]
            for one, part in ((environment, slice(start, stop)), (merged, own))
        ]
        assert np.abs(direct[1] - direct[0]).mean() < 0.02 * direct[0].mean()
    source = model_source(
        Places(np.array([30.0, 60.0]), np.array([31.0, 10.0])), "climate", Request()
    )
    whole, few = (
        compute_world([one], source, SYSTEM, threads=1, sky="perez").full_load_hours
        for one in (environment, merged)
    )
    np.testing.assert_allclose(few[..., 0], whole[..., 0], rtol=0.02)
    assert merge_surfaces(environment, 1000) is environment


@pytest.mark.slow
def test_other_suns_than_a_sky_grid_are_refused_with_what_to_run():
    whole, flat = (Horizons(9).transfer(sky_grid_suns(16)) for _ in range(2))
    flat.surfaces.eligible[:] = False
    days = Horizons(9).transfer(choose_suns("days:2", year_of(), HOUR, 52.5, 13.4))
    part = Horizons(9).transfer(replace(sky_grid_suns(100).first(40), sampling="sky-grid:100"))
    for transfer, words in (
        (days, r"days:2, which holds for one latitude only; .*--suns sky-grid"),
        (part, "40 directions"),
        (replace(whole, terrain=TerrainHorizon(np.full(STEPS, 5.0))), "again without --horizon"),
        (replace(whole, bare=whole, leaf_months=(5, 6)), "--leaf-months all"),
        (flat, "no roof or facade with modules"),
    ):
        with pytest.raises(InputError, match=words):
            build_environment("town", "transfer.nc", transfer, SYSTEM)
    with pytest.raises(InputError, match="--sky isotropic"):
        build_environment("town", "transfer.nc", whole, SYSTEM, "perez")
