"""Order suns so that the first of them are a fair sample of all: whoever stops in between keeps those."""

from dataclasses import replace

import numpy as np
from scipy.spatial import KDTree

from .days_of_year import TROPICAL_YEAR

GOLDEN = (np.sqrt(5) - 1) / 2
PLASTIC = 1.324717957244746  # the root of x³ = x + 1
WALK_DAYS, WALK_SKY = 64, 4  # steps for each day or direction; those that are never met come last


def spread_suns(suns):
    """The same suns in the order in which they are best traced.

    Days stay whole. They are laid end to end, from the one with the most southern sun to the one with the most
    northern, each as long as its weight, and met by golden steps: days that stand for much come early, and no season
    waits for long. Days of the year that are interpolated between lie in the order of the seasons instead, all of one
    length. The directions of a sky grid are met by a walk that fills the sky evenly.

    Parameters
    ----------
    suns : Suns

    Returns
    -------
    Suns

    Notes
    -----
    However many golden steps were taken along a circle, the gaps between them have at most three lengths. In the plane
    powers of the plastic number take the place of the golden one.

    References
    ----------
    M. Roberts (2018), The unreasonable effectiveness of quasirandom sequences: the R-sequences.
    """
    if not len(suns):
        return suns
    order = order_sky(suns.direction) if suns.day[0] < 0 else order_days(suns)
    return replace(suns, **{name: getattr(suns, name)[order] for name in ("direction", "weight", "day", "step")})


def order_days(suns):
    """Suns day by day, the days in golden steps: (s,) int."""
    _, number, length = np.unique(suns.day, return_inverse=True, return_counts=True)
    if suns.way.startswith("days:"):
        place, share = np.unique(suns.day) % TROPICAL_YEAR, np.ones(len(length))
    else:
        place, share = np.bincount(number, suns.direction[:, 1]) / length, np.bincount(number, suns.weight)
    line = np.argsort(place, kind="stable")
    end = np.cumsum(share[line] if share.any() else np.ones(len(line)))
    steps = (0.5 + GOLDEN * np.arange(WALK_DAYS * len(line))) % 1 * end[-1]
    met = np.minimum(np.searchsorted(end, steps, side="right"), len(line) - 1)
    rank = np.empty(len(line), int)
    rank[line[order_of_visits(met, len(line))]] = np.arange(len(line))
    return np.argsort(rank[number], kind="stable")


def order_sky(direction):
    """Directions as a walk through equal areas of the sky meets them: (s,) int."""
    count = WALK_SKY * len(direction)
    height, turn = ((0.5 + np.arange(count) / PLASTIC**power) % 1 for power in (1, 2))
    radius, azimuth = np.sqrt(1 - height**2), 2 * np.pi * turn
    walk = np.stack([radius * np.sin(azimuth), radius * np.cos(azimuth), height], axis=1)
    return order_of_visits(KDTree(direction).query(walk)[1], len(direction))


def order_of_visits(met, count):
    """Places 0 to count-1 in the order in which they were first met; those never met come last: (count,) int."""
    found, first = np.unique(met, return_index=True)
    return np.concatenate([found[np.argsort(first)], np.setdiff1d(np.arange(count), found)])
