"""Boxes around what an edit changes, by which rays and suns that it may reach are found."""

import numpy as np


def touch_boxes(scene, boxes, within):
    """Triangles with area whose box meets any of some boxes, wider by a distance [m]: (t,) bool."""
    a, b, c = scene.triangles.T
    corners = np.asarray(scene.vertices, float)[scene.triangles]
    low, high = corners.min(axis=1) - within, corners.max(axis=1) + within
    touched = np.zeros(len(corners), bool)
    for box in boxes:
        touched |= ((low <= box[1]) & (high >= box[0])).all(axis=1)
    return touched & (a != b) & (b != c)


def boxes_around(corners, side=10.0):
    """Boxes around triangles, (k, 3, 3): those in each square of `side` metres of the plan, the
    nearest joined until there are few.

    Returns
    -------
    (b, 2, 3) float64 [m]
        At most 16; none without triangles.
    """
    if not len(corners):
        return np.zeros((0, 2, 3))
    # One box around the triangles of each square of the plan, by their middles.
    square = np.floor(corners.mean(axis=1)[:, :2] / side)
    group = np.unique(square, axis=0, return_inverse=True)[1].ravel()
    while group.max() >= 1 << 8:  # larger squares, until 256 at most hold any
        side, square = 2 * side, np.floor(square / 2)
        group = np.unique(square, axis=0, return_inverse=True)[1].ravel()
    order = np.argsort(group, kind="stable")
    first = np.flatnonzero(np.diff(group[order], prepend=-1))
    low = np.minimum.reduceat(corners.min(axis=1)[order], first)
    high = np.maximum.reduceat(corners.max(axis=1)[order], first)
    boxes = np.stack([low, high], axis=1)
    # Rays meet a box in proportion to its surface: two are joined where the joint box has no more
    # surface than both, or many are left.
    while len(boxes) > 1:
        joint = _surface_of(
            np.maximum(boxes[:, None, 1], boxes[:, 1]) - np.minimum(boxes[:, None, 0], boxes[:, 0])
        )
        own = _surface_of(boxes[:, 1] - boxes[:, 0])
        more = joint - own - own[:, None]
        np.fill_diagonal(more, np.inf)
        one, other = np.unravel_index(more.argmin(), more.shape)
        # At most 16 boxes stand around what has changed.
        if more[one, other] > 0 and len(boxes) <= 16:
            break
        both = np.stack([boxes[[one, other], 0].min(axis=0), boxes[[one, other], 1].max(axis=0)])
        boxes = np.concatenate([np.delete(boxes, [one, other], axis=0), both[None]])
    return boxes


def _surface_of(sides):
    """Half of the surface of boxes, from their sides, (..., 3) [m]."""
    x, y, z = np.moveaxis(sides, -1, 0)
    return x * y + y * z + z * x
