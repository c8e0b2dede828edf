"""The scene: local origin, true north, patches, flags, cells."""

from pathlib import Path

import numpy as np
import pytest
from cities import box, make_city
from test_triangulate import vectors

from citypv.core.city.build_scene import SceneOptions, build_scene
from citypv.core.city.grid_cells import split_into_cells
from citypv.core.city.polygons import measure_polygons
from citypv.core.read.read_city import read_city
from citypv.core.settings.errors import InputError

ROOT = Path(__file__).parents[2]
HANNOVER = ROOT / "tests" / "data" / "citygml" / "hannover_LGLN_LoD2_32_550_5802_3bld.gml"
PLATEAU = ROOT / "tests" / "data" / "citygml" / "plateau_yokosuka_52397519_bldg.gml.gz"


@pytest.fixture(scope="module")
def hannover():
    return build_scene(read_city(HANNOVER))


def test_origin_is_the_middle_of_the_points_at_their_lowest_height(hannover):
    city = read_city(HANNOVER)
    low, high = city.points.min(axis=0), city.points.max(axis=0)
    assert hannover.site.origin == pytest.approx((*(0.5 * (low + high))[:2], low[2]))
    assert hannover.site.altitude == pytest.approx(54.156)
    assert (hannover.site.latitude, hannover.site.longitude) == pytest.approx((52.3737, 9.7431), abs=1e-3)
    assert np.abs(hannover.vertices).max() < 1000  # small numbers keep their digits in single precision


def test_azimuths_are_from_true_north(hannover):
    city = read_city(HANNOVER)
    _, normal = measure_polygons(city.points, city.ring_start, city.polygon_start)
    walls = hannover.surfaces.kind == "facade"
    on_grid = np.degrees(np.arctan2(normal[:, 0], normal[:, 1]))[walls]
    turned = (hannover.surfaces.surface_azimuth[walls] - on_grid + 180) % 360 - 180
    assert turned == pytest.approx(hannover.site.convergence, abs=1e-3)
    assert hannover.site.convergence > 0.5


def test_patches_are_small_and_cover_their_surfaces(hannover):
    own, size = hannover.triangle_surface >= 0, vectors(hannover.vertices, hannover.triangles)
    covered = np.bincount(hannover.triangle_surface[own], np.linalg.norm(size[own], axis=1), len(hannover.surfaces))
    assert covered == pytest.approx(hannover.surfaces.area, rel=1e-4, abs=1e-3)
    edges = hannover.triangles[own][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    span = hannover.vertices[edges[:, 0]] - hannover.vertices[edges[:, 1]]
    assert np.linalg.norm(span, axis=1).max() <= 10.0001
    whole = build_scene(read_city(HANNOVER), ground="none", patch_size=None)
    assert len(whole.triangles) < own.sum()


def test_triangles_face_as_their_surfaces(hannover):
    own = hannover.triangle_surface >= 0
    facing = vectors(hannover.vertices, hannover.triangles[own])
    along = np.einsum("ij,ij->i", facing, hannover.surfaces.normal[hannover.triangle_surface[own]])
    assert along.min() > 0.99 * np.linalg.norm(facing, axis=1)[np.argmin(along)]


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
    """0, 0 of the Dutch grid is in France; where the user gives the place, there is nothing to say."""
    city = make_city(box("a", 0, 0, 10, 10, 0, 9), crs="EPSG:28992")
    (note,) = build_scene(city).report.notes
    assert "lies 2.8° outside the area of use of EPSG:28992" in note and "--latitude" in note
    assert not build_scene(city, latitude=52.0, longitude=5.0).report.notes
    assert not city.report.notes


def test_cells_are_rows_of_their_polygon():
    city = make_city(box("a", 0, 0, 10, 20, 0, 6))
    cells, parent = split_into_cells(city, 5.0)
    counts = np.bincount(parent)
    assert counts.tolist() == [8, 8, 4, 8, 4, 8]  # 10 x 20 m, and walls of 20 and 10 by 6 m in rows of 5 and 1 m
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


def test_a_cell_is_eligible_where_its_polygon_is():
    scene = build_scene(
        make_city(box("a", 0, 0, 10, 10, 0, 6)), 50.0, 8.0, ground="none", options=SceneOptions(grid_size=2.0)
    )
    facades = scene.surfaces.kind == "facade"
    assert scene.surfaces.area[facades].max() < 6.25
    assert scene.surfaces.eligible[facades].all()
    assert scene.surfaces.area[facades].sum() == pytest.approx(240.0)
