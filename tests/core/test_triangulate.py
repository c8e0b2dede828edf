"""Triangles against areas known in closed form, and laws that every triangulation keeps."""

import time

import numpy as np
import pytest

from citypv.core.city.build_scene import merge_vertices
from citypv.core.city.polygons import measure_polygons, triangulate
from citypv.core.city.site import turn_to_true_north
from citypv.core.city.split_edges import refine_triangles


def stack(*polygons):
    """Points, ring_start, polygon_start of polygons given as lists of rings."""
    rings = [np.asarray(ring, float) for polygon in polygons for ring in polygon]
    starts = np.cumsum([0, *[len(ring) for ring in rings]])
    return np.concatenate(rings), starts, np.cumsum([0, *[len(polygon) for polygon in polygons]])


def vectors(points, triangles):
    """Area vector of each triangle (t, 3)."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return 0.5 * np.cross(b - a, c - a)


def level(*corners, height=0.0):
    return [(x, y, height) for x, y in corners]


SQUARE = level((0, 0), (10, 0), (10, 10), (0, 10))
HOLE = level((2, 2), (2, 5), (5, 5), (5, 2))
L_SHAPE = level((0, 0), (4, 0), (4, 1), (1, 1), (1, 4), (0, 4))
ARROW = level((0, 0), (4, 2), (0, 4), (1, 2))  # a quadrilateral with one diagonal outside
SHAPES = {
    "triangle": ([SQUARE[:3]], 50.0),
    "square": ([SQUARE], 100.0),
    "arrow": ([ARROW], 6.0),
    "l": ([L_SHAPE], 7.0),
    "hole": ([SQUARE, HOLE], 91.0),
    "hole running the same way": ([SQUARE, HOLE[::-1]], 91.0),
    "two holes": ([SQUARE, HOLE, [(x + 4, y + 4, z) for x, y, z in HOLE]], 82.0),
    "hole at the outline": ([SQUARE, level((0, 2), (3, 2), (3, 5))], 95.5),
    "collinear points": ([level((0, 0), (5, 0), (10, 0), (10, 10), (0, 10))], 100.0),
    "collinear quad": ([level((0, 0), (5, 0), (10, 0), (0, 10))], 50.0),
}


@pytest.mark.parametrize("name", SHAPES)
def test_triangles_cover_the_polygon_on_any_plane_and_face_its_way(name):
    rings, expected = SHAPES[name]
    matrix, _ = np.linalg.qr(np.random.default_rng(len(name)).normal(size=(3, 3)))
    matrix *= np.sign(np.linalg.det(matrix))
    points, ring_start, polygon_start = stack(
        [np.array(ring) @ matrix.T + [391_000, 5_817_000, 40] for ring in rings]
    )
    area, normal = measure_polygons(points, ring_start, polygon_start)
    assert area == pytest.approx([expected], rel=1e-6)
    assert normal[0] == pytest.approx(matrix[:, 2], abs=1e-6)
    triangles, owner = triangulate(points, ring_start, polygon_start)
    parts = vectors(points, triangles)
    assert np.all(owner == 0)
    assert (parts @ normal[0]).sum() == pytest.approx(expected, rel=1e-6)
    assert (parts @ normal[0]).min() > 1e-6  # none turned over, none without area


def test_many_polygons_keep_their_order_and_their_triangles():
    polygons = [SHAPES[name][0] for name in SHAPES] * 3
    points, ring_start, polygon_start = stack(*polygons)
    triangles, owner = triangulate(points, ring_start, polygon_start)
    assert np.all(np.diff(owner) >= 0)
    covered = np.bincount(owner, np.linalg.norm(vectors(points, triangles), axis=1))
    assert covered == pytest.approx([SHAPES[name][1] for name in SHAPES] * 3)
    first = ring_start[polygon_start[owner]]
    last = ring_start[polygon_start[owner + 1]]
    assert np.all((triangles >= first[:, None]) & (triangles < last[:, None]))


def test_merging_makes_a_cube_closed():
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    points, ring_start, polygon_start = stack(*[[corners[list(face)]] for face in faces])
    triangles, _ = triangulate(points, ring_start, polygon_start)
    vertices, triangles = merge_vertices(points, triangles)
    assert len(vertices) == 8
    volume = np.einsum("ij,ij->", vertices[triangles[:, 0]], vectors(vertices, triangles)) / 3
    assert volume == pytest.approx(1.0)
    assert_closed(triangles)
    finer, pieces, parent = refine_triangles(vertices, triangles, 0.3)
    assert_closed(pieces)
    assert np.linalg.norm(vectors(finer, pieces), axis=1).sum() == pytest.approx(6.0)
    assert np.bincount(parent, minlength=12).min() > 1


def assert_closed(triangles):
    """Every edge is run through once in each direction: no gap and no vertex on a
    neighbour's edge.
    """
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    directed = {tuple(edge) for edge in edges.tolist()}
    assert len(directed) == len(edges)
    assert {edge[::-1] for edge in directed} == directed


def test_turning_by_the_convergence_moves_grid_north_to_its_azimuth():
    north = turn_to_true_north(np.array([[0.0, 1.0, 5.0]]), 30.0)[0]
    assert np.degrees(np.arctan2(north[0], north[1])) == pytest.approx(
        30.0
    )  # clockwise from true north
    assert north[2] == 5.0


def circle(count, radius):
    """A regular polygon on a slope."""
    angle = 2 * np.pi * np.arange(count) / count
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    return np.column_stack([x, y, 0.75 * x])


def test_a_ring_of_many_corners_takes_hardly_more_than_its_share_of_time():
    """Four times the corners take less than eight times as long; with the square of corners it
    would be sixteen.
    """

    def least_time(count):
        times = []
        for _ in range(3):
            start = time.process_time()
            triangulate(circle(count, 50.0), np.array([0, count]), np.array([0, 1]))
            times.append(time.process_time() - start)
        return min(times)

    assert least_time(10_000) < 8 * least_time(2_500)


def test_a_ring_of_many_corners_is_covered_once():
    """A regular polygon of 2,000 corners with a hole of 700 on a slope: areas n/2 · r² ·
    sin(2π/n).
    """
    points = np.concatenate([circle(2000, 50.0), circle(700, 20.0)[::-1]])
    triangles, owner = triangulate(points, np.array([0, 2000, 2700]), np.array([0, 2]))
    normal = 0.5 * np.cross(*(points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2)))
    flat = 1000 * 50.0**2 * np.sin(np.pi / 1000) - 350 * 20.0**2 * np.sin(np.pi / 350)
    assert normal[:, 2].min() > 0 and normal[:, 2].sum() == pytest.approx(flat, rel=1e-9)
    assert len(triangles) == 2700 and not owner.any()  # n + 2 h - 2 with h holes
