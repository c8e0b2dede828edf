"""Delaunay triangulations in plan: empty circumcircles, by Qhull's count and area; the edges they lack, and heights."""

import numpy as np
import pytest
import shapely
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import Delaunay, cKDTree

from citypv.core.city.triangulate_feet import drop_on_triangles, find_hanging, find_missing, triangulate_plan
from citypv.core.settings.errors import InputError

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
    assert (np.bincount(triangles.ravel() // 3, minlength=1200) > 0).all()  # each of the 1,200 is a corner


def test_where_geos_fails_qhull_triangulates_and_what_neither_can_is_refused(monkeypatch):
    def fail(_):
        raise shapely.GEOSException("LocateFailureException: Could not locate vertex.")

    monkeypatch.setattr(shapely, "delaunay_triangles", fail)
    places = scatter(2000) + 500_000
    triangles = triangulate_plan(places)
    assert_delaunay(places - 500_000, triangles)
    assert (twice_areas(places[triangles]) > 0).all()  # as those of GEOS, beside which they may stand
    np.testing.assert_array_equal(np.unique(triangles), np.arange(len(places)))
    with pytest.raises(InputError, match=r"--ground: 9 points .* x 40 m, y 80 m .* --terrain FILE"):
        triangulate_plan(np.outer(np.arange(9), [10.0, 20.0]))


def test_edges_that_are_no_sides_are_missing():
    places = scatter(300)
    triangles = Delaunay(places).simplices
    assert not find_missing(triangles, np.sort(triangles[:, :2], axis=1).astype(np.int64)).any()
    assert find_missing(triangles, np.array([[0, 2], [1, 3]])).all()


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


def test_no_edge_hangs_where_none_is_missing():
    places = np.column_stack([CORNERS, np.zeros(4)])
    assert len(find_hanging(places[triangulate_plan(CORNERS)], places[np.empty((0, 2), int)])) == 0
