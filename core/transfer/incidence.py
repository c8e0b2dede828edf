"""Cosine of the angle of incidence of sunlight on patches."""

import numpy as np
from numba import njit

EDGE_ON = np.float32(1e-6)  # cosine of incidence below which a patch is edge-on to the sun and receives nothing
NOTHING = np.float32(0)


@njit(nogil=True, cache=True)
def projection_in_front(normal, directions):
    """Cosine of the angle of incidence, 0 if the sun is behind the patch or edge-on.

    Parameters
    ----------
    normal : (c, 3) float32
    directions : (s, 3) float32

    Returns
    -------
    (c, s) float32
    """
    count = len(directions)
    aoi_projection, along = np.empty((len(normal), count), np.float32), np.empty((3, count), np.float32)
    for sun in range(count):
        for axis in range(3):
            along[axis, sun] = directions[sun, axis]
    for patch in range(len(normal)):
        x, y, z = normal[patch, 0], normal[patch, 1], normal[patch, 2]
        for sun in range(count):
            cosine = x * along[0, sun] + y * along[1, sun] + z * along[2, sun]
            aoi_projection[patch, sun] = cosine if cosine >= EDGE_ON else NOTHING
    return aoi_projection
