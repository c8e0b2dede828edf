"""The Perez sky: against pvlib on open planes, the horizon against closed forms, gather against
forward.
"""

import sys
from dataclasses import replace
from types import ModuleType, SimpleNamespace

import numpy as np
import pvlib
import pytest
from planes import ALBEDO, DC, light_on_plane
from scenes import (
    assert_mean,
    join,
    run_forward,
    run_gather,
    scene_of_triangles,
    strip,
    suns_towards,
)
from test_closed_forms import canyon
from thorough import THOROUGH
from weathers import BARROW, DATA, HOUR, read_pvlib_epw

from citypv.core.effects.beyond_scene import surfaces_that_count
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.pv_system import build_system
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import SKIES, Request
from citypv.core.sky.horizon_band import HEIGHT, HORIZON
from citypv.core.sky.sky_models import SkyParts, choose_sky, split_sky
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.weather.grid_sources import station_source
from citypv.core.weather.read_weather import read_weather
from citypv.core.world.compute_world import compute_world
from citypv.core.world.environment import build_environment, unshaded_transfer

NEW_YORK = DATA / "USA_NY_New.York-CentralPark_TMY3.epw.gz"
STATIONS = {
    "New York": (NEW_YORK, 40.78, -73.97),
    "Santiago": (DATA / "CHL_Santiago_TMYx.epw.gz", -33.39, -70.79),
    "Barrow": (BARROW, 71.32, -156.62),
}
TILTS = (0.0, 10.0, 20.0, 30.0, 45.0, 60.0, 75.0, 90.0, 105.0, 120.0, 150.0)
AZIMUTHS = (0.0, 90.0, 135.0, 180.0, 270.0)
PLANES = [(tilt, azimuth) for tilt in TILTS for azimuth in (AZIMUTHS if tilt else (0.0,))]


def read_with_pvlib(path, *, low_suns):
    """Irradiances and sun of an EPW file by pvlib alone: DataFrame.

    Unless `low_suns`, light of a sun below 2° counts as diffuse, as where DNI is computed and not
    measured.
    """
    data, station = read_pvlib_epw(path)
    sun = pvlib.solarposition.get_solarposition(
        data.index + HOUR / 2, station["latitude"], station["longitude"]
    )
    names = {"apparent_zenith": "apparent_zenith", "azimuth": "solar_azimuth"}
    data = data.join(sun[list(names)].rename(columns=names).set_axis(data.index))
    if not low_suns:
        low = data["apparent_zenith"] > 88
        data.loc[low, "dni"], data.loc[low, "dhi"] = 0.0, data.loc[low, "ghi"]
    return data


def open_plane(tilt, azimuth):
    """A triangle with nothing around it."""
    slope, turn = np.radians(tilt), np.radians(azimuth)
    across = np.array([-np.cos(turn), np.sin(turn), 0.0])
    upward = np.array([-np.cos(slope) * np.sin(turn), -np.cos(slope) * np.cos(turn), np.sin(slope)])
    return scene_of_triangles(np.array([across * -1, across, upward]) * 2 + [0, 0, 5], [[0, 1, 2]])


@pytest.mark.thorough
@pytest.mark.parametrize(
    "station",
    [
        name if name == "Barrow" else pytest.param(name, marks=pytest.mark.thorough)
        for name in STATIONS
    ],
)
def test_a_year_on_open_planes(station):
    """Annual sums of the program's own chain under both skies: pvlib's to rounding in the same
    weather; in pvlib's own reading of the file within 0.2 %. Each station has every other plane,
    the second one those that the others leave out."""
    path, latitude, longitude = STATIONS[station]
    weather = read_weather(path, latitude, longitude)
    suns = choose_suns("hourly", *weather.axis)
    own = weather.data
    alone = read_with_pvlib(
        path, low_suns=bool((own["dni"][own["apparent_zenith"] > 88] > 0).any())
    )
    half = PLANES[list(STATIONS).index(station) % 2 :: 2]
    for tilt, azimuth in PLANES if THOROUGH else half:
        transfer = run_gather(open_plane(tilt, azimuth), suns, ground_albedo=ALBEDO, sky="perez")
        for sky in ("perez", "isotropic"):
            found = compute_energy(transfer, weather, sky=sky).poa_global_annual[0]
            same, other = (
                sum(light_on_plane(data, tilt, azimuth, sky)[:3]).sum() / 1000
                for data in (own, alone)
            )
            assert found == pytest.approx(same, rel=1e-6), (tilt, azimuth, sky)
            assert found == pytest.approx(other, rel=2e-3), (tilt, azimuth, sky)


