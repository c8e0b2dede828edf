"""Surfaces with nothing in front of them: their irradiance is known without a ray.

             sky: (1 + cos tilt)/2      (Eq. 6)
    \\      /
     \\    /
──────╲──────  far ground: (1 - cos tilt)/2      (Eq. 7)
"""

import numpy as np
from scipy.spatial import ConvexHull, QhullError


def patches_with_empty_front(patches, vertices):
    """Patches in front of whose plane no part of the scene stands.

    Parameters
    ----------
    patches : Patches
    vertices : (v, 3) float64 [m]
        All vertices of the scene.

    Returns
    -------
    (p,) bool
    """
    outermost = outermost_points(vertices)
    normals, which = np.unique(np.round(patches.normal.astype(float), 6), axis=0, return_inverse=True)
    which = which.ravel()
    # How far the scene reaches along each normal, from the origin; in slices, to bound the memory.
    reach = np.empty(len(normals))
    step = max(1, 10_000_000 // len(outermost))
    for first in range(0, len(normals), step):
        reach[first : first + step] = (normals[first : first + step] @ outermost.T).max(axis=1)
    own = np.einsum("ij,ij->i", normals[which], patches.corner.astype(float))
    return reach[which] - own <= 2 * patches.offset + 1e-6 * np.abs(own)


def outermost_points(vertices):
    """Corners of the convex hull; all points where they lie in one plane."""
    try:
        return vertices[ConvexHull(vertices).vertices]
    except QhullError:
        return vertices


def sky_view_of_tilt(normal):
    """Sky view factor of an unobstructed surface: (1 + cos tilt)/2.   # Eq 6

    Parameters
    ----------
    normal : (n, 3) float
    """
    return (1 + normal[:, 2]) / 2


def ground_view_of_tilt(normal):
    """Ground view factor of an unobstructed surface: (1 - cos tilt)/2.   # Eq 7"""
    return (1 - normal[:, 2]) / 2
