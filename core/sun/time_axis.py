"""The intervals for which suns are chosen, and their place."""

from typing import NamedTuple

import pandas as pd


class TimeAxis(NamedTuple):
    """Intervals at a place on Earth."""

    times: pd.DatetimeIndex  # (t,) start of each interval, tz-aware
    interval: pd.Timedelta  # length of each
    latitude: float  # [°]
    longitude: float  # [°]
