"""The sun positions that are traced, and the time axes that they stand for."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd


class TimeAxis(NamedTuple):
    """Intervals at a place on Earth, for which suns are chosen."""

    times: pd.DatetimeIndex  # (t,) start of each, tz-aware
    interval: pd.Timedelta  # length of each
    latitude: float  # [°]
    longitude: float  # [°]


@dataclass
class Suns:
    """Sun positions that are traced, and what is needed to represent a whole year by them."""

    way: str  # "hourly", "days:24", "typical-days:12" or "sky-grid:1654"; "hourly:480" means 480 of the hours
    direction: np.ndarray  # (s, 3) float64, unit vectors towards the sun: x east, y north, z up
    weight: np.ndarray  # (s,) float64, share of the year's sunny intervals that it represents; sums to 1
    day: np.ndarray  # (s,) int32, its day: a count, for "days" the ordinal of the date; -1 in a sky grid
    step: np.ndarray  # (s,) int32, step of that day; -1 in a sky grid

    def __len__(self):
        return len(self.direction)


@dataclass
class SunMatch:
    """Which traced suns represent each interval of a time axis."""

    index: np.ndarray  # (T, k) int32 into the suns; 0 where the weight is 0
    weight: np.ndarray  # (T, k) float64; rows sum to 1, or to 0 if the sun is too low; some are negative
