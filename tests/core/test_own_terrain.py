"""Terrain that stands in the city's own file: read with the buildings, and the ground unless told
otherwise.
"""

import gzip
import re
from pathlib import Path

import numpy as np
import pyproj
import pytest
from citygml_text import building, members, wrap
from reliefs import hill, only, relief, tin, told, triangle
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import Delaunay
from small_city import EAST, HEAD, HOUSES, NORTH, UP, write_gml
from test_terrain import heights_of_scene

from citypv.core.city.build_scene import build_scene
from citypv.core.city.terrain import measure_heights
from citypv.core.read import parse_xml
from citypv.core.read.read_city import read_city
from citypv.core.run.study import make_scene
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request

pytestmark = pytest.mark.every_python

ORIGIN = np.array([EAST, NORTH, UP])


def around(count=400, low=-25.0, high=55.0):
    """Places in the open between and around the three houses, within the small city."""
    x, y = np.random.default_rng(3).uniform(low, high, (2, count))
    inside = (x > -1) & (x < 31) & (y > -4) & (y < 34)
    return np.column_stack([x, y])[~inside]


def interpolate(points, places):
    """Heights of the same triangulation by SciPy."""
    return LinearNDInterpolator(Delaunay(points[:, :2]), points[:, 2])(places)


def same_scene(one, other):
    return np.array_equal(one.vertices, other.vertices) and np.array_equal(
        one.triangles, other.triangles
    )


@pytest.mark.slow
@pytest.mark.parametrize("version", ["1.0", "2.0", "3.0"])
def test_relief_of_a_citygml_file_is_its_ground(tmp_path, version):
    points, triangles = tin()
    text = relief(points, triangles).replace("citygml/relief/2.0", f"citygml/relief/{version}")
    city = read_city(write_gml(tmp_path / "city.gml", text, HOUSES))
    assert len(city) == 21
    assert city.crs == "EPSG:25833"
    assert city.report.notes == []
    assert len(only(city).triangles) == len(triangles)
    places = around()
    expected = interpolate(points, places)
    assert measure_heights(city.terrain, places + ORIGIN[:2]) - UP == pytest.approx(
        expected, abs=1e-6
    )
    scene = build_scene(city)
    assert told(scene, f"Ground: terrain of the file: {len(triangles):,} triangles.")
    found = heights_of_scene(scene, places + ORIGIN[:2]) - UP
    # `build_terrain` promises 15 cm, and 1 cm more for each metre from the feet.
    assert np.abs(found - expected).max() < 0.15 + 0.01 * 45
    assert np.median(np.abs(found - expected)) < 0.1
    feet = heights_of_scene(build_scene(city, ground="feet"), places + ORIGIN[:2]) - UP
    assert np.abs(feet).max() < 0.01  # the houses stand level


@pytest.mark.slow
def test_the_scene_is_that_of_the_same_relief_given_as_a_file(tmp_path):
    points, triangles = tin()
    own = write_gml(tmp_path / "own.gml", HOUSES, relief(points, triangles))
    bare = write_gml(tmp_path / "bare.gml", HOUSES)
    apart = write_gml(tmp_path / "relief.gml", relief(points, triangles))
    first, *others = (
        make_scene(read_city(city), Request(terrain=terrain))
        for city, terrain in ((own, None), (bare, str(apart)), (own, str(own)))
    )
    assert all(same_scene(first, other) for other in others)
    assert not same_scene(first, make_scene(read_city(bare), Request()))
    assert told(others[1], "not used") and not told(others[1], "Ground: terrain of the file")


@pytest.mark.slow
@pytest.mark.parametrize("ground", ["feet", "none"])
def test_relief_can_be_left_out(tmp_path, ground):
    points, triangles = tin()
    own = read_city(write_gml(tmp_path / "own.gml", HOUSES, relief(points, triangles)))
    bare = read_city(write_gml(tmp_path / "bare.gml", HOUSES))
    scene = build_scene(own, ground=ground)
    assert same_scene(scene, build_scene(bare, ground=ground))
    assert told(
        scene, f"Terrain of the file: {len(triangles):,} triangles, left out (--ground {ground})."
    )
    with pytest.raises(InputError, match="--ground"):
        build_scene(own, ground="sea")


