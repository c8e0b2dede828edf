"""What distant terrain leaves of the horizon as a source of light, for unobstructed surfaces."""

import numpy as np

from .horizon_band import visible_height

CHUNK = 512  # normals at a time


def seen_band(normal, terrain):
    """Share of the light of the band at the horizon that stands above distant terrain.

    Parameters
    ----------
    normal : (n, 3) float
    terrain : TerrainHorizon or None

    Returns
    -------
    (n,) float64
        Weighed as the band is, with the cosine of the azimuth from the normal; 1 for level surfaces.
    """
    normal = np.asarray(normal, float)
    if terrain is None or not len(normal):
        return np.ones(len(normal))
    unique, which = np.unique(np.round(normal, 6) + 0.0, axis=0, return_inverse=True)
    share = np.concatenate(
        [_share_above(unique[first : first + CHUNK], terrain) for first in range(0, len(unique), CHUNK)]
    )
    return share[which.ravel()]


def _share_above(normal, terrain):
    turn, height = np.radians(terrain.azimuth), np.radians(terrain.elevation)
    level = np.hypot(normal[:, 0], normal[:, 1])[:, None]
    faced = np.maximum(normal[:, :1] * np.sin(turn) + normal[:, 1:2] * np.cos(turn), 0)
    inclined = level > 0
    cosine = np.divide(faced, level, out=np.zeros(faced.shape), where=inclined)
    slope = np.divide(-normal[:, 2:], level, out=np.zeros(level.shape), where=inclined)
    band = np.maximum(visible_height(slope, cosine).astype(float), 1e-9)
    whole = faced.sum(axis=1)
    seen = (faced * np.clip(1 - height / band, 0, 1)).sum(axis=1)
    return np.divide(seen, whole, out=np.ones(len(normal)), where=whole > 0)
