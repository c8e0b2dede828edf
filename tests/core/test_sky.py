"""The Perez sky: against pvlib on open planes, the horizon against closed forms, gather against forward."""

import gzip
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pvlib
import pytest
from scenes import assert_mean, join, scene_of_triangles, strip, suns_towards
from thorough import THOROUGH
from weathers import BARROW, DATA

from citypv.core.effects.perez import surfaces_that_count
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.light.trace_gather import trace_gather
from citypv.core.photons.trace_forward import trace_forward
from citypv.core.progress import silent
from citypv.core.request import Request
from citypv.core.sky.horizon_band import HEIGHT, horizon_directions, weight_of_band
from citypv.core.sun.choose_suns import choose_suns
from citypv.core.weather.read_weather import read_weather

NEW_YORK = DATA / "USA_NY_New.York-CentralPark_TMY3.epw.gz"
STATIONS = {
    "New York": (NEW_YORK, 40.78, -73.97),
    "Santiago": (DATA / "CHL_Santiago_TMYx.epw.gz", -33.39, -70.79),
    "Barrow": (BARROW, 71.32, -156.62),
}
TILTS = (0.0, 10.0, 20.0, 30.0, 45.0, 60.0, 75.0, 90.0, 105.0, 120.0, 150.0)
AZIMUTHS = (0.0, 90.0, 135.0, 180.0, 270.0)
PLANES = [(tilt, azimuth) for tilt in TILTS for azimuth in (AZIMUTHS if tilt else (0.0,))]
ALBEDO = 0.25


def read_with_pvlib(path, *, low_suns):
    """Irradiances and sun of an EPW file by pvlib alone: DataFrame.

    Unless `low_suns`, light of a sun below 2° counts as diffuse, as where DNI is computed and not measured.
    """
    with gzip.open(path, "rt", encoding="latin-1") as file:
        data, station = pvlib.iotools.read_epw(file)
    middle = data.index + pd.Timedelta(minutes=30)
    sun = pvlib.solarposition.get_solarposition(middle, station["latitude"], station["longitude"])
    data["zenith"], data["azimuth"] = sun["apparent_zenith"].to_numpy(), sun["azimuth"].to_numpy()
    data["extra"] = pvlib.irradiance.get_extra_radiation(middle).to_numpy()
    if not low_suns:
        low = data["zenith"] > 88
        data.loc[low, "dni"], data.loc[low, "dhi"] = 0.0, data.loc[low, "ghi"]
    return data


def columns_of(weather):
    """The same columns as the program has them."""
    names = {"apparent_zenith": "zenith", "solar_azimuth": "azimuth"}
    data = weather.data.rename(columns=names)[["ghi", "dni", "dhi", "zenith", "azimuth"]]
    return data.assign(extra=pvlib.irradiance.get_extra_radiation(data.index + weather.interval / 2).to_numpy())


def pvlib_alone(data, tilt, azimuth, model):
    """Hourly irradiance of an open plane [Wm⁻²]; the Perez sky is isotropic with the sun below the horizon."""
    horizontal = data["dhi"] + data["dni"] * np.cos(np.radians(data["zenith"])).clip(lower=0)
    given = (tilt, azimuth, data["zenith"], data["azimuth"], data["dni"], horizontal, data["dhi"])
    isotropic = pvlib.irradiance.get_total_irradiance(*given, albedo=ALBEDO, model="isotropic")["poa_global"]
    if model == "isotropic":
        return isotropic
    airmass = pvlib.atmosphere.get_relative_airmass(data["zenith"])
    more = {"airmass": airmass, "dni_extra": data["extra"], "albedo": ALBEDO, "model": "perez"}
    found = pvlib.irradiance.get_total_irradiance(*given, **more)["poa_global"]
    return found.where(airmass.notna() & (data["dhi"] > 0), isotropic)


def open_plane(tilt, azimuth):
    """A triangle with nothing around it."""
    slope, turn = np.radians(tilt), np.radians(azimuth)
    across = np.array([-np.cos(turn), np.sin(turn), 0.0])
    upward = np.array([-np.cos(slope) * np.sin(turn), -np.cos(slope) * np.cos(turn), np.sin(slope)])
    return scene_of_triangles(np.array([across * -1, across, upward]) * 2 + [0, 0, 5], [[0, 1, 2]])


