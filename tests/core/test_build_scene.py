"""The scene: origin, true north, patches, flags, cells; and its ground: no wall hangs, no court is
lost.
"""

from pathlib import Path

import numpy as np
import pytest
import shapely
from cities import box, heights_below, make_city
from test_triangulate import vectors

from citypv.core.city.build_scene import build_scene
from citypv.core.city.grid_cells import split_into_cells
from citypv.core.city.polygons import measure_polygons
from citypv.core.read.read_city import read_city
from citypv.core.settings.errors import InputError

ROOT = Path(__file__).parents[2]
HANNOVER = ROOT / "tests" / "data" / "citygml" / "hannover_LGLN_LoD2_32_550_5802_3bld.gml"
BERLIN = ROOT / "examples" / "berlin" / "berlin_3910_5817.gml"


@pytest.fixture(scope="module")
def hannover():
    return build_scene(read_city(HANNOVER))


def test_origin_is_the_middle_of_the_points_at_their_lowest_height(hannover):
    city = read_city(HANNOVER)
    low, high = city.points.min(axis=0), city.points.max(axis=0)
    assert hannover.site.origin == pytest.approx((*(0.5 * (low + high))[:2], low[2]))
    assert hannover.site.altitude == pytest.approx(54.156)
    assert (hannover.site.latitude, hannover.site.longitude) == pytest.approx(
        (52.3737, 9.7431), abs=1e-3
    )
    assert (
        np.abs(hannover.vertices).max() < 1000
    )  # small numbers keep their digits in single precision


def test_azimuths_are_from_true_north(hannover):
    city = read_city(HANNOVER)
    _, normal = measure_polygons(city.points, city.ring_start, city.polygon_start)
    walls = hannover.surfaces.kind == "facade"
    on_grid = np.degrees(np.arctan2(normal[:, 0], normal[:, 1]))[walls]
    turned = (hannover.surfaces.surface_azimuth[walls] - on_grid + 180) % 360 - 180
    assert turned == pytest.approx(hannover.site.convergence, abs=1e-3)
    assert hannover.site.convergence > 0.5