@pytest.mark.slow
@pytest.mark.parametrize("margin", [0.0, 0.4])
def test_relief_with_holes_under_buildings(tmp_path, margin):
    """A TIN that is cut out along a house, or somewhat wider, has heights at its walls."""
    low, high, m = np.array([0.0, 0.0]), np.array([12.0, 10.0]), margin
    inner = np.array([low - m, (high[0] + m, low[1] - m), high + m, (low[0] - m, high[1] + m)])
    outer = np.array([(-150, -150), (180, -150), (180, 180), (-150, 180)])
    places = np.concatenate([inner, outer])
    points = np.column_stack([places, 0.1 * places[:, 0] - 0.05 * places[:, 1]])
    k = np.arange(4)
    ring = [
        np.column_stack([k, k + 4, (k + 1) % 4 + 4]),
        np.column_stack([k, (k + 1) % 4 + 4, (k + 1) % 4]),
    ]
    text = relief(points, np.concatenate(ring))
    one = HOUSES[: HOUSES.index("</cityObjectMember>") + len("</cityObjectMember>")]
    scene = build_scene(read_city(write_gml(tmp_path / "city.gml", one, text)))
    assert told(scene, "Ground: terrain of the file: 8 triangles.")
    assert told(scene, "The terrain has gaps") == bool(margin)
    share = np.linspace(0, 1, 40)[:, None]
    walls = np.concatenate([low + share * (high - low) * axis for axis in ([1, 0], [0, 1])]) - 0.02
    expected = 0.1 * walls[:, 0] - 0.05 * walls[:, 1]
    found = heights_of_scene(scene, walls + ORIGIN[:2]) - UP
    assert found == pytest.approx(expected, abs=0.01 + 0.15 * margin)  # the slope is at most 0.15


@pytest.mark.slow
def test_relief_of_another_place_is_left_out(tmp_path):
    points, triangles = tin()
    bare = build_scene(read_city(write_gml(tmp_path / "bare.gml", HOUSES)))
    for away in (
        (5000.0, 0.0),
        (195.0, 0.0),
    ):  # 15 m between the relief's edge and the nearest wall
        text = relief(points, triangles, move=ORIGIN + np.array([*away, 0.0]))
        scene = build_scene(read_city(write_gml(tmp_path / "own.gml", HOUSES, text)))
        assert same_scene(scene, bare)
        assert told(scene, "Terrain of the file left out: no height under any building")
        assert not told(scene, "Ground: terrain")


@pytest.mark.slow
def test_relief_of_a_part_is_followed_by_the_feet(tmp_path):
    """Beyond the relief the ground runs through the feet, and at the zero level of the relief."""
    points, triangles = tin(high=(16.0, 15.0), height=lambda x, y: 0 * x + 0.5)
    far = re.sub(
        r"<gml:posList>([^<]*)<", lambda m: f"<gml:posList>{_shift(m[1], 100, 0, 6)}<", HOUSES
    )
    far = far.replace('"a', '"d').replace('"b', '"e').replace('"c', '"f')
    scene = build_scene(
        read_city(write_gml(tmp_path / "city.gml", HOUSES, far, relief(points, triangles)))
    )
    assert told(scene, "follow the buildings' feet")
    near, beyond = (-3.0, 5.0), (106.0, -0.1)
    found = heights_of_scene(scene, np.array([near, beyond]) + ORIGIN[:2]) - UP
    assert found == pytest.approx([0.5, 6.5], abs=0.02)


def _shift(text, *move):
    numbers = np.array(text.split(), float).reshape(-1, 3) + move
    return " ".join(f"{value:.3f}" for value in numbers.ravel())


@pytest.mark.slow
@pytest.mark.parametrize("where", ["srs_name", "envelope"])
def test_relief_in_another_system(tmp_path, where):
    """Zone 32 in a file of zone 33: heights stand where pyproj sees them."""
    points, triangles = tin()
    turn = pyproj.Transformer.from_crs(25833, 25832, always_xy=True)
    there = np.column_stack([*turn.transform(*(points[:, :2] + ORIGIN[:2]).T), points[:, 2] + UP])
    code = "urn:ogc:def:crs:EPSG::25832"
    corner = "<gml:lowerCorner>0 0 0</gml:lowerCorner>"
    bounds = (
        f'<gml:boundedBy><gml:Envelope srsName="{code}">{corner}</gml:Envelope></gml:boundedBy>'
    )
    given = {where: code if where == "srs_name" else bounds}
    city = read_city(
        write_gml(
            tmp_path / "city.gml", relief(there, triangles, move=np.zeros(3), **given), HOUSES
        )
    )
    assert city.crs == "EPSG:25833"
    expected = interpolate(points, around())
    assert measure_heights(city.terrain, around() + ORIGIN[:2]) - UP == pytest.approx(
        expected, abs=1e-4
    )


