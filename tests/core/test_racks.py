"""Racks on flat roofs: where rows stand, and what --racks means."""

import numpy as np
import pytest
from cities import box, make_city
from flat_roofs import fronts_in, rectangle, roof, rows_of, scene_with
from test_triangulate import vectors

from citypv.core.city.place_rows import THICKNESS
from citypv.core.city.racks import Racks, drawn_city, parse_racks
from citypv.core.run.study import make_scene
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request

# -- geometry --


def test_rows_of_a_rectangle():
    scene = scene_with("tilt=10,spacing=1.5", rectangle(20, 10))
    # Inside the rim 19 × 9 m remain; a row is cos 10° deep: floor((9 - 0.985) / 1.5) + 1 rows.
    rows, surfaces = rows_of(scene), scene.surfaces
    assert len(rows) == 6 and len(surfaces) == 7
    np.testing.assert_allclose(surfaces.area[rows], 19.0, atol=1e-4)
    np.testing.assert_allclose(surfaces.surface_tilt[rows], 10.0, atol=1e-3)
    np.testing.assert_allclose(surfaces.surface_azimuth[rows], 180.0, atol=1e-3)
    assert set(surfaces.orientation[rows]) == {"south"} and surfaces.eligible[rows].all()
    assert surfaces.surface_id[1:] == [f"s0/rack{k}" for k in range(1, 7)]
    assert set(surfaces.building_id) == {"b"}
    fronts = fronts_in(scene)
    low, high = fronts.min(axis=(0, 1)), fronts.max(axis=(0, 1))
    np.testing.assert_allclose([low[0], high[0]], [0.5, 19.5], atol=1e-5)
    assert low[1] >= 0.5 - 1e-5 and high[1] <= 9.5 + 1e-5
    np.testing.assert_allclose([low[2], high[2]], [10.1, 10.1 + np.sin(np.radians(10))], atol=1e-5)
    assert np.diff(fronts[:, 0, 1]) == pytest.approx(1.5, abs=1e-5)


def test_the_roof_itself_is_untouched():
    plain, racked = scene_with(None, rectangle(20, 10)), scene_with("tilt=10", rectangle(20, 10))
    count = len(plain.triangles)
    for name in ("triangles", "triangle_surface", "footprint", "closure"):
        np.testing.assert_array_equal(getattr(racked, name)[:count], getattr(plain, name))
    assert racked.surfaces.kind[0] == "flat" and racked.surfaces.area[0] == plain.surfaces.area[0]
    assert plain.racks is None and (plain.surface_of_triangle == plain.triangle_surface).all()


def test_slabs_are_closed_and_as_thick_as_modules():
    scene = scene_with("tilt=25,azimuth=160", rectangle(40, 12), patch_size=3.0)
    for row in rows_of(scene):
        own = scene.triangles[scene.surface_of_triangle == row]
        edges = np.concatenate([own[:, [0, 1]], own[:, [1, 2]], own[:, [2, 0]]])
        assert {tuple(edge) for edge in edges} == {tuple(edge[::-1]) for edge in edges}
        first, size = scene.vertices[own[:, 0]], vectors(scene.vertices, own)
        volume = np.einsum("ij,ij->", first - first[0], size) / 3
        assert volume == pytest.approx(THICKNESS * scene.surfaces.area[row], rel=1e-4)
        front = scene.triangle_surface[scene.surface_of_triangle == row] == row
        assert np.linalg.norm(size[front], axis=1).sum() == pytest.approx(
            scene.surfaces.area[row], rel=1e-4
        )


