"""The sun positions that are traced, in such an order that any first part is a representative
sample.

A run may be interrupted: what it has traced by then stands for the whole year.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.spatial import KDTree

from ..settings.errors import UNIT, InputError, check_array, check_unit, first_true
from .solar_position import check_place, check_times

TROPICAL_YEAR = 365.2422  # days: period of the sun's declination and the equation of time
BY_DAYS = ("days:", "typical-days:")  # sun samplings whose number counts days
GOLDEN = (np.sqrt(5) - 1) / 2
PLASTIC = 1.324717957244746  # the root of x³ = x + 1


class TimeAxis(NamedTuple):
    """Intervals at a place on Earth, for which suns are chosen."""

    times: pd.DatetimeIndex  # (t,) start of each, tz-aware
    interval: pd.Timedelta  # length of each
    latitude: float  # [°]
    longitude: float  # [°]

    def check(self):
        """Refuse times that are no regular intervals of a zone, and places that are not on Earth.

        Raises
        ------
        InputError
        """
        check_times(self.times, self.interval)
        check_place(self.latitude, self.longitude)


@dataclass
class Suns:
    """Sun positions that are traced, and what is needed to represent a whole year by them."""

    # "hourly", "days:24", "typical-days:12" or "sky-grid:1654"; "hourly:480" means 480 of the hours
    sampling: str
    direction: np.ndarray  # (s, 3) float64, unit vectors towards the sun: x east, y north, z up
    # (s,) float64, share of the year's sunny intervals that it represents; sums to 1
    weight: np.ndarray
    # (s,) int32, its day: a count, for "days" the ordinal of the date; -1 in a sky grid
    day: np.ndarray
    step: np.ndarray  # (s,) int32, step of that day; -1 in a sky grid

    def __len__(self):
        return len(self.direction)

    def check(self):
        """Refuse suns without direction or weight, or below the horizon.

        Raises
        ------
        InputError
        """
        name = "direction of the suns"
        check_array(
            "weight of the suns",
            self.weight,
            (len(np.asarray(self.direction)),),
            least=0,
            most=1 + UNIT,
        )
        direction = check_unit(name, self.direction)
        # Down to a sine of -1e-6 a sun counts as on the horizon: rounding.
        if (first := first_true(direction[:, 2] < -1e-6)) is not None:
            raise InputError(
                name,
                f"row {first} is {direction[first]}, below the horizon",
                "leave out suns below the horizon",
            )

    @property
    def end_of_days(self):
        """Numbers of suns after which tracing can stop: (k,) int, ascending, the last one being
        their total number.

        A day is usable only as a whole, and a sky grid only once it fills the sky.
        """
        if self.sampling.startswith(BY_DAYS):
            return np.append(np.flatnonzero(np.diff(self.day)) + 1, len(self))
        # To interpolate over the whole sky, a sky grid needs 16 directions.
        first = min(16, len(self)) if self.sampling.startswith("sky-grid") else 1
        return np.arange(first, len(self) + 1)

    def first(self, count):
        """The first suns, as if only these had been requested.

        Parameters
        ----------
        count : int
            At least 1.

        Returns
        -------
        Suns
            `sampling` has their own number: of days, directions, or hourly suns. The weights are
            the given ones, normalised; `match_suns.weigh_by_year` replaces them with the year's.
        """
        name = self.sampling.partition(":")[0]
        number = len(np.unique(self.day[:count])) if self.sampling.startswith(BY_DAYS) else count
        weight = self.weight[:count]
        weight = weight / weight.sum() if weight.any() else np.full(count, 1 / count)
        return Suns(
            f"{name}:{number}", self.direction[:count], weight, self.day[:count], self.step[:count]
        )

    def progressive_order(self):
        """Put suns into the order in which they are traced.

        Days stay whole. They are lined up from the one with the southernmost sun to the one with
        the northernmost, each as long as its weight, and visited in steps of the golden ratio: days
        of large weight come early, and every season is sampled soon. Days of the year, which are
        interpolated, are lined up by season instead, all of one length. The directions of a sky
        grid are visited by a low-discrepancy sequence over the sky.

        Returns
        -------
        Suns
            A copy in the new order; unchanged if there are none.

        Notes
        -----
        After any number of golden-ratio steps around a circle, the gaps have at most three
        different lengths. In the plane, powers of the plastic number replace the golden ratio.

        References
        ----------
        M. Roberts (2018), The unreasonable effectiveness of quasirandom sequences: the R-sequences.
        """
        if not len(self):
            return self
        if self.day[0] < 0:
            # A sky grid has no days: a sequence walks evenly over the sky, and each direction has
            # the rank of the first step to which it is the nearest; the rest follows.
            count = 4 * len(self)
            height, turn = ((0.5 + np.arange(count) / PLASTIC**power) % 1 for power in (1, 2))
            radius, azimuth = np.sqrt(1 - height**2), 2 * np.pi * turn
            walk = np.stack([radius * np.sin(azimuth), radius * np.cos(azimuth), height], axis=1)
            order = pd.unique(
                np.append(KDTree(self.direction).query(walk)[1], np.arange(len(self)))
            )
        else:
            # Days with their number of suns, and where they stand on the line: by season, or by how
            # far south the sun stands, as long as they weigh.
            _, number, length = np.unique(self.day, return_inverse=True, return_counts=True)
            if self.sampling.startswith("days:"):
                place, share = np.unique(self.day) % TROPICAL_YEAR, np.ones(len(length))
            else:
                place, share = (
                    np.bincount(number, self.direction[:, 1]) / length,
                    np.bincount(number, self.weight),
                )
            # Steps of the golden ratio over the line; a day has the rank of the first step into it.
            line = np.argsort(place, kind="stable")
            end = np.cumsum(share[line] if share.any() else np.ones(len(line)))
            # As many steps as 64 times the number of days; days that are never visited come last.
            steps = (0.5 + GOLDEN * np.arange(64 * len(line))) % 1 * end[-1]
            visited = np.minimum(np.searchsorted(end, steps, side="right"), len(line) - 1)
            rank = np.empty(len(line), int)
            rank[line[pd.unique(np.append(visited, np.arange(len(line))))]] = np.arange(len(line))
            order = np.argsort(rank[number], kind="stable")
        return replace(
            self,
            **{name: getattr(self, name)[order] for name in ("direction", "weight", "day", "step")},
        )