def split_by_hay_and_davies(weather):
    """Diffuse light in proportion to the clearness of the direct light from around the sun."""
    data = weather.data
    extra = pvlib.irradiance.get_extra_radiation(data.index + HOUR / 2).to_numpy()
    dhi, around = data["dhi"].to_numpy(), (data["dhi"] * data["dni"]).to_numpy() / extra
    height = np.maximum(np.cos(np.radians(data["apparent_zenith"].to_numpy())), 0.01745)
    return SkyParts(dhi - around, around / height, around, {})


@pytest.mark.slow
def test_another_model_of_the_sky_is_a_file_and_a_line(monkeypatch):
    """Hay and Davies' sky, added as such, gives on an open plane what pvlib's gives in a year."""
    file = ModuleType("citypv.core.sky.hay_davies")
    file.SOURCES, file.split = (), split_by_hay_and_davies
    monkeypatch.setitem(sys.modules, file.__name__, file)
    with pytest.raises(InputError, match="'hay_davies' is not known; give auto or perez"):
        Request(sky="hay_davies").check()
    monkeypatch.setitem(SKIES, "hay_davies", "In proportion to the clearness")
    weather, request = read_weather(*STATIONS["New York"]), Request(sky="hay_davies")
    scene, suns = open_plane(50, 225), choose_suns("hourly", *weather.axis)
    transfer = run_gather(scene, suns, ground_albedo=ALBEDO, sky=request.sky)
    (effect,) = (one for one in transfer.record.effects if one["key"] == "perez")
    assert effect["on"] and effect["reason"].startswith("as asked") and not transfer.sources
    assert choose_sky(request, transfer) == "hay_davies"
    data = weather.data
    sun = data["apparent_zenith"], data["solar_azimuth"]
    extra = pvlib.irradiance.get_extra_radiation(data.index + HOUR / 2)
    diffuse = pvlib.irradiance.haydavies(50, 225, data["dhi"], data["dni"], extra.to_numpy(), *sun)
    direct, even, ground, _ = light_on_plane(data, 50, 225)
    whole, other = ((direct + part + ground).sum() / 1000 for part in (diffuse, even))
    found = compute_energy(transfer, weather, sky="hay_davies").poa_global_annual[0]
    assert found == pytest.approx(whole, rel=1e-6) and whole > 1.02 * other


# -- the horizon as a source of light --


def trace(scene, **settings):
    """Transfer under one sun, with the horizon traced whatever counts."""
    return run_gather(scene, suns_towards([[0.3, 0.2, 1.0]]), sky="perez", **settings)


def mean_of(transfer, rows, name="view_factor"):
    """Area-weighted mean of some surfaces' horizon, and its standard error."""
    share = transfer.surfaces.area[rows] / transfer.surfaces.area[rows].sum()
    error = np.sqrt(((share * transfer.sources["horizon"].standard_error[rows]) ** 2).sum())
    return share @ getattr(transfer.sources["horizon"], name)[rows], error


@pytest.mark.slow
@pytest.mark.parametrize("tilt", [5, 60, 90, 135])
def test_the_horizon_of_an_open_plane_by_rays(tilt):
    """sin(tilt) whatever the azimuth: every ray towards the band stands in front of the plane and
    meets nothing.
    """
    normal = np.float32([[np.sin(np.radians(tilt)), 0, np.cos(np.radians(tilt))]])
    towards = HORIZON.sample(normal, *np.random.default_rng(1).random((2, 1, 1000), np.float32))
    assert (towards @ normal[0] > -1e-6).all() and (towards[..., 2] >= 0).all()
    for azimuth in (0, 77, 200):
        transfer = trace(
            open_plane(tilt, azimuth),
            effects={"sky-rays": True, "shadow-rays": True},
            far_ground=False,
        )
        assert transfer.sources["horizon"].view_factor[0] == pytest.approx(
            np.sin(np.radians(tilt)), rel=1e-5
        )
        assert transfer.record.source_rays == {"horizon": 64}
        known = trace(open_plane(tilt, azimuth), far_ground=False)
        assert known.sources["horizon"].relative[0] == pytest.approx(
            np.sin(np.radians(tilt)), rel=1e-6
        )
        assert known.record.source_rays == {"horizon": 0}


@pytest.mark.slow
def test_the_horizon_over_a_wall_opposite():
    """Wall of height 1 at distance 1, integrated: the band begins where the other wall's top hides
    it no more.
    """
    scene, ground, wall = canyon(strips=8)
    height, sine = np.meshgrid((np.arange(4000) + 0.5) / 4000, (np.arange(2000) + 0.5) / 2000)
    hidden = np.arctan((1 - height) * np.sqrt(1 - sine**2))  # the wall is 1/cos φ away at azimuth φ
    expected = np.clip(1 - hidden / HEIGHT, 0, 1).mean()
    assert expected == pytest.approx(0.0871, abs=1e-4)
    transfer = trace(scene, samples=4096, max_bounces=0, far_ground=False, report="all")
    found, error = mean_of(transfer, wall)
    assert error < 0.002
    assert_mean(found, error, expected)
    assert mean_of(transfer, ground) == (0, 0)


