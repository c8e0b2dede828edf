"""Order suns so that the first ones are a representative sample, in case tracing is stopped early."""

from dataclasses import replace

import numpy as np
from scipy.spatial import KDTree

from .days_of_year import TROPICAL_YEAR

GOLDEN = (np.sqrt(5) - 1) / 2
PLASTIC = 1.324717957244746  # the root of x³ = x + 1
WALK_DAYS, WALK_SKY = 64, 4  # steps per day or direction; those never visited come last


def spread_suns(suns):
    """The same suns in the order in which they are traced.

    Days stay whole. They are lined up from the one with the southernmost sun to the one with the northernmost, each as
    long as its weight, and visited in steps of the golden ratio: days of large weight come early, and every season is
    sampled soon. Days of the year, which are interpolated, are lined up by season instead, all of one length. The
    directions of a sky grid are visited by a low-discrepancy sequence over the sky.

    Parameters
    ----------
    suns : Suns

    Returns
    -------
    Suns

    Notes
    -----
    After any number of golden-ratio steps around a circle, the gaps have at most three different lengths. In the plane,
    powers of the plastic number replace the golden ratio.

    References
    ----------
    M. Roberts (2018), The unreasonable effectiveness of quasirandom sequences: the R-sequences.
    """
    if not len(suns):
        return suns
    order = order_sky(suns.direction) if suns.day[0] < 0 else order_days(suns)
    return replace(suns, **{name: getattr(suns, name)[order] for name in ("direction", "weight", "day", "step")})


def order_days(suns):
    """Order of suns by days, the days in golden-ratio steps: (s,) int."""
    _, number, length = np.unique(suns.day, return_inverse=True, return_counts=True)
    if suns.way.startswith("days:"):
        place, share = np.unique(suns.day) % TROPICAL_YEAR, np.ones(len(length))
    else:
        place, share = np.bincount(number, suns.direction[:, 1]) / length, np.bincount(number, suns.weight)
    line = np.argsort(place, kind="stable")
    end = np.cumsum(share[line] if share.any() else np.ones(len(line)))
    steps = (0.5 + GOLDEN * np.arange(WALK_DAYS * len(line))) % 1 * end[-1]
    visited = np.minimum(np.searchsorted(end, steps, side="right"), len(line) - 1)
    rank = np.empty(len(line), int)
    rank[line[order_of_visits(visited, len(line))]] = np.arange(len(line))
    return np.argsort(rank[number], kind="stable")


def order_sky(direction):
    """Order of directions in which a walk through equal areas of the sky visits them: (s,) int."""
    count = WALK_SKY * len(direction)
    height, turn = ((0.5 + np.arange(count) / PLASTIC**power) % 1 for power in (1, 2))
    radius, azimuth = np.sqrt(1 - height**2), 2 * np.pi * turn
    walk = np.stack([radius * np.sin(azimuth), radius * np.cos(azimuth), height], axis=1)
    return order_of_visits(KDTree(direction).query(walk)[1], len(direction))


def order_of_visits(visited, count):
    """Indices 0 to count-1 in the order of the first visit; those never visited come last: (count,) int."""
    found, first = np.unique(visited, return_index=True)
    return np.concatenate([found[np.argsort(first)], np.setdiff1d(np.arange(count), found)])
