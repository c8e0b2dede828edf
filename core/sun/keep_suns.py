"""The suns that were traced until somebody interrupted: which of them are of use, and what they stand for."""

from dataclasses import replace

import numpy as np

from .match_suns import match_suns
from .suns import Suns

DAYS = ("days:", "typical-days:")  # ways whose number counts days
FEWEST_OF_SKY = 16  # directions of a sky grid between which the whole sky can be interpolated


def end_of_days(suns):
    """After how many suns it makes sense to stop: (k,) int, ascending, the last one being their number.

    A day is of use as a whole only, and a sky grid not before it fills the sky.
    """
    if suns.way.startswith(DAYS):
        return np.append(np.flatnonzero(np.diff(suns.day)) + 1, len(suns))
    first = min(FEWEST_OF_SKY, len(suns)) if suns.way.startswith("sky-grid") else 1
    return np.arange(first, len(suns) + 1)


def keep_suns(suns, count):
    """The first suns, as if no more had been asked for.

    Parameters
    ----------
    suns : Suns
    count : int
        At least 1.

    Returns
    -------
    Suns
        Their `way` names their own number: days, directions, or suns of hours. The weights are those they had,
        in proportion; `weigh_by_year` gives them those of their year.
    """
    name = suns.way.partition(":")[0]
    number = len(np.unique(suns.day[:count])) if suns.way.startswith(DAYS) else count
    weight = suns.weight[:count]
    weight = weight / weight.sum() if weight.any() else np.full(count, 1 / count)
    return Suns(f"{name}:{number}", suns.direction[:count], weight, suns.day[:count], suns.step[:count])


def weigh_by_year(suns, times, interval, latitude, longitude):
    """Give each sun the share of the sunny intervals that it stands for, by `match_suns`.

    Parameters and errors as of `match_suns`.

    Returns
    -------
    Suns
        As they were, where no interval is sunny.
    """
    match = match_suns(suns, times, interval, latitude, longitude)
    share = np.bincount(match.index.ravel(), weights=match.weight.ravel(), minlength=len(suns))
    share = np.maximum(share, 0.0)  # a sun that only bends the interpolation between others may have less than nothing
    return replace(suns, weight=share / share.sum()) if share.sum() > 0 else suns