def test_the_horizon_over_a_court():
    """Square court, side 1, walls 0.2 high: from each point of a wall, the rims of the other three,
    integrated.
    """
    high = 0.2
    corners, walls = [[0, 0], [1, 0], [1, 1], [0, 1]], []
    for here, there in zip(corners, [*corners[1:], corners[0]], strict=True):
        along = np.array([*np.subtract(there, here), 0.0])
        walls.append(strip([*there, 0], -along, [0, 0, high], 4))
    transfer = trace(join(walls), samples=4096, max_bounces=0, far_ground=False)
    place, height, sine = np.meshgrid(
        *((np.arange(size) + 0.5) / size for size in (160, 160, 160)), indexing="ij"
    )
    cosine = np.sqrt(1 - sine**2)
    # To the right at azimuth φ the ray leaves through the far wall or the side wall, whichever is
    # nearer.
    distance = np.minimum(1 / cosine, (1 - place) / sine)
    hidden = np.arctan(high * (1 - height) / distance)
    expected = np.clip(1 - hidden / HEIGHT, 0, 1).mean()
    found, error = mean_of(transfer, np.arange(len(transfer.surfaces)))
    assert error < 0.003
    assert_mean(found, error, expected)


@pytest.mark.slow
@pytest.mark.parametrize("tilt", [20, 90, 120])
def test_photons_of_the_horizon_on_an_open_plane(tilt):
    forward = run_forward(
        open_plane(tilt, 200), suns_towards([[0, 0, 1.0]]), sky="perez", samples=200_000
    )
    error = forward.sources["horizon"].standard_error
    assert error[0] < 0.02
    assert_mean(forward.sources["horizon"].relative, error, np.sin(np.radians(tilt)))


@pytest.mark.slow
@pytest.mark.law
def test_stated_errors_of_the_horizon_hold():
    """Twelve seeds: the spread of a wall's horizon is what is stated, within a factor that chance
    allows.
    """
    scene, _, wall = canyon(strips=4)
    found = np.array(
        [
            mean_of(trace(scene, seed=seed, max_bounces=1, far_ground=False), wall)
            for seed in range(12)
        ]
    )
    spread, stated = found[:, 0].std(ddof=1), np.sqrt((found[:, 1] ** 2).mean())
    assert 0.5 < spread / stated < 1.7


@pytest.mark.parametrize(
    ("eligible", "counted"),
    [
        ([False] * 4, [True, False, False, False]),
        ([False, True, True, False], [False, False, True, False]),
    ],
    ids=["none eligible", "some eligible"],
)
def test_surfaces_for_which_the_sky_is_chosen(eligible, counted):
    """Facades that may carry no modules count where nothing else does; flat ones and ground never
    ask for Perez.
    """
    kind, tilt = np.array(["facade", "flat", "roof", "ground"]), np.array([90.0, 0.0, 30.0, 5.0])
    kind[2] = "roof" if any(eligible) else "flat"
    tilt[2] = 30.0 if any(eligible) else 1.0
    surfaces = SimpleNamespace(eligible=eligible, kind=kind, surface_tilt=tilt)
    assert surfaces_that_count(surfaces).tolist() == counted


@pytest.mark.slow
def test_irradiation_is_that_of_all_parts_of_the_sky():
    """Unshaded planes: what the horizon adds to the year in closed form; a world map as a yield."""
    transfer, system = unshaded_transfer(), build_system(Request(diffuse_iam=True, **DC))
    weather = read_weather("clear-sky", 52.5, 13.4, 34.0)
    found = compute_energy(transfer, weather, system, threads=1, sky="perez")
    parts, normal, light = (
        split_sky(weather, "perez"),
        transfer.surfaces.normal,
        transfer.sources["horizon"],
    )
    with pytest.raises(InputError, match="without the light of the horizon;"):
        compute_energy(replace(transfer, sources={}), weather, system, sky="perez")
    none = replace(light, view_factor=0 * light.relative, relative=0 * light.relative)
    without = compute_energy(
        replace(transfer, sources={"horizon": none}), weather, system, threads=1, sky="perez"
    )
    gained = (found.poa_global_annual - without.poa_global_annual) * 1000
    np.testing.assert_allclose(
        gained, parts.sources["horizon"].sum() * np.hypot(*normal[:, :2].T), rtol=1e-3
    )
    environment = build_environment("open", "closed form", transfer, system, "perez")
    world = compute_world(
        [environment], station_source([weather], ["here"]), system, threads=1, sky="perez"
    )
    expected = found.capacity_factor.sum(axis=0) / found.years
    np.testing.assert_allclose(world.full_load_hours[0, 0, :, 0], expected, rtol=1e-4)
