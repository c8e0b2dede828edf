"""The part of the sky that a horizon hides from unobstructed surfaces, in closed form for each azimuth."""

import numpy as np

from ..settings.errors import UNIT, check_array

CHUNK = 512  # normals at a time


def lost_sky(normal, horizon):
    """Cosine-weighted share of the hemisphere of unobstructed surfaces between the horizontal and the horizon.

    For each azimuth the integral over elevation is exact: with c the component of the normal along that azimuth,
    ∫ (c cos e + n_z sin e) cos e de = c (e/2 + sin 2e / 4) + n_z sin² e / 2. A horizon of equal height h takes sin² h
    from a level surface, and (h + sin h cos h)/π, h in radians, from a wall.

    Parameters
    ----------
    normal : array_like, (n, 3)
        Unit vectors.
    horizon : TerrainHorizon

    Returns
    -------
    numpy.ndarray, (n,)
        What (1 + cos tilt)/2 loses, and the view of the ground gains.
    """
    normal = check_array("normal", normal, ("n", 3), least=-1 - UNIT, most=1 + UNIT)
    unique, which = np.unique(np.round(normal, 9) + 0.0, axis=0, return_inverse=True)
    turn, height = np.radians(horizon.azimuth), np.radians(horizon.elevation)
    lost = np.concatenate(
        [_lose(unique[first : first + CHUNK], turn, height) for first in range(0, len(unique), CHUNK)] or [np.zeros(0)]
    )
    return lost[which.ravel()]


def _lose(normal, turn, height):
    """`lost_sky` for azimuths and elevations in radians."""
    along = normal[:, :1] * np.sin(turn) + normal[:, 1:2] * np.cos(turn)  # (n, STEPS)
    up = np.broadcast_to(normal[:, 2:], along.shape)
    # Where the surface's own plane rises or falls across the sky, it is the limit.
    plane = np.arctan2(np.abs(along), np.abs(up))
    low = np.where((along < 0) & (up > 0), plane, 0.0)
    high = np.where((along > 0) & (up < 0), np.minimum(height, plane), height)
    faces = (high > low) & ((along > 0) | (up > 0))

    def integral(angle):
        return along * (angle / 2 + np.sin(2 * angle) / 4) + up * np.sin(angle) ** 2 / 2

    share = np.where(faces, integral(high) - integral(low), 0.0)
    return np.maximum(share, 0).sum(axis=1) * 2 / len(turn)  # da/π = 2/STEPS
