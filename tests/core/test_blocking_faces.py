"""Shadows of flat faces by as few triangles as they have, against planes and outlines by hand."""

import numpy as np
import pytest

from citypv.core.city.split_edges import refine_triangles
from citypv.core.patches.blocking_faces import merge_pieces
from citypv.core.rays.ray_scene import RayScene

SQUARE = np.array([[0.0, 0, 0], [20, 0, 0], [20, 10, 0], [0, 10, 0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])
# A rotation about no axis of the scene, and a place far from its origin.
TURNED = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
PLACE = np.array([310.0, -520.0, 40.0])


def cut_small(points, triangles=HALVES, size=2.0):
    """Pieces of one surface: vertices and triangles."""
    surface = np.zeros(len(triangles), int)
    return refine_triangles(points, np.asarray(triangles), size, surface)[:2]


def merged(vertices, triangles, surface=0):
    surface = np.broadcast_to(surface, len(triangles))
    return merge_pieces(vertices, triangles, surface, np.full(len(triangles), 5e-4))


@pytest.mark.parametrize(
    ("points", "triangles", "expected"),
    [
        (SQUARE, HALVES, 2),
        (SQUARE[:3], [[0, 1, 2]], 1),
        (SQUARE @ TURNED.T + PLACE, HALVES, 2),
        (SQUARE + np.outer([0, 0, 1, 0], [3, 4, 0]), HALVES, 2),
    ],
    ids=["rectangle", "triangle", "turned", "quadrangle"],
)
def test_what_fills_a_triangle_or_rectangle_is_one(points, triangles, expected):
    vertices, pieces = cut_small(points, triangles)
    assert len(pieces) > 40
    whole = merged(vertices, pieces)
    assert len(whole) == expected
    # Its corners are those of the drawing.
    assert np.unique(whole).tolist() == list(range(len(points)))


@pytest.mark.parametrize(
    ("points", "triangles"),
    [
        (SQUARE * [1, 1, 0] + np.outer([0, 0, 0.01, 0], [0, 0, 1]), HALVES),
        # an L, and a frame around a hole
        (
            [[0, 0, 0], [20, 0, 0], [20, 10, 0], [10, 10, 0], [10, 20, 0], [0, 20, 0]],
            [[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5]],
        ),
        (
            [*SQUARE.tolist(), [5, 4, 0], [15, 4, 0], [15, 6, 0], [5, 6, 0]],
            [[k, (k + 1) % 4, 4 + (k + 1) % 4] for k in range(4)]
            + [[k, 4 + (k + 1) % 4, 4 + k] for k in range(4)],
        ),
    ],
    ids=["bent by a centimetre", "L", "hole"],
)
def test_all_else_stays_as_it_is(points, triangles):
    vertices, pieces = cut_small(np.array(points, float), triangles)
    assert merged(vertices, pieces).tolist() == pieces.tolist()


def test_a_face_with_a_piece_that_is_gone_keeps_its_hole():
    """Edits take pieces away, without area; ground, which has no surface, stays as it is too."""
    vertices, pieces = cut_small(SQUARE)
    gone = pieces.copy()
    gone[7] = gone[7, 0]
    assert merged(vertices, gone).tolist() == np.delete(pieces, 7, axis=0).tolist()
    ground = np.full(len(pieces), -1)
    assert merged(vertices, pieces, ground).tolist() == pieces.tolist()
    both = np.arange(len(pieces)) % 2  # of two surfaces, neither of which fills its outline
    assert len(merged(vertices, pieces, both)) == len(pieces)


def test_a_face_may_be_off_by_less_than_its_rays_are():
    """Bent by 0.1 mm: merged where all its rays start 0.5 mm in front, not where one is nearer."""
    vertices, pieces = cut_small(SQUARE + np.outer([0, 0, 1e-4, 0], [0, 0, 1]))
    offset, surface = np.full(len(pieces), 5e-4), np.zeros(len(pieces), int)
    assert len(merge_pieces(vertices, pieces, surface, offset)) == 2
    offset[5] = 1e-4
    assert len(merge_pieces(vertices, pieces, surface, offset)) == len(pieces)


def test_shadows_are_those_of_the_rectangle():
    """20,000 points under a rectangle in any position, against the plane and its four edges."""
    vertices, pieces = cut_small(SQUARE @ TURNED.T + PLACE)
    tree = RayScene(vertices, merged(vertices, pieces))
    generator = np.random.default_rng(3)
    sun = np.array([0.36, -0.48, 0.8])
    # Points below the plane of the rectangle or above it, in its own axes.
    normal = TURNED @ [0, 0, 1]
    along = sun @ TURNED / (sun @ normal)  # in its axes, per metre of height
    height = -generator.uniform(1, 30, 20_000) * np.sign(sun @ normal)
    foot = generator.uniform([-10, -10], [30, 20], (20_000, 2))
    own = np.column_stack([foot, np.zeros(20_000)]) + height[:, None] * along
    inside = (foot > 0).all(axis=1) & (foot < [20, 10]).all(axis=1)
    near = (np.abs(foot) < 1e-3).any(axis=1) | (np.abs(foot - [20, 10]) < 1e-3).any(axis=1)
    position = (own @ TURNED.T + PLACE).astype(np.float32)
    blocked = tree.trace_blocked(position, sun.astype(np.float32))
    assert (blocked == inside)[~near].all()
    assert 0.1 < inside.mean() < 0.3
