"""Triangles are refined without gaps, each to its own size."""

import numpy as np
import pytest
from scenes import join, strip
from test_triangulate import vectors

from citypv.core.city.split_edges import refine_triangles

HEIGHT, WIDTH, LENGTH = (
    20.0,
    20.0,
    3000.0,
)  # [m] of a wall and of the ground before it, as long as the wall


def wall_and_ground():
    """A wall that looks east over the ground before it: squares, each of one triangle at the wall
    and one away.
    """
    count = round(LENGTH / WIDTH)
    wall = strip([0, 0, 0], [0, 0, HEIGHT], [0, LENGTH, 0], count)
    return join(
        [(wall[0], wall[1][:, ::-1]), strip([0, 0, 0], [WIDTH, 0, 0], [0, LENGTH, 0], count)]
    )


def test_refining_to_own_sizes_leaves_no_gap():
    """Neighbours of what is split are split along the shared edge: every edge has two sides, or
    lies on the rim.
    """
    scene = wall_and_ground()
    size = np.full(len(scene.triangles), 100.0)
    size[[3, 4, 250, 400]] = 1.5, 6.0, 0.7, 3.0
    vertices, triangles, parent = refine_triangles(scene.vertices, scene.triangles, size)
    longest, _, area = measure(vertices, triangles)
    assert (longest <= 1.00001 * size[parent]).all()
    assert np.bincount(parent, area) == pytest.approx(scene.surfaces.area)
    # The rim stays as long as it was: what has one side only is no gap between pieces.
    assert rim_length(vertices, triangles) == pytest.approx(
        rim_length(scene.vertices, scene.triangles)
    )
    untouched = np.bincount(parent) == 1
    assert untouched.mean() > 0.9


def rim_length(vertices, triangles):
    """[m] of edges with one side only."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    single, sides = np.unique(edges, axis=0, return_counts=True)
    single = single[sides == 1]
    return np.linalg.norm(vertices[single[:, 0]] - vertices[single[:, 1]], axis=1).sum()


@pytest.mark.parametrize(
    ("length", "height", "most"), [(1000, 3, 220), (100, 3, 24), (1000, 30, 2700), (60, 15, 72)]
)
def test_long_walls_are_cut_into_near_squares(length, height, most):
    """A wall of 1000 × 3 m was cut into 4,374 patches. A piece of 10 m and its diagonal leave 9.5
    m: 105 pieces.
    """
    scene = join([strip([0, 0, 0], [length, 0, 0], [0, 0, height], 1)])
    vertices, triangles, _ = refine_triangles(
        scene.vertices, scene.triangles, 10.0, np.zeros(2, int)
    )
    assert len(triangles) <= most
    longest, across, area = measure(vertices, triangles)
    assert longest.max() <= 10 * (1 + 1e-5)
    assert area.sum() == pytest.approx(length * height)
    assert np.average(longest / across, weights=area) < 4  # a square cut in two has 2; it was 83
    assert rim_length(vertices, triangles) == pytest.approx(2 * (length + height))


def measure(vertices, triangles):
    """Longest edge [m], height over it [m] and area [m²] of each triangle."""
    corners = vertices[triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    area = np.linalg.norm(vectors(vertices, triangles), axis=1)
    return longest, 2 * area / longest, area


def test_a_long_wall_and_its_neighbours_still_meet_edge_to_edge():
    """A wall of 300 × 3 m between a roof, the ground and two short walls, turned any way: no gap,
    no face turned.
    """
    for angle in (0.0, 0.7):
        turn = np.array(
            [[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
        )
        scene = join([
            strip([0, 0, 0], [300, 0, 0], [0, 0, 3], 1),
            strip([0, 0, 3], [300, 0, 0], [0, 40, 0], 1),
            strip([0, -40, 0], [300, 0, 0], [0, 40, 0], 1),
            strip([300, 0, 0], [0, 40, 0], [0, 0, 3], 1),
            strip([0, 40, 0], [0, -40, 0], [0, 0, 3], 1),
        ])  # fmt: skip
        corners, surface = scene.vertices @ turn, np.repeat(np.arange(5), 2)
        before, triangles = merge(corners, scene.triangles)
        vertices, pieces, parent = refine_triangles(before, triangles, 10.0, surface)
        assert rim_length(vertices, pieces) == pytest.approx(rim_length(before, triangles))
        normal, given = normals(vertices, pieces), normals(before, triangles)
        assert (np.einsum("ij,ij->i", normal, given[parent]) > 0.999).all()
        areas = np.bincount(surface[parent], measure(vertices, pieces)[2])
        assert areas == pytest.approx([900, 12_000, 12_000, 120, 120])
        assert measure(vertices, pieces)[0].max() <= 10 * (1 + 1e-5)


def merge(vertices, triangles):
    places, row = np.unique(np.round(vertices, 6), axis=0, return_inverse=True)
    return places, row.reshape(-1)[triangles]


def normals(vertices, triangles):
    size = vectors(vertices, triangles)
    return size / np.linalg.norm(size, axis=1)[:, None]


@pytest.mark.slow
def test_a_disc_of_short_edges_is_refined():
    """A regular polygon with 150 sides of 4 m, cut into a fan: its long edges are diagonals, none
    lies on the rim.
    """
    angle = 2 * np.pi * np.arange(150) / 150
    vertices = 95.5 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    fan = np.column_stack([np.zeros(148, int), np.arange(1, 149), np.arange(2, 150)])
    finer, pieces, _ = refine_triangles(vertices, fan, 10.0, np.zeros(148, int))
    longest, _, area = measure(finer, pieces)
    assert longest.max() <= 10 * (1 + 1e-5)
    assert area.sum() == pytest.approx(measure(vertices, fan)[2].sum())
    assert len(pieces) < 1.1 * len(refine_triangles(vertices, fan, 10.0)[1])
    assert (normals(finer, pieces)[:, 2] > 0.999).all()


def test_a_bend_inside_a_surface_stays():
    """Diagonals of a surface that is bent are edges of it: none of its points moves out of the two
    halves.
    """
    corners = np.array([[0, 0, 0], [200, 0, 0], [200, 3, 2], [0, 3, 0]], float)
    halves = np.array([[0, 1, 2], [0, 2, 3]])
    vertices, pieces, _ = refine_triangles(corners, halves, 10.0, np.zeros(2, int))
    normal = normals(corners, halves)
    apart = [np.abs((vertices[pieces] - corners[0]) @ n).max(axis=1) for n in normal]
    assert (np.minimum(*apart) < 1e-9).all()
    assert measure(vertices, pieces)[2].sum() == pytest.approx(measure(corners, halves)[2].sum())
