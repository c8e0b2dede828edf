"""Rasters of heights as they are found: across 180°, in other units, with gaps, and as terrain of
the model and its horizon at once, where what the model holds does not count twice.
"""

from dataclasses import replace

import numpy as np
import pyproj
import pytest
import rasterio
from cities import box, make_city
from rasterio.transform import Affine
from thorough import mark_cases

from citypv.core.city.build_scene import SceneOptions, build_scene
from citypv.core.light.trace_gather import trace_gather
from citypv.core.read.read_heights import read_heights
from citypv.core.read.read_terrain import read_terrain
from citypv.core.run.study import read_year
from citypv.core.settings.errors import InputError
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request
from citypv.core.sky.horizon import STEPS, horizon_of_terrain
from citypv.core.sky.read_horizon import distance_to_end, read_horizon
from citypv.core.sun.sun_sampling import hourly_suns

LATITUDE, STEP = -17.0, 0.004
HILLS = (
    (0.1, 0.2, 900, 0.03),
    (-0.15, 0.05, 600, 0.02),
    (0.02, -0.25, 1200, 0.04),
    (-0.02, -0.06, 300, 0.01),
)


def hills(north, east):
    """Height of four hills at degrees from the site."""
    parts = (
        high * np.exp(-((north - n) ** 2 + (east - e) ** 2) / width**2)
        for n, e, high, width in HILLS
    )
    return 5.0 + sum(parts)


def write_raster(path, heights, system, place, unit=""):
    """GeoTIFF of heights, (rows, columns), in a reference system, at the place that an affine
    transform gives.
    """
    rows, columns = heights.shape
    settings = {
        "driver": "GTiff",
        "count": 1,
        "dtype": "float64",
        "crs": system,
        "transform": place,
    }
    with rasterio.open(path, "w", width=columns, height=rows, **settings) as dataset:
        dataset.write(heights, 1)
        if unit:
            dataset.units = (unit,)
    return path


def write_hills(path, site, west, east, *, factor=1.0, unit="", gap=None):
    """GeoTIFF in degrees with the hills around a longitude; `gap(north, east)` has other heights or
    NaN.
    """
    columns, rows = round((east - west) / STEP), round(1.2 / STEP)
    across = (west + (np.arange(columns) + 0.5) * STEP - site + 180) % 360 - 180
    up = 0.6 - (np.arange(rows) + 0.5) * STEP
    heights = hills(up[:, None], across) * factor
    if gap is not None:
        odd = gap(up[:, None], across)
        heights = np.where(odd != 0, odd, heights)
    return write_raster(
        path, heights, "EPSG:4326", Affine(STEP, 0.0, west, 0.0, -STEP, LATITUDE + 0.6), unit
    )


def look(path, longitude):
    place = (LATITUDE, longitude)
    return horizon_of_terrain(read_heights(path, place, 50e3), place, np.full(STEPS, 30.0), 50e3)


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    found = look(
        write_hills(tmp_path_factory.mktemp("hills") / "a.tif", 10, 9.4, 10.6), 10.0
    ).elevation
    assert found.max() > 2
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("west", "east", "sites"),
    mark_cases(
        [
            (179.4, 180.6, (180, -180)),
            (-180.6, -179.4, (180, -180)),
            (0, 360, (0, 350, -10)),
            (-180, 180, (180, -180)),
        ],
        kept=1,
    ),
)
def test_the_horizon_is_the_same_at_any_longitude_however_it_is_written(
    tmp_path, plain, west, east, sites
):
    for site in sites:
        found = look(write_hills(tmp_path / "a.tif", site, west, east), site)
        assert found.elevation == pytest.approx(plain, abs=1e-6)
        assert found.known.min() > 49_000


