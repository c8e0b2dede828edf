"""The horizon of a raster of heights, against all its posts in Earth-centred coordinates."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyproj
import pytest
from cities import box, make_city
from earth_horizon import Edges
from weathers import HOUR

from citypv.core.city.build_scene import build_scene
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.light.prepare_scene import prepare_scene
from citypv.core.light.trace_gather import trace_gather
from citypv.core.read.read_heights import HeightGrid, read_heights
from citypv.core.results.transfer_file import read_transfer, write_transfer
from citypv.core.run.study import read_year
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request
from citypv.core.sky.horizon import STEPS, height_at, horizon_of_terrain
from citypv.core.sky.read_horizon import read_horizon
from citypv.core.sun.sun_sampling import hourly_suns

DEM = Path(__file__).parents[1] / "data" / "terrain" / "dem_jacksboro_tn_wgs84.tif"
VALLEY, SLOPE = (36.3, -84.2), (36.25, -84.12)  # places in the raster
REQUEST = Request(
    horizon=str(DEM), samples=64, shadow_samples=4, max_bounces=1, weather="clear-sky", threads=1
)


@pytest.mark.slow
@pytest.mark.parametrize("place", [VALLEY, SLOPE])
def test_horizon_is_that_of_all_posts(place):
    """Every edge between posts in Earth-centred coordinates, from 1 km on."""
    horizon = horizon_of_terrain(
        read_heights(DEM, place, 50e3), place, np.full(STEPS, 1000.0), 50e3
    )
    edges, azimuth = Edges(DEM, *place, 1000.0), np.arange(0, 360, 4.0)
    difference = horizon.elevation_at(azimuth) - [edges.elevation(one) for one in azimuth]
    assert horizon.elevation.max() > 2
    assert np.sqrt((difference**2).mean()) < 0.03 and np.abs(difference).max() < 0.15


def test_curvature_and_refraction_count():
    """A plateau of 1,000 m from 40 km on: its angle by hand, with and without refraction."""
    near, found = plateau(1000.0, 40_000.0), []
    for refraction in (0.13, 0.0):
        horizon = horizon_of_terrain(near, (0.0, 0.0), np.full(STEPS, 100.0), 50e3, refraction)
        drop = (1 - refraction) * 40_000.0**2 / (2 * 6_371_000.0)
        expected = np.degrees(np.arctan((1000.0 - drop) / 40_000.0))
        assert horizon.elevation[STEPS // 4] == pytest.approx(expected, abs=0.005)
        assert horizon.elevation[STEPS // 2] == 0
        found.append(expected)
    assert min(np.degrees(np.arctan(1000 / 40_000)) - found[0], found[0] - found[1]) > 0.02


def test_a_site_in_the_outermost_cell_has_its_height():
    """Posts stand in the middle of cells of 0.01°: half a cell around them is covered, and
    no more.
    """
    matrix = np.array([[0.01, 0, 10.0], [0, -0.01, 50.0]])
    grid = HeightGrid(np.array([[3.0, 5.0], [3.0, 5.0]]), matrix, "EPSG:4326", 700.0, "small.tif")
    found = [
        height_at([grid], (49.995, longitude)) for longitude in (9.996, 10.005, 10.014, 10.016)
    ]
    assert found == pytest.approx([3.0, 4.0, 5.0, np.nan], nan_ok=True)


def test_heights_between_posts_are_linear_in_the_cell_around_the_place():
    """Posts 0.01° apart, in three rows and three columns of which only the last rises: the
    cell before it is flat, and the last goes on half a cell beyond its posts.
    """
    matrix = np.array([[0.01, 0, 10.0], [0, -0.01, 50.0]])
    step = np.array([0.0, 0.0, 8.0])
    for heights, place in (
        (step[:, None] + np.zeros(3), lambda along: (50 - 0.01 * along, 10.01)),
        (step + np.zeros((3, 1)), lambda along: (49.99, 10 + 0.01 * along)),
    ):
        grid = HeightGrid(heights, matrix, "EPSG:4326", 700.0, "small.tif")
        found = [height_at([grid], place(along)) for along in (0.0, 0.5, 1.0, 1.25, 2.0, 2.4)]
        assert found == pytest.approx([0, 0, 0, 2, 8, 8], abs=1e-6)


def plateau(height, distance):
    """A raster of zeros that is high from some distance on, east of the place 0° N 0° E."""
    east, _, _ = pyproj.Geod(ellps="WGS84").fwd(0.0, 0.0, 90.0, distance)
    step = east / 400
    heights = np.zeros((21, 441))
    heights[:, 420:] = height  # the place is at column 20
    matrix = np.array([[step, 0, -20 * step], [0, -step, 10 * step]])
    return [HeightGrid(heights, matrix, "EPSG:4326", distance / 400, "peak.tif")]


@pytest.fixture(scope="module")
def town():
    """Four houses in the raster's valley, with generated ground."""
    turn = pyproj.Transformer.from_crs("EPSG:4326", "EPSG:32616", always_xy=True)
    x, y = turn.transform(VALLEY[1], VALLEY[0])
    houses = [
        box(f"b{k}{n}", x + 30 * k, y + 30 * n, 15, 12, 300, 308)
        for k in range(2)
        for n in range(2)
    ]
    return build_scene(make_city([polygon for house in houses for polygon in house], "EPSG:32616"))


