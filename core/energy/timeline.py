"""Light and yield of a city in each hour of the average days of the twelve months.

Hours are in the standard time of the nearest meridian of 15°.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from ..settings.errors import show_number
from ..sky.horizon import is_above
from ..sun.solar_position import is_sunny, solar_position, sun_direction
from ..sun.sun_sampling import match_suns
from .energy import states_of_year
from .sum_block import filled_share, values_at

NAMES = [pd.Timestamp(2001, month, 1).month_name() for month in range(1, 13)]
# Days whose extraterrestrial irradiation is nearest to the month's mean: S. A. Klein (1977),
# https://doi.org/10.1016/0038-092X(77)90001-9, table 1.
AVERAGE_DAYS = (17, 16, 16, 15, 15, 11, 17, 16, 15, 15, 14, 10)
HOURS = 24
COUNT = 12 * HOURS
HOUR = pd.Timedelta(hours=1)


@dataclass
class Timeline:
    """288 moments, January first, 24 hours each; n surfaces."""

    relative: np.ndarray  # (288, n) float32, direct irradiance per DNI, reflections included
    direction: np.ndarray  # (288, 3) towards the sun
    dni: np.ndarray  # (288,) [Wm⁻²] mean of the weather at this hour of the month
    dhi: np.ndarray  # (288,) [Wm⁻²] the same
    hours_by_month: np.ndarray  # (n, 12) [h] full load hours of the month
    energy_by_month: np.ndarray  # (12,) [MWh] of all eligible surfaces
    zone: int  # [h] ahead of UTC

    def irradiance(self, moment):
        """Direct irradiance of the surfaces at a moment, 0 to 287: (n,) float32 [Wm⁻²]."""
        return self.relative[moment] * np.float32(self.dni[moment])

    def describe(self, moment):
        """Month, hour, sun and weather of a moment, and the yield of its month, as text."""
        month, hour = divmod(moment, HOURS)
        height = np.degrees(np.arcsin(np.clip(self.direction[moment, 2], -1, 1)))
        sun = f"sun {height:.0f}° high, {self.dni[moment]:.0f} W/m²" if height >= 0 else "night"
        energy = f"{self.energy_by_month[month]:,.0f}"
        zone = show_number(self.zone, 0, plus=True) if self.zone else ""
        return (
            f"{NAMES[month]} {hour:02d}–{hour + 1:02d} h (UTC{zone}), {sun}; {energy} MWh in "
            f"{NAMES[month]}"
        )

    @staticmethod
    def build(transfer, weather, energy):
        """Timeline of a traced city under a year of weather.

        Parameters
        ----------
        transfer : Transfer
        weather : Weather
        energy : Energy
            Of both.

        Returns
        -------
        Timeline
            The sun stands as on the months' average days (`month_hours`). Hours that the weather
            lacks are dark.
        """
        axis = weather.axis
        hours = month_hours(axis.times[len(axis.times) // 2].year, axis.longitude)
        relative, direction = relative_direct(transfer, *axis._replace(times=hours, interval=HOUR))
        when = axis.times, axis.interval, axis.longitude
        dni, dhi = (
            np.nan_to_num(mean_of_months(weather.data[name], *when)) for name in ("dni", "dhi")
        )
        # Hours are means over whole polygons, power comes from the modules on their counted area.
        by_month = energy.full_load_hours_by_month
        rows = np.flatnonzero(energy.eligible & np.isfinite(energy.full_load_hours))
        kwp = energy.kwp_of_hours(transfer.surfaces.area)[rows]
        energy_by_month = kwp @ by_month[rows] / 1000.0
        return Timeline(
            relative, direction, dni, dhi, by_month, energy_by_month, zone_of(axis.longitude)
        )


def zone_of(longitude):
    """Standard time of the nearest meridian of 15°, whole hours ahead of UTC: int."""
    return round(longitude / 15.0)


def month_hours(year, longitude):
    """Starts of the 24 hours of each month's average day.

    Parameters
    ----------
    year : int
    longitude : float
        Of the place [°].

    Returns
    -------
    pandas.DatetimeIndex, (288,)
        UTC; January first, each month from midnight to midnight of `zone_of`.
    """
    days = [pd.Timestamp(year, month + 1, day) for month, day in enumerate(AVERAGE_DAYS)]
    local = pd.DatetimeIndex([day + hour * HOUR for day in days for hour in range(HOURS)])
    return (local - zone_of(longitude) * HOUR).tz_localize("UTC")


def mean_of_months(values, times, interval, longitude):
    """Mean of a quantity for each hour of the day of each month.

    Parameters
    ----------
    values : numpy.ndarray, (t,)
    times : pandas.DatetimeIndex, (t,)
        Starts of the intervals, tz-aware.
    interval : pandas.Timedelta
    longitude : float
        Of the place [°].

    Returns
    -------
    numpy.ndarray, (288,)
        NaN for hours without values.
    """
    local = (times + interval / 2).tz_convert("UTC").tz_localize(None) + zone_of(longitude) * HOUR
    place = (local.month.to_numpy() - 1) * HOURS + local.hour.to_numpy()
    count = np.bincount(place, minlength=COUNT)
    total = np.bincount(place, weights=np.asarray(values, float), minlength=COUNT)
    return np.divide(total, count, out=np.full(COUNT, np.nan), where=count > 0)


def relative_direct(transfer, times, interval, latitude, longitude, *, block=1024):
    """Direct irradiance of surfaces per DNI, with all reflections of it.

    Angles of incidence hold for mid-interval, visible shares and reflections for the traced suns
    that represent it, as in `energy.compute_energy`.

    Parameters
    ----------
    transfer : Transfer
        Of n surfaces.
    times : pandas.DatetimeIndex, (t,)
        Starts of the intervals, tz-aware.
    interval : pandas.Timedelta
    latitude, longitude : float
        Of the place [°].

    Returns
    -------
    relative : numpy.ndarray, (t, n) float32
        0 while the sun is below 2° or behind distant terrain.
    direction : numpy.ndarray, (t, 3)
        Towards the sun.
    """
    sun = solar_position(times, interval, latitude, longitude)
    direction = sun_direction(sun["apparent_zenith"], sun["solar_azimuth"])
    lit = is_sunny(sun["apparent_zenith"]) & is_above(transfer.terrain, direction)
    relative = np.zeros((len(times), len(transfer.surfaces)), np.float32)
    if not lit.any():
        return relative, direction
    for state, own in states_of_year(transfer, times, interval):
        rows = np.flatnonzero(lit & own)
        match = match_suns(state.suns, times, interval, latitude, longitude, position=sun)
        towards, index, weight = direction[rows], match.index[rows], match.weight[rows]
        height = np.maximum(towards[:, 2:], 0.0)
        # `block`: surfaces at a time.
        for first in range(0, relative.shape[1], block):
            part = slice(first, first + block)
            # Direct sunlight, all its reflections but off the open ground, and light by way of the
            # open ground.
            light = values_at(filled_share(state, part), index, weight)
            light *= np.maximum(towards @ state.surfaces.normal[part].T, 0)
            light += values_at(np.asarray(state.direct_reflected[part]).T, index, weight)
            relative[rows, part] = light + height * (
                state.far_ground_view_factor[part] * state.ground_albedo
            )
    return relative, direction