@pytest.mark.parametrize(
    ("unit", "factor"),
    [("ft", 0.3048), ("US survey foot", 1200 / 3937), ("Foot_US", 1200 / 3937), ("cm", 0.01)],
)
def test_heights_have_the_unit_that_the_raster_names(tmp_path, plain, unit, factor):
    path = write_hills(tmp_path / "a.tif", 10, 9.4, 10.6, factor=1 / factor, unit=unit)
    assert look(path, 10.0).elevation == pytest.approx(plain, abs=1e-6)


def test_heights_that_no_land_has_are_gaps(tmp_path, plain):
    """-9999 without a word on it, at the site and in single posts beside it."""
    path = write_hills(
        tmp_path / "a.tif", 10, 9.4, 10.6, gap=lambda n, e: -9999.0 * (np.hypot(n, e) < 0.01)
    )
    with pytest.raises(InputError, match="has no height at the site"):
        look(path, 10.0)
    path = write_hills(
        tmp_path / "b.tif", 10, 9.4, 10.6, gap=lambda n, e: -9999.0 * (np.hypot(n + 0.1, e) < 0.004)
    )
    assert look(path, 10.0).elevation == pytest.approx(plain, abs=0.02)


def town(system, longitude, size):
    """Two houses at the ends of a square around the site."""
    x, y = pyproj.Transformer.from_crs("EPSG:4326", system, always_xy=True).transform(
        longitude, LATITUDE
    )
    low, high = -size / 2, size / 2 - 10
    houses = [
        box("a", x + low, y + low, 10, 10, 5, 15),
        box("b", x + high, y + high, 10, 10, 5, 15),
    ]
    return make_city([polygon for house in houses for polygon in house], system)


