"""Terrain of four formats: its heights at known points, and walls that meet it without a slit."""

import gzip
import re
from pathlib import Path

import numpy as np
import pyproj
import pytest
from cities import box, heights_below, make_city
from test_triangulate import vectors

from citypv.core.city.build_scene import SceneOptions, build_scene
from citypv.core.city.terrain import measure_heights
from citypv.core.rays.ray_scene import RayScene
from citypv.core.read.read_terrain import read_terrain
from citypv.core.settings.errors import InputError

DATA = Path(__file__).parents[1] / "data" / "terrain"
ASC = DATA / "dem_jacksboro_utm16_clip.asc"
TIF = DATA / "dem_jacksboro_tn_wgs84.tif"
TIN = DATA / "plateau_yokosuka_523965_dem_tin.gml.gz"
MESH = DATA / "lyon2_terrain.obj.gz"
UTM = "EPSG:32616"


def town(x, y, z, crs=None, step=40.0):
    count = 3
    rows = [
        box(f"b{k}{n}", x + step * k, y + step * n, 15, 12, z, z + 20)
        for k in range(count)
        for n in range(count)
    ]
    return make_city([polygon for row in rows for polygon in row], crs)


def asc_posts():
    """Places and heights of the grid, by the format's own rule: rows from the north, cells around
    their middles.
    """
    lines = ASC.read_text(encoding="utf-8").splitlines()
    head = {key.lower(): float(value) for key, value in (line.split() for line in lines[:6])}
    heights = np.array([[float(word) for word in line.split()] for line in lines[6:]])
    size, rows = head["cellsize"], int(head["nrows"])
    x = head["xllcorner"] + size * (np.arange(heights.shape[1]) + 0.5)
    y = head["yllcorner"] + size * (rows - np.arange(rows) - 0.5)
    return *np.meshgrid(x, y), heights


def write_asc(path, heights, cell=10.0, west=0.0, south=0.0):
    rows, columns = heights.shape
    head = (
        f"ncols {columns}\nnrows {rows}\nxllcorner {west}\nyllcorner {south}\ncellsize "
        f"{cell}\nNODATA_value -9999\n"
    )
    path.write_text(
        head + "\n".join(" ".join(f"{h:.4f}" for h in row) for row in heights), encoding="utf-8"
    )
    return path


def ground(scene):
    """Triangles of the ground that face up: without walls carried down, sides and bottom."""
    level = vectors(scene.vertices, scene.triangles)[:, 2] > 1e-6
    return scene.triangles[(scene.triangle_surface < 0) & ~scene.footprint & level]


def heights_of_scene(scene, places):
    """Height of a scene's ground [m] at places of the files' system."""
    local = scene.site.from_files(np.pad(places, ((0, 0), (0, 1))))[:, :2]
    return heights_below(scene.vertices, ground(scene), local) + scene.site.origin[2]


def test_asc_has_the_heights_of_its_posts():
    x, y, heights = asc_posts()
    city = town(float(x[30, 30]), float(y[30, 30]), float(heights[30, 30]), UTM)
    terrain = read_terrain(ASC, city)
    places = np.column_stack([x[5:55, 5:55].ravel(), y[5:55, 5:55].ravel()])
    assert measure_heights(terrain, places) == pytest.approx(heights[5:55, 5:55].ravel(), abs=1e-3)
    between = 0.5 * (places[:-1] + places[1:])[: 49 * 50]
    same_row = np.abs(np.diff(places[:, 1]))[: 49 * 50] < 1
    middle = 0.5 * (heights[5:55, 5:55].ravel()[:-1] + heights[5:55, 5:55].ravel()[1:])[: 49 * 50]
    assert measure_heights(terrain, between)[same_row] == pytest.approx(middle[same_row], abs=1e-3)


