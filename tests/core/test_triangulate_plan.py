"""Delaunay triangulations in plan: empty circumcircles, by Qhull's count and area; places added later."""

import numpy as np
import pytest
from scipy.spatial import Delaunay, cKDTree

from citypv.core.ground.triangulate_plan import (
    add_places,
    areas,
    circumscribe,
    find_triangle,
    has_edges,
    near_any,
    triangulate_plan,
)

CORNERS = np.array([[0.0, 0], [1000, 0], [1000, 1000], [0, 1000]])
ROUNDING = 1e-6  # [m] of a circumcircle's radius


def scatter(count, seed=1):
    return np.concatenate([CORNERS, np.random.default_rng(seed).uniform(1, 999, (count, 2))])


def grid():
    """Every four neighbours lie on one circle."""
    x, y = np.meshgrid(np.arange(0.0, 1001, 50), np.arange(0.0, 1001, 50))
    return np.column_stack([x.ravel(), y.ravel()])


def assert_delaunay(places, triangles):
    """The triangles fill the square, and no place lies within the circle around one of them."""
    assert np.isclose(areas(places[triangles]).sum(), 1e6, rtol=1e-12)
    centre, radius = circumscribe(places[triangles])
    assert (cKDTree(places).query(centre)[0] > radius - ROUNDING).all()


@pytest.mark.parametrize("places", [scatter(2000), grid()], ids=["scattered", "grid"])
def test_triangles_are_delaunay(places):
    triangles = triangulate_plan(places)
    assert_delaunay(places, triangles)
    assert len(triangles) == len(Delaunay(places).simplices)
    np.testing.assert_array_equal(np.unique(triangles), np.arange(len(places)))


@pytest.mark.parametrize("count", [1, 40, 800])
@pytest.mark.parametrize("places", [scatter(2000), grid()], ids=["scattered", "grid"])
def test_added_places_leave_them_delaunay(places, count):
    every = np.concatenate([places, np.random.default_rng(2).uniform(1, 999, (count, 2))])
    before = triangulate_plan(places)
    triangles, kept = add_places(every, before, np.arange(len(places), len(every)))
    assert_delaunay(every, triangles)
    assert 0 < kept < len(before) and len(triangles) == len(before) + 2 * count
    known = {tuple(row) for row in np.sort(before, axis=1).tolist()}
    assert known.issuperset(tuple(row) for row in np.sort(triangles[:kept], axis=1).tolist())


def test_places_in_triangles_and_sides():
    places = scatter(300)
    triangulation = Delaunay(places)
    corners, wanted = places[triangulation.simplices], np.random.default_rng(3).uniform(-50, 1050, (500, 2))
    expected = triangulation.find_simplex(wanted)
    np.testing.assert_array_equal(find_triangle(corners, wanted), expected)
    near = near_any(corners, wanted)
    assert near[expected[expected >= 0]].all()
    assert not near_any(corners, np.empty((0, 2))).any()
    assert not near_any(corners, np.array([[2000.0, 2000.0]])).any()
    sides = np.sort(triangulation.simplices[:, :2], axis=1).astype(np.int64)
    assert has_edges(triangulation.simplices, sides).all()
    assert not has_edges(triangulation.simplices, np.array([[0, 2], [1, 3]])).any()
