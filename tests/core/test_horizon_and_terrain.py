"""The same raster as terrain of the model and as its horizon: what the model holds does not count twice."""

from dataclasses import replace

import numpy as np
import pytest
import rasterio
from cities import box, make_city
from rasterio.transform import Affine

from citypv.core.city.build_scene import SceneOptions, build_scene
from citypv.core.light.trace_gather import trace_gather
from citypv.core.read.read_terrain import read_terrain
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request
from citypv.core.study import read_year
from citypv.core.sun.horizon import STEPS
from citypv.core.sun.read_horizon import distance_to_end, read_horizon
from citypv.core.sun.sun_sampling import hourly_suns

SYSTEM, X, Y = "EPSG:32632", 500_000.0, 5_500_000.0  # on the central meridian, where the grid points north
POST, HALF = 50.0, 12_000.0  # [m]
NEAR, FAR = 725.0, 8_025.0  # [m] to a ridge in the north, and to one in the south
HIGH, WIDE = {NEAR: 80.0, FAR: 700.0}, {NEAR: 150.0, FAR: 400.0}  # [m]


@pytest.fixture(scope="module")
def raster(tmp_path_factory):
    """GeoTIFF with two ridges that run east, a plain between them."""
    count = round(2 * HALF / POST)
    north = HALF - (np.arange(count) + 0.5) * POST
    ridges = sum(HIGH[d] * np.exp(-(((north - at) / WIDE[d]) ** 2)) for d, at in ((NEAR, NEAR), (FAR, -FAR)))
    path = tmp_path_factory.mktemp("ridges") / "ridges.tif"
    place = Affine(POST, 0.0, X - HALF, 0.0, -POST, Y + HALF)
    settings = {"driver": "GTiff", "count": 1, "dtype": "float64", "crs": SYSTEM, "transform": place}
    with rasterio.open(path, "w", width=count, height=count, **settings) as dataset:
        dataset.write(np.repeat(ridges[:, None], count, axis=1), 1)
    return path


@pytest.fixture(scope="module")
def city():
    return make_city(box("tower", X - 10, Y - 10, 20, 20, 0, 40), SYSTEM)


def test_terrain_of_the_model_does_not_count_in_the_horizon(raster, city):
    alone, _ = read_horizon(raster, build_scene(city))
    both, corners = read_horizon(raster, build_scene(city, options=SceneOptions(terrain=read_terrain(raster, city))))
    north, south = 0, STEPS // 2
    assert alone.elevation[north] == pytest.approx(np.degrees(np.arctan(HIGH[NEAR] / NEAR)), abs=0.3)
    assert [one.elevation[north] for one in (both, *corners)] == pytest.approx([0] * 5, abs=0.01)
    assert both.elevation[south] == pytest.approx(np.degrees(np.arctan(HIGH[FAR] / FAR)), abs=0.05)
    assert both.elevation[south] == pytest.approx(
        alone.elevation[south], abs=0.02
    )  # other places on the lines of sight


def test_walls_lose_what_they_lose_behind_the_terrain_alone(raster, city):
    """From 40 m up a ridge at 725 m is 3.2° lower than from the ground, from which the horizon is seen."""
    scene = build_scene(city, options=SceneOptions(terrain=read_terrain(raster, city)))
    weather = read_year(scene.site, Request(weather="clear-sky"))
    suns = hourly_suns(weather.data.index[::400], weather.interval, weather.latitude, weather.longitude)
    request = Request(samples=1024, shadow_samples=16, max_bounces=0, threads=1)
    alone = trace_gather(scene, suns, request, silent)
    found = trace_gather(scene, suns, replace(request, horizon=str(raster)), silent)
    wall = alone.surfaces.kind == "facade"
    facing = alone.surfaces.orientation[wall]
    lost = 1 - found.sky_view_factor[wall] / alone.sky_view_factor[wall]
    assert lost[facing == "north"] == pytest.approx(0, abs=5e-4)  # the ridge goes on beyond the model
    assert lost[facing == "south"] == pytest.approx(lost_sky_of_a_wall(), rel=0.02)


def lost_sky_of_a_wall():
    """Share of the sky that the far ridge takes from a wall that faces it, up to where the raster ends.

    Where the ridge stands h high at the azimuth a of the wall, it takes cos a (h + sin h cos h) / 2 of the integral of
    the sky over elevations, in all of the wall's half space π / 2.
    """
    end = np.arctan(HALF / FAR)
    azimuth = np.linspace(-end, end, 2001)
    distance = FAR / np.cos(azimuth)
    drop = (1 - 0.13) * distance**2 / (2 * 6_371_000.0)  # curvature of the Earth, less refraction
    angle = np.arctan((HIGH[FAR] - drop) / distance)
    taken = np.cos(azimuth) * (angle + np.sin(angle) * np.cos(angle)) / 2
    return taken.mean() * 2 * end / (np.pi / 2)


def test_where_the_ground_of_a_model_ends():
    """A square with a hole around the site, of triangles in any order, against the lines of its sides."""
    axis = np.linspace(-300.0, 500.0, 9)
    corners = np.array([[x, y] for x in axis for y in axis])
    cells = np.array([[9 * i + j, 9 * i + j + 9, 9 * i + j + 10] for i in range(8) for j in range(8)])
    cells = np.concatenate([cells, cells[:, [0, 2, 2]] + [0, 0, -9]])
    middle = corners[cells].mean(axis=1)
    ground = corners[cells[np.hypot(*middle.T) > 150]]
    turn = np.radians(np.arange(STEPS) * 360.0 / STEPS)
    for x, y in ((3.0, 7.0), (-120.0, 40.0)):
        with np.errstate(divide="ignore"):
            sides = [(500.0 - x) / np.sin(turn), (-300.0 - x) / np.sin(turn)]
            sides += [(500.0 - y) / np.cos(turn), (-300.0 - y) / np.cos(turn)]
        expected = np.min([np.where(side > 0, side, np.inf) for side in sides], axis=0)
        assert distance_to_end(np.array([x, y]), ground) == pytest.approx(expected, rel=1e-9)
    # A strip along the diagonal, 20 m wide: across it the ground ends after 10 m, along it after 400.
    along, across = 400.0 * np.array([1, 1]) / np.sqrt(2), 10.0 * np.array([1, -1]) / np.sqrt(2)
    a, b, c, d = -along - across, -along + across, along + across, along - across
    end = distance_to_end(np.zeros(2), np.array([[a, b, c], [a, c, d]]))
    assert end[[STEPS // 8, 3 * STEPS // 8]] == pytest.approx([400, 10])
    assert not distance_to_end(np.zeros(2), ground[:0]).any()