def test_geotiff_in_degrees_lies_where_the_grid_in_metres_lies():
    x, y, heights = asc_posts()
    city = town(float(x[30, 30]), float(y[30, 30]), 400.0, UTM)
    places = np.column_stack([x[25:35, 25:35].ravel(), y[25:35, 25:35].ravel()])
    other = measure_heights(read_terrain(TIF, city), places)
    # One was resampled from the other, on slopes of up to 40 %: a shift by half a cell would give
    # 15 m.
    assert np.median(np.abs(other - heights[25:35, 25:35].ravel())) < 3.0


def test_tin_in_degrees_keeps_heights_and_area():
    turn = pyproj.Transformer.from_crs(6668, 6677, always_xy=True)
    east, north = turn.transform(139.694, 35.2)
    terrain = read_terrain(TIN, town(east, north, 5.0, "EPSG:6677"))
    (layer,) = terrain.layers
    assert len(layer.triangles) == 1066
    area = np.linalg.norm(vectors(layer.points, layer.triangles), axis=1).sum()
    assert area == pytest.approx(1134691.3, rel=1e-3)  # counted by an independent script
    assert layer.points[:, 2].min() == pytest.approx(-0.02)
    assert layer.points[:, 2].max() == pytest.approx(24.2, abs=1e-3)
    # The first corner of the first triangle, as it stands in the file.
    text = gzip.decompress(TIN.read_bytes()).decode("utf-8-sig")
    latitude, longitude, height = (
        float(n) for n in re.search(r"<gml:posList>(\S+) (\S+) (\S+)", text).groups()
    )
    assert (
        np.abs(layer.points - [*turn.transform(longitude, latitude), height]).max(axis=1).min()
        < 1e-3
    )


@pytest.mark.slow
def test_mesh_with_gaps_is_bridged_and_said():
    city = town(-60.0, 0.0, -2.0, step=30.0)
    terrain = read_terrain(MESH, city)
    assert len(terrain.layers[0].points) == 1791
    scene = build_scene(city, 45.76, 4.85, options=SceneOptions(terrain=terrain))
    assert any("gaps" in note for note in scene.report.notes)
    places = np.random.default_rng(1).uniform(-80, 80, (3000, 2))
    assert not np.isnan(heights_below(scene.vertices, scene.triangles, places)).any()


@pytest.mark.slow
def test_ground_follows_the_terrain():
    x, y, heights = asc_posts()
    city = town(float(x[30, 30]), float(y[30, 30]), float(heights[30, 30]), UTM)
    scene = build_scene(city, options=SceneOptions(terrain=read_terrain(ASC, city)))
    places = np.column_stack([x.ravel(), y.ravel()])
    found, distance = heights_of_scene(scene, places), np.hypot(*(places - scene.site.origin[:2]).T)
    off = np.abs(found - heights.ravel())
    assert np.isfinite(found).sum() > 3000
    assert np.nanmax(off[distance < 400]) < 0.15 + 0.01 * 400
    assert np.nanmedian(off[distance < 2400]) < 12.0
    assert len(ground(scene)) < 20_000


def sloping(path, slope=0.2):
    """A plane that rises to the east."""
    columns = np.arange(60) * 10.0 + 5.0 - 300.0
    return write_asc(path, np.tile(slope * columns, (60, 1)), west=-300.0, south=-300.0)


def on_slope(city, folder, *rise):
    terrain = read_terrain(sloping(folder / "slope.asc", *rise), city)
    return build_scene(city, 50.0, 8.0, options=SceneOptions(terrain=terrain))


