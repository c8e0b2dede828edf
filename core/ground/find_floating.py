"""Things that float: slabs, canopies, billboards, whose lower edges tell nothing about the ground."""

import numpy as np

from .merge_places import group

THIN = 1.0  # [m] what is thinner, lying or upright, is no building
STOREY = 2.5  # [m] a building that stands nowhere lower than this above the ground floats
LEAST = 0.5  # [m] lower than this above the ground nothing floats
GENTLE = 0.1  # [m/m] thin things are not taken for a sign of steeper ground
MISMATCH = 3.0  # [m] if half of the buildings stand further above the ground, its zero level is another


def measure_objects(building, points):
    """Height of each building, and whether it is thin.

    Parameters
    ----------
    building : (m,) int
        Of each point, 0 to b - 1, each at least once.
    points : (m, 3) float64 [m]
        z up.

    Returns
    -------
    height : (b,) float64 [m]
    thin : (b,) bool
        Its height, or its width seen from above, is less than THIN.
    """
    order, first = group(building)
    low, high = extremes(points[order, 2], first)
    number = np.diff(first, append=len(building))
    count = len(first)
    middle = np.column_stack([np.bincount(building, points[:, k], count) / number for k in (0, 1)])
    away = points[:, :2] - middle[building]
    # The width across the longer principal axis of the points.
    spread = [np.bincount(building, away[:, i] * away[:, k], count) for i, k in ((0, 0), (1, 1), (0, 1))]
    angle = 0.5 * np.arctan2(2 * spread[2], spread[0] - spread[1])
    across = away[:, 1] * np.cos(angle)[building] - away[:, 0] * np.sin(angle)[building]
    left, right = extremes(across[order], first)
    return high - low, np.minimum(high - low, right - left) < THIN


def extremes(values, first):
    """Smallest and largest of values, (m,), in runs that begin at some of them: two (b,) float64."""
    if not len(first):
        return np.zeros(0), np.zeros(0)
    return np.minimum.reduceat(values, first), np.maximum.reduceat(values, first)


def find_floating(building, middles, objects, ground_height):
    """Lower edges of buildings that hang in the air as a whole above ground that is known.

    A building floats where none of its lower edges comes nearer to the ground than its own height or a storey,
    whichever is less: no building stands on an embankment higher than itself.

    Parameters
    ----------
    building : (e,) int
        Of each edge.
    middles : (e, 3) float64 [m]
        Of the edges.
    objects : tuple of (b,) float64 [m] and (b,) bool
        Of `measure_objects`.
    ground_height : callable
        Takes places, (e, 3) float64 [m], and whether each belongs to a thin thing, (e,) bool, to heights of what lies
        below, (e,) float64 [m]: the ground, or for a thin thing anything that faces up; NaN where nothing is known.

    Returns
    -------
    (e,) bool
    """
    height, thin = objects
    rise = middles[:, 2] - ground_height(middles, thin[building])
    least = np.full(len(height), np.inf)
    np.fmin.at(least, building, np.where(np.isnan(rise), np.inf, rise))
    known = np.isfinite(least)
    if (known & ~thin).any() and np.median(least[known & ~thin]) > MISMATCH:
        known &= thin
    floats = known & (least > np.maximum(np.minimum(height, STOREY), LEAST))
    return floats[building]
