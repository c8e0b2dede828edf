"""Shapes of modules, to be drawn before the faces that carry them."""

import numpy as np


def draw_modules(layout, lift=0.05):
    """Corners of the modules of a ModuleLayout, m of them, counter-clockwise seen from outside:
    (m, 4, 3) float64 [m].

    They stand `lift` [m] before their faces, so that these do not show through.
    """
    normal = np.cross(layout.along, layout.up)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    low = layout.corner + lift * normal / np.maximum(length, np.finfo(float).tiny)
    high = low + layout.up
    return np.stack([low, low + layout.along, high + layout.along, high], axis=1)


def triangulate_modules(count):
    """Triangles of so many modules into their corners, four after the other: (2 m, 3) int64."""
    first = 4 * np.arange(count)[:, None, None]
    return (first + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
