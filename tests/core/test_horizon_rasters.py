"""Rasters of heights as they are found: across 180°, in other units, with gaps; the hills are the same."""

import numpy as np
import pyproj
import pytest
import rasterio
from cities import box, make_city
from rasterio.transform import Affine

from citypv.core.city.build_scene import build_scene
from citypv.core.read.read_heights import read_heights
from citypv.core.read.read_terrain import read_terrain
from citypv.core.settings.errors import InputError
from citypv.core.sun.horizon import STEPS, horizon_of_terrain
from citypv.core.sun.read_horizon import read_horizon

LATITUDE, STEP = -17.0, 0.004
HILLS = ((0.1, 0.2, 900, 0.03), (-0.15, 0.05, 600, 0.02), (0.02, -0.25, 1200, 0.04), (-0.02, -0.06, 300, 0.01))


def hills(north, east):
    """Height of four hills at degrees from the site."""
    parts = (high * np.exp(-((north - n) ** 2 + (east - e) ** 2) / width**2) for n, e, high, width in HILLS)
    return 5.0 + sum(parts)


def write_hills(path, site, west, east, *, factor=1.0, unit="", gap=None):
    """GeoTIFF in degrees with the hills around a longitude; `gap(north, east)` has other heights or NaN."""
    columns, rows = round((east - west) / STEP), round(1.2 / STEP)
    across = (west + (np.arange(columns) + 0.5) * STEP - site + 180) % 360 - 180
    up = 0.6 - (np.arange(rows) + 0.5) * STEP
    heights = hills(up[:, None], across) * factor
    if gap is not None:
        odd = gap(up[:, None], across)
        heights = np.where(odd != 0, odd, heights)
    place = Affine(STEP, 0.0, west, 0.0, -STEP, LATITUDE + 0.6)
    settings = {"driver": "GTiff", "count": 1, "dtype": "float64", "crs": "EPSG:4326", "transform": place}
    with rasterio.open(path, "w", width=columns, height=rows, **settings) as dataset:
        dataset.write(heights, 1)
        if unit:
            dataset.units = (unit,)
    return path


WHOLE = pytest.param(-180, 180, (180, -180), marks=pytest.mark.thorough)


def look(path, longitude):
    place = (LATITUDE, longitude)
    return horizon_of_terrain(read_heights(path, place, 50e3), place, np.full(STEPS, 30.0), 50e3)


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    found = look(write_hills(tmp_path_factory.mktemp("hills") / "a.tif", 10, 9.4, 10.6), 10.0).elevation
    assert found.max() > 2
    return found


@pytest.mark.parametrize(
    ("west", "east", "sites"),
    [(179.4, 180.6, (180, -180)), (-180.6, -179.4, (180, -180)), (0, 360, (0, 350, -10)), WHOLE],
)
def test_the_horizon_is_the_same_at_any_longitude_however_it_is_written(tmp_path, plain, west, east, sites):
    for site in sites:
        found = look(write_hills(tmp_path / "a.tif", site, west, east), site)
        assert found.elevation == pytest.approx(plain, abs=1e-6)
        assert found.known.min() > 49_000


@pytest.mark.parametrize(
    ("unit", "factor"), [("ft", 0.3048), ("US survey foot", 1200 / 3937), ("Foot_US", 1200 / 3937), ("cm", 0.01)]
)
def test_heights_have_the_unit_that_the_raster_names(tmp_path, plain, unit, factor):
    path = write_hills(tmp_path / "a.tif", 10, 9.4, 10.6, factor=1 / factor, unit=unit)
    assert look(path, 10.0).elevation == pytest.approx(plain, abs=1e-6)


def test_heights_that_no_land_has_are_gaps(tmp_path, plain):
    """-9999 without a word on it, at the site and in single posts beside it."""
    path = write_hills(tmp_path / "a.tif", 10, 9.4, 10.6, gap=lambda n, e: -9999.0 * (np.hypot(n, e) < 0.01))
    with pytest.raises(InputError, match="has no height at the site"):
        look(path, 10.0)
    path = write_hills(tmp_path / "b.tif", 10, 9.4, 10.6, gap=lambda n, e: -9999.0 * (np.hypot(n + 0.1, e) < 0.004))
    assert look(path, 10.0).elevation == pytest.approx(plain, abs=0.02)


def town(system, longitude, size):
    """Two houses at the ends of a square around the site."""
    x, y = pyproj.Transformer.from_crs("EPSG:4326", system, always_xy=True).transform(longitude, LATITUDE)
    low, high = -size / 2, size / 2 - 10
    houses = [box("a", x + low, y + low, 10, 10, 5, 15), box("b", x + high, y + high, 10, 10, 5, 15)]
    return make_city([polygon for house in houses for polygon in house], system)


def test_a_town_by_the_sea_has_the_horizon_of_all_its_corners(tmp_path):
    """Corners that lie in water, a gap of the raster, see from as high as the middle."""
    sea = write_hills(tmp_path / "sea.tif", 10, 9.4, 10.6, gap=lambda n, e: np.where((e < -0.005) & (n < 0), np.nan, 0))
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
        low, high = points[:, 0].min() - city.points[:, 0].mean(), points[:, 0].max() - city.points[:, 0].mean()
        assert low == pytest.approx(-5000, abs=1000) and high == pytest.approx(5000, abs=1000)
        assert reach[1] < 6000
