"""What each tolerance of geometry decides: halved, it decides otherwise; and what none decides."""

import re
from contextlib import contextmanager
from dataclasses import FrozenInstanceError, fields
from types import SimpleNamespace

import numpy as np
import pytest
from test_slabs_and_sheets import HOUSE, ROOT, scene_of, sheet
from towns import city_of_polygons

from citypv.core.city.build_scene import build_scene
from citypv.core.city.classify import find_footprints
from citypv.core.city.find_feet import _find_floating
from citypv.core.city.find_ground import upward_areas
from citypv.core.city.find_twins import find_twins
from citypv.core.city.join_sheets import join_sheets
from citypv.core.city.orient_shells import orient_shells
from citypv.core.city.polygons import measure_polygons, merge_vertices, triangulate
from citypv.core.city.repair_polygons import repair_polygons
from citypv.core.city.split_edges import refine_triangles
from citypv.core.light.measure_cover import measure_cover
from citypv.core.rays.faces import Faces
from citypv.core.rays.ray_scene import HitPlaces
from citypv.core.read.read_city import read_city
from citypv.core.settings.tolerances import GEOMETRY


@contextmanager
def scaled(name, factor):
    """Within the block the tolerance is as many times as large."""
    value = getattr(GEOMETRY, name)
    object.__setattr__(GEOMETRY, name, factor * value)
    try:
        yield
    finally:
        object.__setattr__(GEOMETRY, name, value)


def level(low, high, height):
    """A rectangle that faces up."""
    (x, y), (u, v) = low, high
    return np.array([(x, y, height), (u, y, height), (u, v, height), (x, v, height)], float)


def lifted(corners, height, axis=2):
    """The same polygon higher, or moved along another axis."""
    return corners + height * np.eye(3)[axis]


def shape_of(*polygons):
    """Points, ring_start and polygon_start of polygons without holes."""
    starts = np.cumsum([0, *map(len, polygons)])
    return np.concatenate(polygons), starts, np.arange(len(polygons) + 1)


def twins(*polygons):
    shape = shape_of(*polygons)
    area, normal = measure_polygons(*shape)
    return np.flatnonzero(find_twins(shape, area, normal, np.ones(len(area), bool))).tolist()


def count_shells():
    """Two squares side by side, the corners of one 0.4 mm beside the other's."""
    drawn = level((0, 0), (1, 1), 0), lifted(level((1, 0), (2, 1), 0), 0.0004, axis=1)
    return len(np.unique(orient_shells(*shape_of(*drawn), np.zeros(2, int)).shell))


def count_vertices():
    """Two triangles with four corners, two of which are drawn 4 µm apart."""
    points = np.array(
        [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 0, 4e-6), (1, 1, 0), (0, 1, 4e-6)], float
    )
    return len(merge_vertices(points, np.arange(6).reshape(2, 3))[0])


def count_polygons():
    """A house, and a face of it of 0.7 mm²."""
    tiny = [level((2, 2), (2.001, 2.0007), 3)]
    city = city_of_polygons([*HOUSE, *tiny])
    return len(repair_polygons(city, list(range(len(city))), city.report)) - len(HOUSE)


def count_triangles():
    """A triangle of 1 m that is 1.4 nm high."""
    points = np.array([(0, 0, 0), (1, 0, 0), (0.5, 1.4e-9, 0)])
    return len(triangulate(points, np.array([0, 3]), np.array([0, 1]))[0])


def count_parts():
    """A triangle whose longest edge is longer than the patch size by 0.7 millionths."""
    points = np.array([(0, 0, 0), (1 + 7e-7, 0, 0), (0.5, 0.4, 0)])
    return len(refine_triangles(points, np.array([[0, 1, 2]]), 1.0)[1])


def count_grounds():
    """Two squares on one level with a gap of 7 cm."""
    points = np.concatenate([level((0, 0), (5, 5), 0), level((5.07, 0), (10, 5), 0)])
    triangles = np.array([(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)])
    return len(np.unique(join_sheets(points, triangles, np.array([0, 0, 1, 1]), triangles)))


def count_sheets():
    """A panel 0.2 m before the wall of a house."""
    panel = sheet([-0.3, -0.2, 2], [0.6, 0, 0], [0, 0, 0.6])
    return len(np.unique(scene_of(HOUSE, panel).triangle_surface[scene_of(HOUSE, panel).sheet]))


