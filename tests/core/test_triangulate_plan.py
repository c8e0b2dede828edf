"""Delaunay triangulations in plan: empty circumcircles, by Qhull's count and area; the edges they
lack, and heights.
"""

import numpy as np
import pytest
import shapely
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import Delaunay, cKDTree

from citypv.core.city.plan_geometry import merge_places
from citypv.core.city.slope_filter import find_standing
from citypv.core.city.triangulate_feet import drop_on_triangles, triangulate_plan
from citypv.core.settings.errors import InputError
from citypv.core.settings.tolerances import GEOMETRY

CORNERS = np.array([[0.0, 0], [1000, 0], [1000, 1000], [0, 1000]])
ROUNDING = 1e-6  # [m] of a circumcircle's radius


def scatter(count, seed=1):
    return np.concatenate([CORNERS, np.random.default_rng(seed).uniform(1, 999, (count, 2))])


def grid():
    """Every four neighbours lie on one circle."""
    x, y = np.meshgrid(np.arange(0.0, 1001, 50), np.arange(0.0, 1001, 50))
    return np.column_stack([x.ravel(), y.ravel()])


def twice_areas(corners):
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]


def circumscribe(corners):
    """Centres, equally far from all corners, and radii of the circles through triangles."""
    squares = (corners**2).sum(axis=2)
    sides = 2 * (corners[:, 1:] - corners[:, :1])
    centre = np.linalg.solve(sides, (squares[:, 1:] - squares[:, :1])[..., None])[..., 0]
    return centre, np.linalg.norm(centre - corners[:, 0], axis=1)


def assert_delaunay(places, triangles):
    """The triangles fill the square, and no place lies within the circle around one of them."""
    assert np.isclose(np.abs(twice_areas(places[triangles])).sum(), 2e6, rtol=1e-12)
    centre, radius = circumscribe(places[triangles])
    assert (cKDTree(places).query(centre)[0] > radius - ROUNDING).all()


@pytest.mark.parametrize("places", [scatter(2000), grid()], ids=["scattered", "grid"])
def test_triangles_are_delaunay(places):
    triangles = triangulate_plan(places)
    assert_delaunay(places, triangles)
    assert len(triangles) == len(Delaunay(places).simplices)
    np.testing.assert_array_equal(np.unique(triangles), np.arange(len(places)))


def threefold(seed):
    """Three places in each of 1,200, with rounding between them: GEOS 3.14 fails for this seed."""
    generator = np.random.default_rng(seed)
    places = np.repeat(generator.uniform(0, 1000, (1200, 2)), 3, axis=0)
    return places + generator.normal(size=places.shape) * 1e-12 + 114