def test_holes_and_concave_outlines_are_left_free():
    hole = [(18, 4), (18, 8), (22, 8), (22, 4)]
    scene = scene_with("tilt=10,spacing=1.2,rim=1", rectangle(40, 12, holes=[hole]))
    seen = fronts_in(scene)[..., :2]
    beside = (seen[:, :, 1].max(axis=1) > 3.01) & (seen[:, :, 1].min(axis=1) < 8.99)
    assert beside.any() and (~beside).any()
    left, right = seen[beside, :, 0].min(axis=1), seen[beside, :, 0].max(axis=1)
    assert ((right <= 17 + 1e-5) | (left >= 23 - 1e-5)).all() and len(left) % 2 == 0
    whole = seen[~beside, :, 0]
    np.testing.assert_allclose(whole.min(axis=1), 1, atol=1e-5)
    np.testing.assert_allclose(whole.max(axis=1), 39, atol=1e-5)
    angle = roof((0, 0), (30, 0), (30, 8), (10, 8), (10, 20), (0, 20))
    seen = fronts_in(scene_with("tilt=10,spacing=1.2", angle))[..., :2]
    north = seen[:, :, 1].max(axis=1) > 7.5
    assert (
        north.any()
        and (seen[north, :, 0] <= 9.5 + 1e-5).all()
        and (seen[~north, :, 0].max(axis=1) > 29).all()
    )


def test_what_rises_above_a_roof_is_left_free():
    below = box("a", 0, 0, 30, 20, 0, 10)
    penthouse, tower = box("a", 10, 5, 8, 8, 10, 13), box("c", 30, 0, 5, 20, 0, 40)
    lower = box("d", -5, 0, 5, 20, 0, 9)
    parapet = [("a", "WallSurface", [[(0, 0, 10), (30, 0, 10), (30, 0, 11), (0, 0, 11)]])]
    everything = [*below, *penthouse, *tower, *lower, *parapet]
    scene = scene_with("tilt=10,spacing=1.3,rim=0.8", everything)
    names = np.array(scene.surfaces.surface_id)[rows_of(scene)]
    seen = fronts_in(scene)[np.char.startswith(names, "s5/")][..., :2]
    low, high = seen.min(axis=1), seen.max(axis=1)
    assert (low[:, 1] >= 0.8 - 1e-5).all() and (high[:, 0] <= 29.2 + 1e-5).all()
    beside = (high[:, 1] > 5.0) & (low[:, 1] < 13.0)
    assert (
        beside.any() and ((high[beside, 0] <= 9.2 + 1e-5) | (low[beside, 0] >= 18.8 - 1e-5)).all()
    )
    # On the penthouse and the tower nothing rises; the narrow, lower roof lies free but for the
    # wall beside it.
    assert {name.split("/")[0] for name in names} >= {"s5", "s11", "s17", "s23"}
    assert fronts_in(scene)[np.char.startswith(names, "s23/")][..., 0].max() <= -0.8 + 1e-5


@pytest.mark.slow
def test_covered_and_pitched_roofs_small_ones_and_ground_bear_none():
    pitched = [("b", "RoofSurface", [[(0, 0, 5), (20, 0, 5), (20, 10, 8), (0, 10, 8)]])]  # 16.7°
    assert not len(rows_of(scene_with("tilt=10", pitched)))
    for words, depth, bears in (
        ("tilt=10", 3.9, False),
        ("tilt=10", 4.1, True),
        ("tilt=10,area=10", 3.9, True),
    ):
        assert bool(len(rows_of(scene_with(words, rectangle(5, depth))))) == bears
    covered = [*rectangle(20, 10), *rectangle(20, 10, height=14.0)]
    once, twice = (scene_with("tilt=10", rectangle(20, 10) * count) for count in (1, 2))
    assert len(rows_of(once)) == len(rows_of(twice)) > 0  # drawn twice
    names = scene_with("tilt=10", covered).surfaces.surface_id
    assert all(name.startswith("s1/") for name in names[2:]) and len(names) > 4
    meadow = [
        ("m", "", [[(-50, -50, 0), (70, -50, 0), (70, 60, 0), (-50, 60, 0)]]),
        *box("a", 0, 0, 20, 10, 0, 9),
    ]
    assert all(
        name.startswith("s6/") for name in scene_with("tilt=10", meadow).surfaces.surface_id[7:]
    )