@pytest.mark.slow
def test_walls_above_a_slope_are_carried_down_and_those_below_are_cut(tmp_path):
    city = town(-60.0, -60.0, 0.0)
    scene = on_slope(city, tmp_path)
    raised = scene.report.repaired["ends above the terrain, extended down to it"]
    buried = scene.report.repaired["continues below the terrain, cut off at it"]
    # three buildings of six surfaces each
    column = {name: k // 18 for k, name in enumerate(city.surface_id)}
    assert {column[name] for name in raised} == {
        0,
        1,
    }  # x from -60 and -20; the terrain is level with them at 0
    assert {column[name] for name in buried} == {2}  # x from 20
    assert all(
        np.ptp(city.rings(city.surface_id.index(name))[0][:, 2]) > 19 for name in raised
    )  # walls, not floors
    assert any("extended downwards" in note for note in scene.report.notes)


@pytest.mark.slow
def test_no_ray_slips_under_a_wall(tmp_path):
    city = town(-60.0, -60.0, 0.0)
    scene = on_slope(city, tmp_path)
    rays = RayScene(scene.vertices, scene.triangles)
    normal = vectors(scene.vertices, scene.triangles)
    rng = np.random.default_rng(2)
    middle = city.points.mean(axis=0)[:2] - np.array(scene.site.origin)[:2]
    origins = np.column_stack([rng.uniform(-55, 55, (20_000, 2)) + middle, np.full(20_000, 40.0)])
    targets = np.column_stack([rng.uniform(-55, 55, (20_000, 2)) + middle, np.full(20_000, -10.0)])
    directions = targets - origins
    hits = rays.trace_closest(origins.astype(np.float32), directions.astype(np.float32))
    assert (hits >= 0).all()
    # From outside, only fronts are ever met first: a back would mean a way in.
    assert (
        (normal[hits] * directions).sum(axis=1) < 1e-6 * np.linalg.norm(normal[hits], axis=1)
    ).all()


@pytest.mark.slow
def test_marks_for_gaps_are_no_heights(tmp_path):
    heights = np.zeros((60, 60))
    heights[:, :25] = -9999
    heights[40, 40] = -32767.0
    city = town(-60.0, -60.0, 0.0)
    terrain = read_terrain(
        write_asc(tmp_path / "gaps.asc", heights, west=-300.0, south=-300.0), city
    )
    assert any("treated as gaps" in note for note in terrain.notes)
    scene = build_scene(city, 50.0, 8.0, options=SceneOptions(terrain=terrain))
    assert any("gaps" in note and "%" in note for note in scene.report.notes)
    vertices = scene.vertices[np.unique(ground(scene))]
    assert np.abs(vertices[:, 2]).max() < 1e-6


@pytest.mark.slow
def test_terrain_of_another_place_is_refused():
    city = town(389_000.0, 5_819_000.0, 30.0, "EPSG:25833")
    with pytest.raises(InputError, match=r"km away from the buildings|no heights at the city"):
        read_terrain(ASC, city)
    for path in (TIF, TIN):
        with pytest.raises(InputError, match=r"km away|no heights at the city|does not lie"):
            read_terrain(path, city)


@pytest.mark.parametrize(
    ("name", "data", "problem"),
    [
        ("a.tif", b"II*\0" + bytes(50), "is not a readable raster"),
        ("a.tif", TIF.read_bytes()[:90_000], "is not a readable raster|no heights at the city"),
        ("a.asc", b"hello", "is not a readable raster"),
        ("a.asc", b"ncols 5\nnrows 5\n", "is not a readable raster"),
        (
            "a.asc",
            b"ncols 2000000\nnrows 2000000\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3\n",
            "is not a readable",
        ),
        ("a.txt", b"1 2 3", "not a known terrain format"),
        ("a.obj", b"v 1 2 3\n", "contains no polygons"),
        ("a.gml", b"<a/>", "contains no TINRelief"),
        (
            "a.gml",
            b"<a><Triangle><posList>1 2 3</posList></Triangle></a>",
            "a triangle with 3 numbers",
        ),
        ("a.gml", b"<a><Triangle><posList>1 2 x</posList></Triangle></a>", "not numeric"),
        (
            "a.gml",
            b"<a><Triangle><posList>nan 0 0 1 0 0 1 1 0</posList></Triangle></a>",
            "not finite",
        ),
        ("a.tif", b"", "the file is empty"),
    ],
)
def test_refused(tmp_path, name, data, problem):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=problem) as caught:
        read_terrain(tmp_path / name, town(746_000.0, 4_021_000.0, 0.0, UTM))
    assert len(str(caught.value).splitlines()) == 1