@pytest.mark.slow
def test_a_town_by_the_sea_has_the_horizon_of_all_its_corners(tmp_path):
    """Corners that lie in water, a gap of the raster, see from as high as the middle."""
    sea = write_hills(
        tmp_path / "sea.tif",
        10,
        9.4,
        10.6,
        gap=lambda n, e: np.where((e < -0.005) & (n < 0), np.nan, 0),
    )
    land = write_hills(tmp_path / "land.tif", 10, 9.4, 10.6)
    scene = build_scene(town("EPSG:32732", 10.0, 1500.0))
    middle, corners = read_horizon(sea, scene)
    _, dry = read_horizon(land, scene)
    assert len(corners) == 4
    # Land in front of the south-western corner, at 5 m, is flat.
    north = slice(0, STEPS // 4)
    assert corners[0].elevation[north] == pytest.approx(dry[0].elevation[north], abs=0.05)
    assert corners[0].eye == middle.eye


def test_terrain_of_a_town_on_the_date_line_reaches_to_both_sides(tmp_path):
    path = write_hills(tmp_path / "a.tif", 180, 179.4, 180.6)
    for longitude in (179.9995, -179.9995):
        city = town("EPSG:32760", longitude, 50.0)
        points = np.concatenate([layer.points for layer in read_terrain(path, city).layers])
        reach = np.abs(points[:, :2] - city.points[:, :2].mean(axis=0)).max(axis=0)
        low, high = (
            points[:, 0].min() - city.points[:, 0].mean(),
            points[:, 0].max() - city.points[:, 0].mean(),
        )
        assert low == pytest.approx(-5000, abs=1000) and high == pytest.approx(5000, abs=1000)
        assert reach[1] < 6000


# on the central meridian, where the grid points north
SYSTEM, X, Y = (
    "EPSG:32632",
    500_000.0,
    5_500_000.0,
)
POST, HALF = 50.0, 12_000.0  # [m]
NEAR, FAR = 725.0, 8_025.0  # [m] to a ridge in the north, and to one in the south
HIGH, WIDE = {NEAR: 80.0, FAR: 700.0}, {NEAR: 150.0, FAR: 400.0}  # [m]


@pytest.fixture(scope="module")
def raster(tmp_path_factory):
    """GeoTIFF with two ridges that run east, a plain between them."""
    count = round(2 * HALF / POST)
    north = HALF - (np.arange(count) + 0.5) * POST
    ridges = sum(
        HIGH[d] * np.exp(-(((north - at) / WIDE[d]) ** 2)) for d, at in ((NEAR, NEAR), (FAR, -FAR))
    )
    place = Affine(POST, 0.0, X - HALF, 0.0, -POST, Y + HALF)
    path = tmp_path_factory.mktemp("ridges") / "ridges.tif"
    return write_raster(path, np.repeat(ridges[:, None], count, axis=1), SYSTEM, place)


@pytest.fixture(scope="module")
def city():
    return make_city(box("tower", X - 10, Y - 10, 20, 20, 0, 40), SYSTEM)


@pytest.mark.thorough
def test_terrain_of_the_model_does_not_count_in_the_horizon(raster, city):
    alone, _ = read_horizon(raster, build_scene(city))
    both, corners = read_horizon(
        raster, build_scene(city, options=SceneOptions(terrain=read_terrain(raster, city)))
    )
    north, south = 0, STEPS // 2
    assert alone.elevation[north] == pytest.approx(
        np.degrees(np.arctan(HIGH[NEAR] / NEAR)), abs=0.3
    )
    assert [one.elevation[north] for one in (both, *corners)] == pytest.approx([0] * 5, abs=0.01)
    assert both.elevation[south] == pytest.approx(np.degrees(np.arctan(HIGH[FAR] / FAR)), abs=0.05)
    # Other places on the lines of sight.
    assert both.elevation[south] == pytest.approx(alone.elevation[south], abs=0.02)


@pytest.mark.slow
def test_walls_lose_what_they_lose_behind_the_terrain_alone(raster, city):
    """From 40 m up a ridge at 725 m is 3.2° lower than from the ground, from which the horizon is
    seen.
    """
    scene = build_scene(city, options=SceneOptions(terrain=read_terrain(raster, city)))
    weather = read_year(scene.site, Request(weather="clear-sky"))
    suns = hourly_suns(
        weather.data.index[::400], weather.interval, weather.latitude, weather.longitude
    )
    request = Request(samples=1024, shadow_samples=16, max_bounces=0, threads=1)
    alone = trace_gather(scene, suns, request, silent)
    found = trace_gather(scene, suns, replace(request, horizon=str(raster)), silent)
    wall = alone.surfaces.kind == "facade"
    facing = alone.surfaces.orientation[wall]
    lost = 1 - found.sky_view_factor[wall] / alone.sky_view_factor[wall]
    assert lost[facing == "north"] == pytest.approx(
        0, abs=5e-4
    )  # the ridge goes on beyond the model
    assert lost[facing == "south"] == pytest.approx(lost_sky_of_a_wall(), rel=0.02)


def lost_sky_of_a_wall():
    """Share of the sky that the far ridge takes from a wall that faces it, up to where the raster
    ends.

    Where the ridge stands h high at the azimuth a of the wall, it takes cos a (h + sin h cos h) / 2
    of the integral of the sky over elevations, in all of the wall's half space π / 2.
    """
    end = np.arctan(HALF / FAR)
    azimuth = np.linspace(-end, end, 2001)
    distance = FAR / np.cos(azimuth)
    drop = (1 - 0.13) * distance**2 / (2 * 6_371_000.0)  # curvature of the Earth, less refraction
    angle = np.arctan((HIGH[FAR] - drop) / distance)
    taken = np.cos(azimuth) * (angle + np.sin(angle) * np.cos(angle)) / 2
    return taken.mean() * 2 * end / (np.pi / 2)


def test_where_the_ground_of_a_model_ends():
    """A square with a hole around the site, of triangles in any order, against the lines of its
    sides.
    """
    axis = np.linspace(-300.0, 500.0, 9)
    corners = np.array([[x, y] for x in axis for y in axis])
    cells = np.array(
        [[9 * i + j, 9 * i + j + 9, 9 * i + j + 10] for i in range(8) for j in range(8)]
    )
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
    assert not distance_to_end(np.zeros(2), ground[:0]).any()