@pytest.mark.parametrize("latitude", [52.5, -33.4, 5.0])
def test_the_default_spacing_keeps_noon_of_the_winter_solstice_free(latitude):
    scene = scene_with("tilt=30", rectangle(20, 40), latitude=latitude)
    fronts = scene.racks
    azimuth = 180.0 if latitude > 0 else 0.0
    np.testing.assert_allclose(
        scene.surfaces.surface_azimuth[rows_of(scene)] % 360, azimuth, atol=1e-3
    )
    along = np.abs(np.diff(fronts[:, 0, 1]))[0] - np.cos(np.radians(30))
    elevation = 90 - abs(latitude) - 23.44
    assert along == pytest.approx(0.5 / np.tan(np.radians(elevation)), rel=2e-4)


def test_rows_follow_a_roof_that_leans():
    slope = np.tan(np.radians(5.0))
    leaning = [
        (
            "b",
            "RoofSurface",
            [[(0, 0, 9), (20, 0, 9), (20, 12, 9 + 12 * slope), (0, 12, 9 + 12 * slope)]],
        )
    ]
    scene = scene_with("tilt=10,spacing=1.5", leaning)
    rows = rows_of(scene)
    np.testing.assert_allclose(scene.surfaces.surface_tilt[rows], 15.0, atol=1e-3)
    height = fronts_in(scene)[:, 0, 2] - 9 - slope * fronts_in(scene)[:, 0, 1]
    np.testing.assert_allclose(height, 0.1 / np.cos(np.radians(5)), atol=1e-4)


def test_cells_of_a_grid_leave_the_rows_whole():
    plain, cut = (scene_with("tilt=10", rectangle(20, 10), grid_size=size) for size in (None, 4.0))
    np.testing.assert_array_equal(plain.racks, cut.racks)
    assert (
        cut.surfaces.surface_id[0] == "s0#1"
        and cut.surfaces.surface_id[-1] == plain.surfaces.surface_id[-1]
    )


def test_a_city_with_its_racks_has_a_polygon_for_each_surface():
    city = make_city([*rectangle(20, 10)], crs="EPSG:25833")
    city.points += [390_000.0, 5_818_000.0, 30.0]
    scene = make_scene(city, Request(racks="tilt=10", ground="none"))
    drawn = drawn_city(city, scene, None)
    assert drawn.surface_id == scene.surfaces.surface_id
    fronts = drawn.points[len(city.points) :].reshape(-1, 4, 3) - [390_000.0, 5_818_000.0, 30.0]
    assert (
        fronts[..., :2].min() > 0.49
        and fronts[..., 0].max() < 19.51
        and fronts[..., 1].max() < 9.51
    )


# -- the words of --racks --


def test_words_of_the_option():
    assert parse_racks(None) is None and parse_racks("none") is None and parse_racks("") is None
    assert parse_racks("east-west") == Racks(east_west=True)
    expected = Racks(False, 12, 170, gcr=0.5, back_albedo=0.3)
    assert parse_racks(" tilt=12 , azimuth=170,gcr=0.5, back-albedo=.3") == expected


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("lean=10", "'lean' is not known; give east-west, or KEY=VALUE with tilt"),
        ("tilt", "tilt= is no number in its range"),
        ("tilt=steep", "tilt=steep is no number in its range; give a number from 0 to 60 \\[°\\]"),
        ("tilt=61", "tilt=61 is no number in its range"),
        ("tilt=nan", "tilt=nan is no number in its range"),
        ("tilt=10,tilt=12", "tilt is given twice"),
        ("spacing=2,gcr=0.5", "spacing and gcr are both given"),
        ("tilt=10,", "'' is not known"),
    ],
)
def test_words_that_mean_nothing(words, told):
    with pytest.raises(InputError, match=f"--racks: {told}"):
        parse_racks(words)


@pytest.mark.parametrize("words", ["tilt=10,spacing=0.9", "east-west,spacing=1.9", "gcr=1"])
def test_rows_without_room_are_refused(words):
    with pytest.raises(
        InputError,
        match=r"--racks: .* leaves no room; rows of this depth .* at least [12].[0-9]+ m",
    ):
        scene_with(words, rectangle(20, 10))