@pytest.mark.slow
@pytest.mark.once
@pytest.mark.parametrize("station", STATIONS)
def test_a_year_on_open_planes(station):
    """Annual sums of the program's own chain under both skies: pvlib's to rounding in the same weather; in pvlib's own
    reading of the file, with the sun of another year, within 0.2 %. Each station has every other plane, the second one
    those that the others leave out."""
    path, latitude, longitude = STATIONS[station]
    weather = read_weather(path, latitude, longitude)
    suns = choose_suns("hourly", *weather.axis)
    own = columns_of(weather)
    alone = read_with_pvlib(path, low_suns=bool((own["dni"][own["zenith"] > 88] > 0).any()))
    half = PLANES[list(STATIONS).index(station) % 2 :: 2]
    for tilt, azimuth in PLANES if THOROUGH else half:
        transfer = trace_gather(open_plane(tilt, azimuth), suns, Request(ground_albedo=ALBEDO, sky="perez"), silent)
        for sky in ("perez", "isotropic"):
            found = compute_energy(transfer, weather, sky=sky).poa_global_annual[0]
            same, other = (pvlib_alone(data, tilt, azimuth, sky).sum() / 1000 for data in (own, alone))
            assert found == pytest.approx(same, rel=1e-6), (tilt, azimuth, sky)
            assert found == pytest.approx(other, rel=2e-3), (tilt, azimuth, sky)


# -- the horizon as a source of light --


def trace(scene, **settings):
    """Transfer under one sun, with the horizon traced whatever counts."""
    return trace_gather(scene, suns_towards([[0.3, 0.2, 1.0]]), Request(sky="perez", **settings), silent)


def mean_of(transfer, rows, name="view_factor"):
    """Area-weighted mean of some surfaces' horizon, and its standard error."""
    share = transfer.surfaces.area[rows] / transfer.surfaces.area[rows].sum()
    error = np.sqrt(((share * transfer.sources["horizon"].standard_error[rows]) ** 2).sum())
    return share @ getattr(transfer.sources["horizon"], name)[rows], error


@pytest.mark.parametrize("tilt", [5, 30, 60, 90, 100, 135, 170])
def test_the_horizon_of_an_open_plane_by_rays(tilt):
    """sin(tilt) whatever the azimuth: every ray towards the band stands in front of the plane and meets nothing."""
    for azimuth in (0, 77, 200):
        transfer = trace(open_plane(tilt, azimuth), effects={"sky-rays": True, "shadow-rays": True}, far_ground=False)
        assert transfer.sources["horizon"].view_factor[0] == pytest.approx(np.sin(np.radians(tilt)), rel=1e-5)
        assert transfer.record.source_rays == {"horizon": 64}
        known = trace(open_plane(tilt, azimuth), far_ground=False)
        assert known.sources["horizon"].relative[0] == pytest.approx(np.sin(np.radians(tilt)), rel=1e-6)
        assert known.record.source_rays == {"horizon": 0}


def street(strips=8):
    """A long street as wide as its walls are high; rows of a middle wall and of the ground between."""
    parts = []
    for start, end in ((-100, -10), (-10, 10), (10, 100)):
        length = [end - start, 0, 0]
        parts.append(strip([start, 0, 0], length, [0, 1, 0], strips))
        parts.append(strip([start, 1, 0], length, [0, 0, 1], strips))
        parts.append(strip([start, 0, 1], length, [0, 0, -1], strips))
    return join(parts), np.arange(8 * strips, 10 * strips), np.arange(6 * strips, 8 * strips)


def test_the_horizon_over_a_wall_opposite():
    """Wall of height 1 at distance 1, integrated: the band begins where the other wall's top hides it no more."""
    scene, wall, ground = street()
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
    """Square court, side 1, walls 0.2 high: from each point of a wall, the rims of the other three, integrated."""
    high = 0.2
    corners, walls = [[0, 0], [1, 0], [1, 1], [0, 1]], []
    for here, there in zip(corners, [*corners[1:], corners[0]], strict=True):
        along = np.array([*np.subtract(there, here), 0.0])
        walls.append(strip([*there, 0], -along, [0, 0, high], 4))
    transfer = trace(join(walls), samples=4096, max_bounces=0, far_ground=False)
    place, height, sine = np.meshgrid(*((np.arange(size) + 0.5) / size for size in (160, 160, 160)), indexing="ij")
    cosine = np.sqrt(1 - sine**2)
    # To the right at azimuth φ the ray leaves through the far wall or the side wall, whichever is nearer.
    distance = np.minimum(1 / cosine, (1 - place) / sine)
    hidden = np.arctan(high * (1 - height) / distance)
    expected = np.clip(1 - hidden / HEIGHT, 0, 1).mean()
    found, error = mean_of(transfer, np.arange(len(transfer.surfaces)))
    assert error < 0.003
    assert_mean(found, error, expected)