def year_of(town):
    """A clear year, and the sun of some of its hours."""
    weather = read_year(town.site, REQUEST)
    return weather, hourly_suns(
        weather.data.index[::200], HOUR, weather.latitude, weather.longitude
    )


@pytest.mark.slow
def test_a_town_loses_the_suns_and_sky_that_all_posts_hide(town, tmp_path):
    weather, suns = year_of(town)
    traced = trace_gather(town, suns, REQUEST, silent)
    write_transfer(tmp_path / "transfer.nc", traced)
    kept = read_transfer(tmp_path / "transfer.nc")
    assert (kept.terrain.elevation == traced.terrain.elevation).all()
    energy = compute_energy(kept, weather, threads=1)

    # The same without a horizon, in a weather whose DNI is 0 while all posts hide the sun.
    edges = Edges(DEM, *middle(town), 25.0)
    elevation = 90 - weather.data["apparent_zenith"].to_numpy()
    low = np.flatnonzero((elevation > 0) & (elevation < 12))
    hidden = [
        row
        for row in low
        if edges.elevation(weather.data["solar_azimuth"].iloc[row] % 360) > elevation[row]
    ]
    assert len(hidden) > 200
    dimmed = weather.data.copy()
    dimmed.iloc[hidden, dimmed.columns.get_loc("dni")] = 0.0
    reference = compute_energy(
        replace(kept, terrain=None), replace(weather, data=dimmed), threads=1
    )
    open_sky = compute_energy(replace(kept, terrain=None), weather, threads=1)
    lit = energy.poa_global_annual > 100
    assert lit.sum() > 10
    assert energy.poa_global_annual[lit] == pytest.approx(
        reference.poa_global_annual[lit], rel=1e-3
    )
    lost = 1 - reference.poa_global_annual[lit] / open_sky.poa_global_annual[lit]
    assert lost.max() > 0.005  # the test sees what it compares

    # Flat roofs stand free: their sky is the mean of cos² of the horizon.
    heights = np.radians([edges.elevation(azimuth) for azimuth in np.arange(0, 360, 3.0)])
    flat = traced.surfaces.kind == "flat"
    assert traced.sky_view_factor[flat] == pytest.approx((np.cos(heights) ** 2).mean(), abs=3e-4)


def middle(scene):
    """Latitude and longitude of the middle of the buildings."""
    own = scene.vertices[scene.triangles[scene.triangle_surface >= 0].ravel(), :2]
    x, y = (own.min(axis=0) + own.max(axis=0)) / 2
    here, turn = (scene.site.longitude, scene.site.latitude), np.degrees(np.arctan2(x, y))
    return pyproj.Geod(ellps="WGS84").fwd(*here, turn, np.hypot(x, y))[1::-1]


@pytest.mark.slow
def test_what_is_switched_off_stays_below_its_bound(town):
    """Full load hours with and without the horizon, and with that of each corner of the scene."""
    (weather, suns), request = year_of(town), replace(REQUEST, sky="perez")
    off = replace(request, effects={"terrain-horizon": False})
    hours, bounds = {}, {}
    for name, one in (("on", request), ("off", off)):
        prepared = prepare_scene(town, one, weather=weather, suns=suns)
        traced = trace_gather(town, suns, one, silent, prepared=prepared)
        effect = next(
            effect for effect in traced.record.effects if effect["key"] == "terrain-horizon"
        )
        assert effect["on"] == (name == "on") and "in the" in effect["reason"]
        energy = compute_energy(traced, weather, threads=1, sky="perez")
        hours[name], bounds[name] = energy.full_load_hours, effect["bound"]
        if name == "on":
            _, corners = read_horizon(DEM, town)
            others = [
                compute_energy(replace(traced, terrain=one), weather, threads=1, sky="perez")
                for one in corners
            ]
    eligible = traced.surfaces.eligible
    lost = np.abs(1 - hours["on"][eligible] / hours["off"][eligible])
    assert 0.002 < lost.max() <= bounds["off"] < 3 * lost.max()
    apart = max(
        np.abs(other.full_load_hours[eligible] / hours["on"][eligible] - 1).max()
        for other in others
    )
    assert apart <= bounds["on"] < 0.01
