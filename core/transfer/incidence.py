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
    aoi_projection = np.empty((len(normal), len(directions)), np.float32)
    east, north, up = directions[:, 0].copy(), directions[:, 1].copy(), directions[:, 2].copy()
    for patch in range(len(normal)):
        x, y, z = normal[patch]
        for sun in range(len(east)):
            cosine = x * east[sun] + y * north[sun] + z * up[sun]
            aoi_projection[patch, sun] = cosine if cosine >= EDGE_ON else NOTHING
    return aoi_projection
