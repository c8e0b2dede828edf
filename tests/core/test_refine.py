"""Triangles are refined without gaps, each to its own size."""

import numpy as np
import pytest
from scenes import join, strip

from citypv.core.errors import InputError
from citypv.core.scene.refine import refine_triangles

HEIGHT, WIDTH, LENGTH = 20.0, 20.0, 3000.0  # [m] of a wall and of the ground before it, as long as the wall


def wall_and_ground():
    """A wall that looks east over the ground before it: squares, each of one triangle at the wall and one away."""
    count = round(LENGTH / WIDTH)
    wall = strip([0, 0, 0], [0, 0, HEIGHT], [0, LENGTH, 0], count)
    return join([(wall[0], wall[1][:, ::-1]), strip([0, 0, 0], [WIDTH, 0, 0], [0, LENGTH, 0], count)])


def test_refining_to_own_sizes_leaves_no_gap():
    """Neighbours of what is split are split along the shared edge: every edge has two sides, or lies on the rim."""
    scene = wall_and_ground()
    size = np.full(len(scene.triangles), 100.0)
    size[[3, 4, 250, 400]] = 1.5, 6.0, 0.7, 3.0
    vertices, triangles, parent = refine_triangles(scene.vertices, scene.triangles, size)
    corners = vertices[triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    assert (longest <= 1.00001 * size[parent]).all()
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert np.bincount(parent, area) == pytest.approx(scene.surfaces.area)
    # The rim stays as long as it was: what has one side only is no gap between pieces.
    assert rim_length(vertices, triangles) == pytest.approx(rim_length(scene.vertices, scene.triangles))
    untouched = np.bincount(parent) == 1
    assert untouched.mean() > 0.9


def rim_length(vertices, triangles):
    """[m] of edges with one side only."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    single, sides = np.unique(edges, axis=0, return_counts=True)
    single = single[sides == 1]
    return np.linalg.norm(vertices[single[:, 0]] - vertices[single[:, 1]], axis=1).sum()


def test_one_size_for_all_is_the_size_of_each():
    scene = wall_and_ground()
    one, each = (
        refine_triangles(scene.vertices, scene.triangles, size) for size in (7.0, np.full(len(scene.triangles), 7.0))
    )
    for a, b in zip(one, each, strict=True):
        assert np.array_equal(a, b)


@pytest.mark.parametrize("size", [0.0, -1.0, np.nan])
def test_sizes_that_are_none_are_refused(size):
    scene = wall_and_ground()
    with pytest.raises(InputError, match="patch_size: row 2"):
        refine_triangles(scene.vertices, scene.triangles, np.where(np.arange(len(scene.triangles)) == 2, size, 5.0))