def count_footprints():
    """The underside of a building, 0.4 m above its lowest corner."""
    under, wall = level((0, 0), (4, 4), 0.4)[::-1], [(0, 0, 0), (4, 0, 0), (4, 0, 3), (0, 0, 3)]
    points, *starts = shape_of(under, np.array(wall, float))
    city = SimpleNamespace(ring_start=starts[0], polygon_start=starts[1])
    surfaces = SimpleNamespace(
        thematic=["", ""], building_id=["a", "a"], kind=np.array(["downward", "facade"])
    )
    return int(find_footprints(surfaces, city, points).sum())


def count_floating():
    """A house of 10 m whose lowest edge is 2 m above the ground."""
    building, middles = np.zeros(1, int), np.array([[0, 0, 2.0]])
    objects = np.array([10.0]), np.array([False])
    return int(_find_floating(building, middles, objects, lambda places, thin: [0.0]).sum())


def count_level():
    """A face whose normal rises by 0.7° above the horizon."""
    lean = np.tan(np.radians(0.7))
    points = np.array([(0, 0, 0), (1, 0, 0), (0, lean, 1)], float)
    return int((upward_areas(points, np.array([[0, 1, 2]])) != 0).sum())


def count_facing():
    """Two faces with a cosine of -0.7 between their normals."""
    slope = np.sqrt(1 / 0.7**2 - 1)
    one = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    other = [(0, 0, 1), (0, 1, 1 + slope), (1, 0, 1)]
    none = np.zeros(2, bool)
    faces, _ = Faces.of_triangles(np.array([one, other], float), none, none - np.int32(1))
    hits = HitPlaces(np.array([1]), np.float32([0.3]), np.float32([0.3]))
    return int(np.isfinite(faces.facing_distance(np.array([0]), hits)).sum())


SQUARE = level((0, 0), (4, 4), 0)
DECIDES = {  # tolerance -> what it decides, and what it is as it stands and halved
    "accuracy": (lambda: len(twins(SQUARE, lifted(SQUARE, 0.007))), 1, 0),
    "corner": (count_shells, 1, 2),
    "computed": (lambda: twins(SQUARE, lifted(SQUARE, 7e-5)), [1], [0]),
    "vertex": (count_vertices, 4, 6),
    "area": (count_polygons, 0, 1),
    "sliver": (count_triangles, 0, 1),
    "tie": (count_parts, 1, 2),
    "uneven": (count_grounds, 1, 2),
    "cladding": (count_sheets, 0, 1),
    "step": (count_footprints, 1, 0),
    "storey": (count_floating, 0, 1),
    "upright": (count_level, 0, 1),
    "facing": (count_facing, 0, 1),
}


@pytest.mark.parametrize("name", DECIDES)
def test_a_tolerance_decides_otherwise_when_it_is_halved(name):
    decide, whole, half = DECIDES[name]
    assert decide() == whole
    with scaled(name, 0.5):
        assert decide() == half
    assert decide() == whole


FILES = (
    "citygml/denhaag_1BwBP.gml",
    "cityjson/denhaag_random_5.city.jsonl",
    "citygml/zurich_lod2_v1.xml.gz",
)


def judge(file):
    """What the polygons of a file are, and which of them lie inside something."""
    city = read_city([ROOT / "tests/data" / file])
    scene = build_scene(city, patch_size=10.0)
    surfaces = scene.surfaces
    covered = measure_cover(scene, threads=1) > 0.5
    return [
        *(surfaces.kind, surfaces.eligible, covered, scene.sheet, scene.footprint),
        surfaces.normal.round(6),
    ]


@pytest.mark.parametrize("factor", [0.5, 2.0])
@pytest.mark.parametrize("file", FILES)
def test_twice_or_half_the_distance_of_rays_from_their_faces_changes_nothing(file, factor):
    whole = judge(file)
    with scaled("spacings", factor):
        for one, other in zip(whole, judge(file), strict=True):
            np.testing.assert_array_equal(one, other)


def test_each_tolerance_is_tried_and_told_and_none_is_changed_in_passing():
    names = {field.name for field in fields(GEOMETRY)}
    assert names == {*DECIDES, "spacings"}
    manual = (ROOT / "docs/reference/method.md").read_text("utf-8")
    rows = dict(re.findall(r"^\| (\w+) \| ([\d.e-]+)", manual, re.MULTILINE))
    assert {name: float(value) for name, value in rows.items()} == vars(GEOMETRY)
    with pytest.raises(FrozenInstanceError):
        GEOMETRY.accuracy = 1.0
