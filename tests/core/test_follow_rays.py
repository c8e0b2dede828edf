"""Rays from both sides of faces: boxes in closed form."""

from types import SimpleNamespace

import numpy as np

from citypv.core.city.find_sheets import faces_of_scene, follow_rays

BOX = np.array([[x, y, z] for z in (0, 10) for x, y in ((0, 0), (10, 0), (10, 10), (0, 10))], float)
SIDES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]  # their fronts outside
OUTSIDE = np.array([triangle for a, b, c, d in SIDES for triangle in ((a, b, c), (a, c, d))])


def faces_of(vertices, triangles):
    nothing = np.zeros(len(triangles), bool)
    made = {"footprint": nothing, "triangle_surface": np.arange(len(triangles)), "trail": None}
    return faces_of_scene(SimpleNamespace(vertices=vertices, triangles=np.array(triangles), **made))


def test_within_a_box_all_rays_hit_backs_and_none_reaches_the_sky():
    backs, sky = follow_rays(faces_of(BOX, OUTSIDE), np.arange(12), -1, 64)
    np.testing.assert_array_equal(backs, 64)
    np.testing.assert_array_equal(sky, 0)


def test_outside_a_box_without_ground_half_the_rays_of_walls_reach_the_sky():
    backs, sky = follow_rays(faces_of(BOX, OUTSIDE), np.arange(12), 1, 64)
    np.testing.assert_array_equal(backs, 0)
    np.testing.assert_array_equal(sky[:4], [0, 0, 64, 64])  # the bottom, the top
    np.testing.assert_allclose(sky[4:] / 64, 0.5, atol=4 * 0.5 / 8)  # four standard errors of 64 random rays
