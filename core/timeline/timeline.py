"""Light and yield of a city in each hour of the average days of the twelve months."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from ..energy.pick_module import area_of_kwp
from .month_hours import HOUR, HOURS, mean_of_months, month_hours, zone_of
from .relative_direct import relative_direct

NAMES = [pd.Timestamp(2001, month, 1).month_name() for month in range(1, 13)]


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


def build_timeline(transfer, weather, energy, system):
    """Timeline of a traced city under a year of weather.

    Parameters
    ----------
    transfer : Transfer
    weather : Weather
    energy : Energy
        Of both.
    system : PvSystem
        Of the energy.

    Returns
    -------
    Timeline
        The sun is that of the months' average days (`month_hours`). Hours that the weather lacks are dark.
    """
    axis = weather.axis
    hours = month_hours(axis.times[len(axis.times) // 2].year, axis.longitude)
    relative, direction = relative_direct(transfer, *axis._replace(times=hours, interval=HOUR))
    dni, dhi = (
        np.nan_to_num(mean_of_months(weather.data[name], axis.times, axis.interval, axis.longitude))
        for name in ("dni", "dhi")
    )
    by_month = energy.full_load_hours_by_month
    energy_by_month = _sum_months(transfer, energy, system)
    return Timeline(relative, direction, dni, dhi, by_month, energy_by_month, zone_of(axis.longitude))


def describe_moment(timeline, moment):
    """Month, hour, sun and weather of a moment, and the yield of its month, as text."""
    month, hour = divmod(moment, HOURS)
    height = np.degrees(np.arcsin(np.clip(timeline.direction[moment, 2], -1, 1)))
    sun = f"sun {height:.0f}° high, {timeline.dni[moment]:.0f} W/m²" if height >= 0 else "night"
    energy = f"{timeline.energy_by_month[month]:,.0f}".replace(",", " ")
    return f"{NAMES[month]} {hour:02d}–{hour + 1:02d} h (UTC{timeline.zone:+d}), {sun}; {energy} MWh in {NAMES[month]}"


def _sum_months(transfer, energy, system):
    # Hours are means over whole polygons, power is that of the modules on their counted area.
    rows = np.flatnonzero(energy.eligible & (energy.counted_area > 0) & np.isfinite(energy.full_load_hours))
    kwp = energy.module_area[rows] / area_of_kwp(system.module)
    spread = transfer.surfaces.area[rows] / energy.counted_area[rows]
    return (kwp * spread) @ energy.full_load_hours_by_month[rows] / 1000.0