@pytest.mark.slow
@pytest.mark.once
def test_the_horizon_with_reflections_is_that_of_photons():
    scene, wall, ground = street(4)
    settings = {"sky": "perez", "max_bounces": 3, "far_ground": False}
    gather = trace(scene, samples=4096, max_bounces=3, far_ground=False)
    forward = trace_forward(scene, suns_towards([[0.3, 0.2, 1.0]]), Request(samples=6000, **settings), silent)
    for rows in (wall, ground):
        for name in ("view_factor", "relative"):
            one, other = mean_of(gather, rows, name), mean_of(forward, rows, name)
            assert other[1] < 0.002
            assert abs(one[0] - other[0]) < 4 * np.hypot(one[1], other[1])
    tally = forward.record.photons["horizon"]
    assert sum(tally.values()) == 2 * tally["emitted"] > 0


@pytest.mark.parametrize("tilt", [20, 60, 90, 100, 120])
def test_photons_of_the_horizon_on_an_open_plane(tilt):
    forward = trace_forward(
        open_plane(tilt, 200), suns_towards([[0, 0, 1.0]]), Request(sky="perez", samples=200_000), silent
    )
    error = forward.sources["horizon"].standard_error
    assert error[0] < 0.02
    assert_mean(forward.sources["horizon"].relative, error, np.sin(np.radians(tilt)))


def test_the_band_is_weighed_like_a_line_at_the_horizon():
    """Uniform azimuths and elevations times n · d: ½ ∫ of it over the band is sin(tilt)."""
    rng = np.random.default_rng(1)
    azimuth, elevation = rng.uniform(0, 2 * np.pi, 400_000), rng.uniform(0, HEIGHT, 400_000)
    directions = np.stack([np.cos(elevation) * np.sin(azimuth), np.cos(elevation) * np.cos(azimuth), np.sin(elevation)])
    for tilt in (10, 50, 90, 110):
        up = np.radians(tilt)
        normal = np.array([[np.sin(up), 0.0, np.cos(up)]])
        met = np.maximum(normal @ directions, 0)[0]
        front = met > 0
        weight = weight_of_band(np.repeat(normal, front.sum(), axis=0), directions[:, front].T)
        light = np.zeros(len(met))
        light[front] = np.pi * weight * met[front] / np.cos(elevation[front])
        assert light.mean() == pytest.approx(np.sin(up), rel=0.01)
        towards = horizon_directions(normal.astype(np.float32), *rng.random((2, 1, 1000), np.float32))
        assert (towards @ normal[0] > -1e-6).all() and (towards[..., 2] >= 0).all()


def test_stated_errors_of_the_horizon_hold():
    """Twelve seeds: the spread of a wall's horizon is what is stated, within a factor that chance allows."""
    scene, wall, _ = street(4)
    found = np.array([mean_of(trace(scene, seed=seed, max_bounces=1, far_ground=False), wall) for seed in range(12)])
    spread, stated = found[:, 0].std(ddof=1), np.sqrt((found[:, 1] ** 2).mean())
    assert 0.5 < spread / stated < 1.7


@pytest.mark.parametrize(
    ("eligible", "counted"),
    [([False] * 4, [True, False, False, False]), ([False, True, True, False], [False, False, True, False])],
    ids=["none eligible", "some eligible"],
)
def test_surfaces_for_which_the_sky_is_chosen(eligible, counted):
    """Facades that may carry no modules count where nothing else does; flat ones and ground never ask for Perez."""
    kind, tilt = np.array(["facade", "flat", "roof", "ground"]), np.array([90.0, 0.0, 30.0, 5.0])
    kind[2] = "roof" if any(eligible) else "flat"
    tilt[2] = 30.0 if any(eligible) else 1.0
    surfaces = SimpleNamespace(eligible=eligible, kind=kind, surface_tilt=tilt)
    assert surfaces_that_count(surfaces).tolist() == counted