@pytest.mark.slow
def test_relief_in_degrees(tmp_path):
    """Latitude first, as PLATEAU writes: the relief lies under the houses whatever plane is chosen
    for them.
    """
    points, triangles = tin()
    back = pyproj.Transformer.from_crs(6677, 6668, always_xy=True)

    def to_degrees(numbers):
        east, north = back.transform(
            numbers[:, 0] - 14_000.0 - EAST, numbers[:, 1] - 88_000.0 - NORTH
        )
        return np.column_stack([north, east, numbers[:, 2]])

    def rewrite(match):
        numbers = to_degrees(np.array(match[1].split(), float).reshape(-1, 3))
        return f"<gml:posList>{' '.join(f'{value:.12f}' for value in numbers.ravel())}<"

    text = relief(to_degrees(points + ORIGIN), triangles, move=np.zeros(3))
    head = HEAD.replace("EPSG::25833", "EPSG::6697")
    houses = re.sub(r"<gml:posList>([^<]*)<", rewrite, HOUSES)
    city = read_city(write_gml(tmp_path / "city.gml", houses, text, head=head))
    scene = build_scene(city)
    assert told(scene, "Ground: terrain of the file")
    # Houses and relief keep their places to each other: corners of house a are at known heights of
    # the relief.
    corner = city.rings(city.surface_id.index("a_ground"))[0]
    expected = interpolate(points, [[0, 0], [0, 10], [12, 10], [12, 0]])
    assert np.sort(measure_heights(city.terrain, corner[:, :2]) - UP) == pytest.approx(
        np.sort(expected), abs=1e-3
    )


@pytest.mark.slow
def test_the_finest_level_of_detail_counts(tmp_path):
    coarse, fine = (
        tin(step=40.0),
        tin((-20.0, -20.0), (45.0, 45.0), step=6.0, height=lambda x, y: hill(x, y) + 3),
    )
    members = relief(*coarse, lod="1"), HOUSES, relief(*fine, lod="2")
    city = read_city(write_gml(tmp_path / "city.gml", *members))
    assert [len(layer.triangles) for layer in city.terrain.layers] == [len(fine[1]), len(coarse[1])]
    places = np.array([[5.0, -2.0], [-100.0, 20.0]])
    expected = [
        interpolate(points, place)[0]
        for (points, _), place in zip((fine, coarse), places, strict=True)
    ]
    assert measure_heights(city.terrain, places + ORIGIN[:2]) - UP == pytest.approx(
        expected, abs=1e-6
    )


@pytest.mark.slow
def test_tiles_join(tmp_path):
    points, triangles = tin()
    west = points[triangles].mean(axis=1)[:, 0] < 15
    whole = read_city(write_gml(tmp_path / "whole.gml", HOUSES, relief(points, triangles)))
    folder = tmp_path / "tiles"
    folder.mkdir()
    split = HOUSES.index("<cityObjectMember>", 20)
    write_gml(folder / "1.gml", relief(points, triangles[west]), HOUSES[:split])
    write_gml(folder / "2.gml", HOUSES[split:], relief(points, triangles[~west]))
    city = read_city(folder)
    assert len(only(city).triangles) == len(triangles)
    places = around() + ORIGIN[:2]
    assert measure_heights(city.terrain, places) == pytest.approx(
        measure_heights(whole.terrain, places), abs=1e-9
    )


