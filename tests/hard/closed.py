"""Boxes from outside and from inside."""

import numpy as np
from scenes import strip


def box(low, high):
    """Six rectangles that face outwards (roof, floor, south, north, east, west), two triangles each."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    dx, dy, dz = [x1 - x0, 0, 0], [0, y1 - y0, 0], [0, 0, z1 - z0]
    return [
        strip([x0, y0, z1], dx, dy, 1),
        strip([x0, y0, z0], dy, dx, 1),
        strip([x0, y0, z0], dx, dz, 1),
        strip([x1, y1, z0], [x0 - x1, 0, 0], dz, 1),
        strip([x1, y0, z0], dy, dz, 1),
        strip([x0, y1, z0], [0, y0 - y1, 0], dz, 1),
    ]


def room(low, high):
    """The same six rectangles, facing inwards."""
    return [(points, np.asarray(faces)[:, ::-1]) for points, faces in box(low, high)]
