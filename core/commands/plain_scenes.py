"""Scenes of a few rectangles with closed-form solutions."""

import numpy as np

from ..city.classify import classify, measure_tilt
from ..city.scene import Scene, Surfaces
from ..city.site import Site


def rectangle(start, along, across, strips=1):
    """A rectangle cut into strips across, two triangles each.

    Parameters
    ----------
    start, along, across : (3,) float [m]
        A corner and the two edges; the normal is along × across.
    strips : int

    Returns
    -------
    points : (2 · strips + 2, 3) float64 [m]
    triangles : (2 · strips, 3) int64
    """
    start, along, across = (np.asarray(vector, float) for vector in (start, along, across))
    steps = np.linspace(0, 1, strips + 1)[:, None] * across
    low = np.arange(strips)
    far = low + strips + 1
    halves = [np.stack([low, far, far + 1], axis=1), np.stack([low, far + 1, low + 1], axis=1)]
    return np.concatenate([start + steps, start + along + steps]), np.concatenate(halves)


def box(low, high):
    """Six rectangles facing outwards: roof, floor, south, north, east, west."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    east, north, up = [x1 - x0, 0, 0], [0, y1 - y0, 0], [0, 0, z1 - z0]
    return [
        rectangle([x0, y0, z1], east, north),
        rectangle([x0, y0, z0], north, east),
        rectangle([x0, y0, z0], east, up),
        rectangle([x1, y1, z0], [x0 - x1, 0, 0], up),
        rectangle([x1, y0, z0], north, up),
        rectangle([x0, y1, z0], [0, y0 - y1, 0], up),
    ]


def room(low, high):
    """Six rectangles of a box that face inwards."""
    return [(points, triangles[:, ::-1]) for points, triangles in box(low, high)]


def join_parts(parts, turn=None, away=(0, 0, 0)):
    """One scene from parts of points and triangles; each triangle is a surface.

    Parameters
    ----------
    parts : list of tuple
        Of (k, 3) points and (m, 3) triangles.
    turn : (3, 3) float, optional
        Rotation of all points, before the shift.
    away : (3,) float [m]

    Returns
    -------
    Scene
    """
    # Points of all parts one after the other, turned and shifted; triangles count on.
    counts = np.cumsum([0, *(len(points) for points, _ in parts)])
    vertices = np.concatenate([points for points, _ in parts])
    vertices = (vertices if turn is None else vertices @ np.transpose(turn)) + np.asarray(
        away, float
    )
    triangles = np.concatenate(
        [faces + count for (_, faces), count in zip(parts, counts, strict=False)]
    )
    # Normal, area, tilt and azimuth of each triangle, and its kind by these.
    corners, count = vertices[triangles], len(triangles)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    normal /= length[:, None]
    nothing, names = np.zeros(count, bool), [f"triangle {index}" for index in range(count)]
    tilt, azimuth = measure_tilt(normal)
    groups = classify(length / 2, tilt, azimuth, [""] * count)
    surfaces = Surfaces(
        names, [""] * count, [""] * count, *groups, length / 2, tilt, azimuth, normal
    )
    # No ground, no closures, and a place that is not on Earth.
    own = np.arange(count, dtype=np.int32)
    return Scene(
        vertices,
        triangles.astype(np.int32),
        own,
        nothing,
        nothing.copy(),
        surfaces,
        Site(
            latitude=None,
            longitude=None,
            altitude=0.0,
            convergence=0.0,
            crs=None,
            origin=(0.0, 0.0, 0.0),
        ),
    )