def test_triangles_of_a_building_stay_its_own(tmp_path):
    """Of a triangulated roof nothing is lost to the terrain, wherever the relief stands in the
    file.
    """
    points, triangles = tin(step=60.0)
    box = f"{EAST + 40:.1f} {NORTH:.1f} {UP:.1f}", f"{EAST + 44:.1f} {NORTH:.1f} {UP:.1f}"
    corner = f"{EAST + 40:.1f} {NORTH:.1f} {UP + 5:.1f}"
    patches = wrap(
        triangle(f"{box[0]} {box[1]} {corner} {box[0]}"),
        "gml:TriangulatedSurface",
        "gml:trianglePatches",
    )
    shed = building(
        wrap(members(patches), "bldg:lod2MultiSurface", "gml:MultiSurface"), name="shed"
    )
    city = read_city(write_gml(tmp_path / "city.gml", HOUSES, relief(points, triangles), shed))
    assert len(city) == 22
    assert city.building_id[-1] == "shed"
    assert len(only(city).triangles) == len(triangles)


@pytest.mark.slow
def test_large_reliefs_are_read_in_pieces(tmp_path, monkeypatch):
    """Only what is held in memory at once counts: a relief of many tags is no bomb."""
    points, triangles = tin(step=6.0)
    text = relief(points, triangles)
    assert text.count("<") > 40_000
    monkeypatch.setattr(parse_xml, "MOST_TAGS", 20_000)
    city = read_city(write_gml(tmp_path / "city.gml", text, HOUSES))
    assert len(only(city).triangles) == len(triangles)


def test_what_cannot_be_used_is_named(tmp_path):
    points, triangles = tin(step=60.0)
    text = relief(points, triangles)
    first, second = (text.index("<gml:posList>", k) for k in (0, text.index("</gml:Triangle>")))
    broken = text[:second] + "<gml:posList>1 2 x" + text[text.index("</gml:posList>", second) :]
    broken = broken[:first] + "<gml:posList>1 2 3" + broken[broken.index("</gml:posList>", first) :]
    raster = (
        "<cityObjectMember><dem:ReliefFeature "
        'xmlns:dem="d"><dem:RasterRelief/></dem:ReliefFeature></cityObjectMember>'
    )
    city = read_city(write_gml(tmp_path / "city.gml", broken, raster, HOUSES))
    assert len(only(city).triangles) == len(triangles) - 2
    assert (
        sum(
            len(names)
            for reason, names in city.report.skipped.items()
            if "not a triangle" in reason
        )
        == 2
    )
    assert city.report.notes == ["1 ReliefFeature left out: no triangles."]
    with pytest.raises(InputError, match=r"contains no buildings.*--terrain") as caught:
        read_city(write_gml(tmp_path / "only.gml", text))
    assert len(str(caught.value).splitlines()) == 1


# -- relief and buildings of one real file: eight houses of The Hague on their own terrain --

HAGUE = Path(__file__).parents[1] / "data" / "citygml" / "denhaag_cut_with_relief.gml.gz"


@pytest.mark.slow
def test_eight_houses_of_the_hague():
    """Heights of the real TIN at random places, by barycentric coordinates of the text's own
    triangles.
    """
    text = gzip.decompress(HAGUE.read_bytes()).decode("utf-8")
    tags = re.findall(r"<gml:Triangle>.*?<gml:posList[^>]*>([^<]*)<", text, re.DOTALL)
    corners = np.array([np.array(tag.split(), float).reshape(4, 3)[:3] for tag in tags])
    city = read_city(HAGUE)
    assert city.report.building_count == text.count("<bldg:Building ") == 8
    assert len(only(city).triangles) == len(corners) == 719
    rng = np.random.default_rng(5)
    size = 0.5 * np.linalg.norm(
        np.cross(*(corners[:, 1:] - corners[:, :1]).transpose(1, 0, 2))[:, 2:], axis=1
    )
    chosen = rng.choice(np.flatnonzero(size > 0.5), 300)
    share = rng.dirichlet([1.0, 1.0, 1.0], 300)
    places = (share[:, :, None] * corners[chosen]).sum(axis=1)
    assert np.abs(measure_heights(city.terrain, places[:, :2]) - places[:, 2]).max() < 1e-5
    scene = build_scene(city)
    assert told(scene, "Ground: terrain of the file: 719 triangles.")
    middle = 0.5 * (city.points.min(axis=0) + city.points.max(axis=0))[:2]
    near = np.abs(places[:, :2] - middle).max(axis=1) < 45
    off = np.abs(heights_of_scene(scene, places[near, :2]) - places[near, 2])
    assert np.nanmedian(off) < 0.1
    assert len(build_scene(city, ground="feet").surfaces) == len(scene.surfaces) == len(city)
