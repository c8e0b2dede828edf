"""From the coordinates of files to the scene's frame: local origin, y to true north."""

import math

import numpy as np

from .scene import Site

MICROMETRE = 6  # decimals of a metre
AS_IN_FILES = Site(None, None, 0.0, 0.0, None, (0.0, 0.0, 0.0))


def bring_to_origin(points, site):
    """Points of the files in the scene's frame.

    What large coordinates leave behind the micrometre is rounding: the same city is the same scene anywhere.

    Parameters
    ----------
    points : array, (m, 3) float64 [m]
    site : Site

    Returns
    -------
    array, (m, 3) float64 [m]
    """
    return np.round(turn_to_true_north(points - np.array(site.origin), site.convergence), MICROMETRE)


def bring_to_grid(points, site):
    """Points of the scene's frame in the coordinates of the files: the inverse of `bring_to_origin`."""
    return turn_to_true_north(points, -site.convergence) + np.array(site.origin)


def turn_to_true_north(points, convergence):
    """Turn grid coordinates so that y points to true north.

    A direction of grid azimuth a has true azimuth a + convergence.

    Parameters
    ----------
    points : array, (m, 3) float64 [m]
    convergence : float [°]
    """
    sine, cosine = math.sin(math.radians(convergence)), math.cos(math.radians(convergence))
    x, y = points[:, 0], points[:, 1]
    return np.column_stack([cosine * x + sine * y, cosine * y - sine * x, points[:, 2]])