@pytest.mark.slow
def test_patches_are_small_and_cover_their_surfaces(hannover):
    own, size = hannover.triangle_surface >= 0, vectors(hannover.vertices, hannover.triangles)
    covered = np.bincount(
        hannover.triangle_surface[own], np.linalg.norm(size[own], axis=1), len(hannover.surfaces)
    )
    assert covered == pytest.approx(hannover.surfaces.area, rel=1e-4, abs=1e-3)
    edges = hannover.triangles[own][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    span = hannover.vertices[edges[:, 0]] - hannover.vertices[edges[:, 1]]
    assert np.linalg.norm(span, axis=1).max() <= 10.0001
    whole = build_scene(read_city(HANNOVER), ground="none", patch_size=None)
    assert len(whole.triangles) < own.sum()


def test_footprints_and_closures_are_flagged(hannover):
    thematic = np.array(hannover.surfaces.thematic)[hannover.triangle_surface]
    own = hannover.triangle_surface >= 0
    assert np.array_equal(hannover.footprint[own], thematic[own] == "GroundSurface")
    assert np.array_equal(hannover.closure[own], thematic[own] == "ClosureSurface")
    assert hannover.closure.sum() > 0
    closures = np.array(hannover.surfaces.thematic) == "ClosureSurface"
    assert not hannover.surfaces.eligible[closures].any()


def test_footprints_are_found_without_semantics():
    city = make_city(box("a", 0, 0, 10, 10, 3, 9, semantics=False))
    scene = build_scene(city, 50.0, 8.0, ground="none")
    assert set(scene.triangle_surface[scene.footprint]) == {0}


def test_local_coordinates_under_the_name_of_a_grid_are_noted():
    """0, 0 of the Dutch grid is in France; where the user gives the place, there is nothing
    to say.
    """
    city = make_city(box("a", 0, 0, 10, 10, 0, 9), crs="EPSG:28992")
    (note,) = build_scene(city).report.notes
    assert "lies 2.8° outside the area of use of EPSG:28992" in note and "--latitude" in note
    assert not build_scene(city, latitude=52.0, longitude=5.0).report.notes
    assert not city.report.notes


def test_cells_are_rows_of_their_polygon():
    city = make_city(box("a", 0, 0, 10, 20, 0, 6))
    cells, parent = split_into_cells(city, 5.0)
    counts = np.bincount(parent)
    assert counts.tolist() == [
        8,
        8,
        4,
        8,
        4,
        8,
    ]  # 10 x 20 m, and walls of 20 and 10 by 6 m in rows of 5 and 1 m
    assert cells.surface_id[:2] == ["s0#1", "s0#2"]
    assert len(set(cells.surface_id)) == len(cells)
    area, normal = measure_polygons(cells.points, cells.ring_start, cells.polygon_start)
    whole, whole_normal = measure_polygons(city.points, city.ring_start, city.polygon_start)
    assert np.bincount(parent, area) == pytest.approx(whole)
    assert normal == pytest.approx(whole_normal[parent], abs=1e-9)
    assert area.max() == pytest.approx(25.0)


def test_cells_keep_holes_and_small_polygons_their_name():
    square = [(0, 0, 3), (10, 0, 3), (10, 10, 3), (0, 10, 3)]
    hole = [(4, 4, 3), (4, 6, 3), (6, 6, 3), (6, 4, 3)]
    city = make_city([("a", "", [square, hole]), ("a", "", [[(0, 0, 0), (1, 0, 0), (0, 1, 0)]])])
    cells, parent = split_into_cells(city, 9.0)
    area, _ = measure_polygons(cells.points, cells.ring_start, cells.polygon_start)
    assert np.bincount(parent, area) == pytest.approx([96.0, 0.5])
    assert cells.surface_id[-1] == "s1"
    with pytest.raises(InputError, match="not positive"):
        split_into_cells(city, 0.0)


def ground_of(scene):
    triangles = scene.triangles[scene.triangle_surface < 0]
    return scene.vertices, triangles


def seen_from_above(scene, chosen):
    corners = scene.vertices[scene.triangles[chosen]][:, :, :2]
    return shapely.union_all(shapely.make_valid(shapely.polygons(corners)))


def foot_places(scene):
    """Points 1.5 cm outside of the lower ends of walls: samples along footprint edges with open air
    beside them.
    """
    footprint = seen_from_above(scene, scene.footprint)
    edges = scene.triangles[scene.footprint][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    start, end = scene.vertices[edges[:, 0]], scene.vertices[edges[:, 1]]
    places = np.concatenate([start + share * (end - start) for share in (0.1, 0.37, 0.5, 0.81)])
    direction = np.tile((end - start)[:, :2], (4, 1))
    sideways = np.column_stack([direction[:, 1], -direction[:, 0]])
    sideways *= 0.015 / np.maximum(np.linalg.norm(sideways, axis=1), 1e-9)[:, None]
    beside = np.concatenate([places[:, :2] + sideways, places[:, :2] - sideways])
    height = np.concatenate([places[:, 2], places[:, 2]])
    open_air = ~shapely.intersects_xy(shapely.buffer(footprint, 0.014), *beside.T)
    return np.column_stack([beside, height])[open_air]


@pytest.fixture(scope="module")
def berlin():
    return build_scene(read_city(BERLIN))


@pytest.mark.slow
def test_no_wall_of_berlin_hangs(berlin):
    places = foot_places(berlin)
    ground = heights_below(*ground_of(berlin), places)
    assert len(places) > 10_000
    assert not np.isnan(ground).any()
    gap = places[:, 2] - ground  # positive where the foot is above the ground
    assert gap.max() < 0.03  # beside the foot by 1.5 cm, on ground that may be steep
    # Where neighbours stand at different heights the ground takes the higher: little of the walls
    # goes under.
    assert np.mean(gap < -0.5) < 0.02


def test_the_ground_of_berlin_is_small_and_faces_up(berlin):
    vertices, triangles = ground_of(berlin)
    assert 4_000 < len(triangles) < 15_000
    assert vectors(vertices, triangles)[:, 2].min() > 0
    assert not berlin.footprint[berlin.triangle_surface < 0].any()


@pytest.mark.slow
def test_no_courtyard_of_berlin_is_lost(berlin):
    places = np.random.default_rng(0).uniform([-480, -150], [480, 150], (20_000, 2))
    footprint = seen_from_above(berlin, berlin.footprint)
    outside = ~shapely.intersects_xy(shapely.buffer(footprint, 0.05), *places.T)
    ground = heights_below(*ground_of(berlin), places)
    assert outside.mean() > 0.5
    assert not np.isnan(ground[outside]).any()
    holes = shapely.polygons(
        [ring for part in shapely.get_parts(footprint) for ring in part.interiors]
    )
    courtyards = [hole for hole in holes if hole.area > 20]
    assert len(courtyards) > 10
    inside = np.array([[p.x, p.y] for p in (hole.representative_point() for hole in courtyards)])
    assert not np.isnan(heights_below(*ground_of(berlin), inside)).any()


def test_the_ground_reaches_four_building_heights_beyond(berlin):
    low, high = berlin.vertices.min(axis=0), berlin.vertices.max(axis=0)
    built = berlin.vertices[np.unique(berlin.triangles[berlin.triangle_surface >= 0])]
    height = built[:, 2].max() - np.median(
        built[np.unique(berlin.triangles[berlin.footprint])][:, 2]
    )
    assert np.all(built.min(axis=0)[:2] - low[:2] > 3.9 * height)
    assert np.all(high[:2] - built.max(axis=0)[:2] > 3.9 * height)


def test_level_feet_stand_on_a_plane():
    scene = build_scene(
        make_city([*box("a", 0, 0, 10, 10, 5, 15), *box("b", 30, 7, 9, 12, 5, 11)]), 50.0, 8.0
    )
    vertices, triangles = ground_of(scene)
    assert vertices[np.unique(triangles)][:, 2] == pytest.approx(0.0, abs=1e-9)
    # The ground is the whole rectangle less the footprints, which are its floors.
    span = np.ptp(vertices[np.unique(triangles)], axis=0)
    assert vectors(vertices, triangles)[:, 2].sum() == pytest.approx(
        span[0] * span[1] - 100 - 108, rel=1e-9
    )


def test_a_passage_stays_open():
    bridge = box("a", 10, 0, 10, 10, 4, 10)
    scene = build_scene(
        make_city([*box("a", 0, 0, 10, 10, 0, 10), *bridge, *box("a", 20, 0, 10, 10, 0, 10)]), 50, 8
    )
    middle = np.array([[0.0, 0.0]])  # the origin of the scene is the middle of the city
    assert heights_below(*ground_of(scene), middle) == pytest.approx(0.0, abs=1e-4)
    assert any("above the ground" in note for note in scene.report.notes)


PODIUM = [*box("a", 0, 0, 40, 40, 0, 6), *box("a", 10, 10, 20, 20, 6, 60)]
# Its lower edges, 3 m up, are 6 m away from both ends of the wall's foot, but 1.5 m from the foot
# itself.
BAY = [*box("a", 0, 0, 12, 10, 0, 12), *box("a", 4, -1.5, 3, 1.5, 3, 6, semantics=False)]
WALLS = box("a", 0, 0, 10, 10, 2, 12, semantics=False)[1:]


@pytest.mark.parametrize(
    "polygons",
    [PODIUM, BAY, WALLS],
    ids=["tower on a podium", "bay above a long wall", "open shell without a floor"],
)
def test_what_begins_higher_up_does_not_lift_the_ground(polygons):
    scene = build_scene(make_city(polygons), 50.0, 8.0)
    vertices, triangles = ground_of(scene)
    assert vertices[np.unique(triangles)][:, 2] == pytest.approx(0.0, abs=1e-9)
    assert scene.footprint.any() == (polygons is not WALLS)
