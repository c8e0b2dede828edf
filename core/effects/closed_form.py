"""Unobstructed surfaces: their irradiance has a closed form, without rays.

             sky: (1 + cos tilt)/2      (Eq. 6)
    \\      /
     \\    /
──────╲──────  far ground: (1 - cos tilt)/2      (Eq. 7)
"""

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from ..settings.errors import UNIT, check_array


def find_unobstructed(patches, vertices, *, normal_steps=1e6):
    """Patches with no part of the scene in front of their plane.

    Parameters
    ----------
    patches : Patches
    vertices : (v, 3) float64 [m]
        All vertices of the scene.

    Returns
    -------
    (p,) bool
    """
    vertices = check_array("vertices", vertices, ("v", 3), row="vertex")
    if not len(patches):
        return np.zeros(0, bool)
    # Only corners of the convex hull can be furthest; all count where they lie in one plane.
    try:
        outermost = vertices[ConvexHull(vertices).vertices]
    except QhullError:
        outermost = vertices
    # One number for each normal, since rows are sorted much more slowly; opposite normals have
    # opposite numbers.
    # `normal_steps`: in which components of normals are told apart.
    steps = np.rint(patches.normal.astype(float) * normal_steps).astype(np.int64)
    # Steps from -10⁶ to 10⁶ in three digits: numbers that differ where normals do.
    numbers, first, which = np.unique(
        steps @ np.array([1 << 42, 1 << 21, 1]), return_index=True, return_inverse=True
    )
    normals = steps[first] / normal_steps  # (k, 3) float64, each once
    # Extent of the scene along each normal, from the origin; in slices, to limit memory.
    slices = np.array_split(normals, len(normals) * len(outermost) // 10_000_000 + 1)
    reach = np.concatenate([(part @ outermost.T).max(axis=1) for part in slices])
    own = np.einsum("ij,ij->i", normals[which], patches.corner.astype(float))
    slack = 2 * patches.offset + 1e-6 * np.abs(own)
    # Extent along each normal of the patches that face the opposite way: a floor lies on such
    # ground.
    nearest = np.full(len(normals), np.inf)
    np.minimum.at(nearest, which, own)
    opposite = np.minimum(np.searchsorted(numbers, -numbers), len(numbers) - 1)
    extent = np.where(numbers[opposite] == -numbers, -nearest[opposite], -np.inf)
    # Nothing of the scene reaches over the plane by more than rounding, and no patch that faces the
    # opposite way lies on it.
    return (reach[which] - own <= slack) & (own - extent[which] > slack)


def sky_view_of_tilt(normal, horizon=None):
    """Sky view factor of an unobstructed surface: (1 + cos tilt)/2, without what a horizon hides.
    # Eq 6

    Parameters
    ----------
    normal : (n, 3) float
    horizon : Horizon, optional
    """
    whole = (1 + check_array("normal", normal, ("n", 3), least=-1 - UNIT, most=1 + UNIT)[:, 2]) / 2
    return whole if horizon is None else np.maximum(whole - horizon.lost_sky(normal), 0)


def ground_view_of_tilt(normal, horizon=None):
    """Ground view factor of an unobstructed surface: (1 - cos tilt)/2, and terrain up to a horizon.
    # Eq 7
    """
    whole = (1 - check_array("normal", normal, ("n", 3), least=-1 - UNIT, most=1 + UNIT)[:, 2]) / 2
    return whole if horizon is None else whole + horizon.lost_sky(normal)
