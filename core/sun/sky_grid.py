"""A grid of sun directions over the whole sky, valid for every latitude and year."""

import numpy as np

from .suns import Suns

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


def sky_grid_suns(count):
    """Directions with equal areas of the upper hemisphere, on a Fibonacci spiral.

    Parameters
    ----------
    count : int
        Number of directions.

    Returns
    -------
    Suns
        Way "sky-grid:N", with equal weights, without days and steps.

    Notes
    -----
    Equal steps in height are equal areas on a sphere (Archimedes); the golden angle between neighbours keeps them
    apart, :doi:`10.1007/s11004-009-9257-x`.
    """
    height = (np.arange(count) + 0.5) / count
    azimuth = GOLDEN_ANGLE * np.arange(count)
    radius = np.sqrt(1.0 - height**2)
    direction = np.stack([radius * np.sin(azimuth), radius * np.cos(azimuth), height], axis=-1)
    none = np.full(count, -1, np.int32)
    return Suns(f"sky-grid:{count}", direction, np.full(count, 1.0 / count), none, none.copy())
