"""Suns traced before an interruption: which of them are usable, and their weights."""

from dataclasses import replace

import numpy as np

from .match_suns import match_suns
from .suns import Suns

DAYS = ("days:", "typical-days:")  # ways whose number is that of days
FEWEST_OF_SKY = 16  # directions of a sky grid needed to interpolate over the whole sky


def end_of_days(suns):
    """Numbers of suns after which tracing can stop: (k,) int, ascending, the last one being their total number.

    A day is usable only as a whole, and a sky grid only once it fills the sky.
    """
    if suns.way.startswith(DAYS):
        return np.append(np.flatnonzero(np.diff(suns.day)) + 1, len(suns))
    first = min(FEWEST_OF_SKY, len(suns)) if suns.way.startswith("sky-grid") else 1
    return np.arange(first, len(suns) + 1)


def keep_suns(suns, count):
    """The first suns, as if only these had been requested.

    Parameters
    ----------
    suns : Suns
    count : int
        At least 1.

    Returns
    -------
    Suns
        `way` has their own number: of days, directions, or hourly suns. The weights are the given ones, normalised;
        `weigh_by_year` replaces them with those of the year.
    """
    name = suns.way.partition(":")[0]
    number = len(np.unique(suns.day[:count])) if suns.way.startswith(DAYS) else count
    weight = suns.weight[:count]
    weight = weight / weight.sum() if weight.any() else np.full(count, 1 / count)
    return Suns(f"{name}:{number}", suns.direction[:count], weight, suns.day[:count], suns.step[:count])


def weigh_by_year(suns, times, interval, latitude, longitude, *, position=None):
    """Weight each sun with the share of the sunny intervals that it represents, by `match_suns`.

    Parameters and errors as in `match_suns`.

    Returns
    -------
    Suns
        Unchanged if no interval is sunny.
    """
    match = match_suns(suns, times, interval, latitude, longitude, position=position)
    share = np.bincount(match.index.ravel(), weights=match.weight.ravel(), minlength=len(suns))
    share = np.maximum(share, 0.0)  # an outer node of the interpolation may have a negative sum
    return replace(suns, weight=share / share.sum()) if share.sum() > 0 else suns
