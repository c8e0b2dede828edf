"""Rays from faces: boxes in closed form; rays that end where enough reach the sky decide as all of them do."""

from types import SimpleNamespace

import numpy as np
import pytest

from citypv.core.city.follow_rays import Enough, faces_of_scene, follow_rays

BOX = np.array([[x, y, z] for z in (0, 10) for x, y in ((0, 0), (10, 0), (10, 10), (0, 10))], float)
SIDES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]  # their fronts outside
OUTSIDE = np.array([triangle for a, b, c, d in SIDES for triangle in ((a, b, c), (a, c, d))])


def faces_of(vertices, triangles):
    nothing = np.zeros(len(triangles), bool)
    return faces_of_scene(SimpleNamespace(vertices=vertices, triangles=np.array(triangles), footprint=nothing))


def scattered(count=400, seed=5):
    """Triangles of 6 m in a cube of 20 m: many rays meet several of them."""
    generator = np.random.default_rng(seed)
    middles = generator.uniform(0, 20, (count, 1, 3))
    vertices = (middles + generator.normal(size=(count, 3, 3)) * 3).reshape(-1, 3)
    return faces_of(vertices, np.arange(3 * count).reshape(-1, 3))


def test_within_a_box_all_rays_hit_backs_and_none_reaches_the_sky():
    backs, sky = follow_rays(faces_of(BOX, OUTSIDE), np.arange(12), -1, 64)
    np.testing.assert_array_equal(backs, 64)
    np.testing.assert_array_equal(sky, 0)


def test_outside_a_box_without_ground_half_the_rays_of_walls_reach_the_sky():
    backs, sky = follow_rays(faces_of(BOX, OUTSIDE), np.arange(12), 1, 64)
    np.testing.assert_array_equal(backs, 0)
    np.testing.assert_array_equal(sky[:4], [0, 0, 64, 64])  # the bottom, the top
    np.testing.assert_allclose(sky[4:] / 64, 0.5, atol=4 * 0.5 / 8)  # four standard errors of 64 random rays


@pytest.mark.parametrize("least", [0.1, 6.4, 20.0, 30.0])
@pytest.mark.parametrize("side", [-1, 1])
def test_rays_that_end_where_enough_are_known_decide_as_all_of_them_do(side, least):
    faces = scattered()
    rows, owner = np.arange(400), np.arange(400) // 3
    weight = faces.area / np.bincount(owner, faces.area)[owner]
    backs, whole = follow_rays(faces, rows, side, 64)
    same, some = follow_rays(faces, rows, side, 64, enough=Enough(owner, weight, least))
    np.testing.assert_array_equal(same, backs)
    assert (some <= whole).all() and (some < whole).any()
    decided = [np.bincount(owner, weight * sky) >= least for sky in (whole, some)]
    np.testing.assert_array_equal(*decided)
    assert decided[0].any()