def test_places_among_which_geos_loses_its_way_are_triangulated():
    places = threefold(17)
    triangles = triangulate_plan(places)
    area = shapely.convex_hull(shapely.multipoints(places)).area
    assert np.isclose(twice_areas(places[triangles]).sum(), 2 * area, rtol=1e-9)
    assert (
        np.bincount(triangles.ravel() // 3, minlength=1200) > 0
    ).all()  # each of the 1,200 is a corner


def test_where_geos_fails_qhull_triangulates_and_what_neither_can_is_refused(monkeypatch):
    def fail(_):
        raise shapely.GEOSException("LocateFailureException: Could not locate vertex.")

    monkeypatch.setattr(shapely, "delaunay_triangles", fail)
    places = scatter(2000) + 500_000
    triangles = triangulate_plan(places)
    assert_delaunay(places - 500_000, triangles)
    assert (
        twice_areas(places[triangles]) > 0
    ).all()  # as those of GEOS, beside which they may stand
    np.testing.assert_array_equal(np.unique(triangles), np.arange(len(places)))
    with pytest.raises(InputError, match=r"--ground: 9 points .* x 40 m, y 80 m .* --terrain FILE"):
        triangulate_plan(np.outer(np.arange(9), [10.0, 20.0]))


def test_heights_are_linear_in_triangles_and_infinite_beyond():
    places = scatter(300)
    height = np.random.default_rng(4).uniform(0, 50, len(places))
    triangulation, wanted = Delaunay(places), np.random.default_rng(3).uniform(-50, 1050, (500, 2))
    corners = np.column_stack([places, height])[triangulation.simplices]
    expected = LinearNDInterpolator(triangulation, height)(wanted)
    found = drop_on_triangles(corners, wanted)
    assert np.array_equal(np.isinf(found), np.isnan(expected))
    assert found[np.isfinite(found)] == pytest.approx(expected[np.isfinite(found)], abs=1e-9)
    assert len(drop_on_triangles(corners, np.empty((0, 2)))) == 0


# -- places in boxes, and feet that hang, as comparing each with each finds them --


@pytest.mark.parametrize("slope", [0.1, 0.5])
def test_feet_on_a_hill_hang_as_each_compared_with_each_says(slope):
    """Feet on a cone, some of them raised; so few that all are compared as neighbours."""
    random = np.random.default_rng(2)
    start = np.column_stack([random.uniform(0, 60, (30, 2)), np.zeros(30)])
    start[:, 2] = 0.15 * np.hypot(*start[:, :2].T) + random.choice([0.0, 1.0, 4.0, 12.0], 30)
    end = start + np.column_stack([random.uniform(-6, 6, (30, 2)), np.zeros(30)])
    step, slopes = random.choice([0.5, 2.5, 6.0], 30), np.full(30, slope)
    hangs = np.zeros(30, bool)
    for ends in (start, end):
        away = np.linalg.norm(ends[:, None, :2] - start[None, :, :2], axis=2)
        above_feet = (ends[:, None, 2] - start[None, :, 2] > step[:, None] + slope * away).any(
            axis=1
        )
        pairs = np.indices((30, 30)).reshape(2, -1)
        along = (end - start)[pairs[1]]
        share = ((ends[pairs[0]] - start[pairs[1]])[:, :2] * along[:, :2]).sum(axis=1) / (
            along[:, :2] ** 2
        ).sum(axis=1)
        foot = start[pairs[1]] + np.clip(share, 0, 1)[:, None] * along
        away = np.linalg.norm((ends[pairs[0]] - foot)[:, :2], axis=1)
        rise = ends[pairs[0], 2] - foot[:, 2] > step[pairs[0]] + slope * away + GEOMETRY.accuracy
        hangs |= above_feet | ((away <= 10.0) & rise).reshape(30, 30).any(axis=1)
    assert 5 < hangs.sum() < 28
    np.testing.assert_array_equal(find_standing(start, end, step, slopes), ~hangs)


# -- feet at one place in plan view, also where rounding puts them into two cells --


def test_corners_in_half_centimetres_are_each_one_place():
    """Copies of a grid whose lines all lie on borders, moved by rounding: as many places as the
    grid has.
    """
    lines = (np.arange(30) + 0.5) * GEOMETRY.accuracy * 7
    grid = np.stack(np.meshgrid(lines, lines), axis=-1).reshape(-1, 2)
    moved = np.concatenate(
        [(grid + shift) - shift for shift in (0.0, 100.1, 12345.6, -9876.5, 0.3)]
    )
    lowest, place = merge_places(np.column_stack([moved, np.zeros(len(moved))]))
    assert len(np.unique(moved, axis=0)) > len(grid)  # rounding did move them
    assert len(lowest) == len(grid)
    assert (place.reshape(5, -1) == place[: len(grid)]).all()


def test_places_that_differ_stay_apart_in_their_order():
    points = np.array(
        [[0.02, 0.0, 5.0], [0.0, 0.0, 4.0], [0.0, 0.0, 3.0], [0.011, 0.0, 2.0], [-1.0, 9.0, 0.0]]
    )
    lowest, place = merge_places(points)
    assert lowest.tolist() == [4, 2, 3, 0]
    assert place.tolist() == [3, 1, 1, 2, 0]
