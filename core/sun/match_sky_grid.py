"""Interpolate between the directions of a sky grid."""

import numpy as np
from scipy.spatial import ConvexHull

from ..errors import InputError

CHUNK = 512  # directions at a time


def match_sky_grid(suns, direction):
    """The three grid directions around each sun, and their weights.

    The grid and its mirror image below the horizon are triangulated (the convex hull of points on a sphere is their
    Delaunay triangulation); a direction gets the barycentric weights of the triangle it passes through. A mirrored
    corner counts as its original above the horizon.

    Parameters
    ----------
    suns : Suns
        A sky grid.
    direction : numpy.ndarray, (t, 3)
        Towards the suns of the sunny intervals.

    Returns
    -------
    index : numpy.ndarray, (t, 3) int64
        Into the suns.
    weight : numpy.ndarray, (t, 3) float64
        Not negative; rows sum to 1.
    """
    if suns.way != f"sky-grid:{len(suns)}":
        raise InputError("suns", f"{len(suns)} directions of {suns.way}", "give all of them")
    points = np.concatenate([suns.direction, suns.direction * [1.0, 1.0, -1.0]])
    hull = ConvexHull(points)
    corners = hull.simplices[find_triangles(hull, direction)]
    # Solve corner₁ w₁ + corner₂ w₂ + corner₃ w₃ = direction.
    weight = np.linalg.solve(points[corners].transpose(0, 2, 1), direction[:, :, None])[:, :, 0]
    weight = np.maximum(weight, 0.0)
    return corners % len(suns), weight / weight.sum(axis=1, keepdims=True)


def find_triangles(hull, direction):
    """Triangle of a hull around the origin through which the ray of each direction exits: (t,) int64."""
    # The ray exits through the plane it reaches first: the one with the largest (normal · direction) / distance.
    planes = hull.equations[:, :3] / -hull.equations[:, 3:]
    found = np.empty(len(direction), np.int64)
    for first in range(0, len(direction), CHUNK):
        found[first : first + CHUNK] = (direction[first : first + CHUNK] @ planes.T).argmax(axis=1)
    return found
