"""Results of a Transfer with one weather and one PV system."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from .hourly_series import HourlySeries

ADDED = (
    "poa_global_annual",
    "full_load_hours",
    "full_load_hours_standard_error",
    "full_load_hours_by_month",
    "group_standard_error",
    "sampling_error",
    "capacity_factor",
    "specific_yield",
    "capacity_factor_ac",
)
AVERAGED = ("direct_relative_annual", "direct_relative_annual_standard_error")
OF_SERIES = ("poa_direct", "poa_diffuse", "capacity_factor", "capacity_factor_ac")


@dataclass
class Energy:
    """Irradiance and full load hours of n surfaces, capacity factors of the groups."""

    direct_relative_annual: np.ndarray  # (n,) mean over intervals with the sun above 2°, reflections included
    direct_relative_annual_standard_error: np.ndarray  # (n,)
    poa_global_annual: np.ndarray  # (n,) [kWh/m²] per year
    full_load_hours: np.ndarray  # (n,) [h] per year, DC; NaN for ground and downward surfaces
    full_load_hours_standard_error: np.ndarray  # (n,) [h] from rays, discretisation and choice of suns
    full_load_hours_by_month: np.ndarray  # (n, 12) [h]
    times: pd.DatetimeIndex  # (T,) UTC, start of each interval
    interval: pd.Timedelta
    groups: list  # (g,) of (kind, orientation), those that have eligible surfaces
    group_count: np.ndarray  # (g,) eligible surfaces
    group_area: np.ndarray  # (g,) [m²] counted area
    group_standard_error: np.ndarray  # (g,) [h] of the mean full load hours of each group
    sampling_error: float  # [h] of the mean over the counted area of all groups, from rays and points only
    capacity_factor: np.ndarray  # (T, g) float64, mean over the group's counted area
    years: float  # number of years of the weather
    longitude: float  # [°] of the weather
    eligible: np.ndarray  # (n,) bool: carries modules
    flat_roof: np.ndarray  # (n,) bool: not eligible only because it is flat
    open_area: np.ndarray  # (n,) [m²] not inside or under buildings
    counted_area: np.ndarray  # (n,) [m²] counted area of eligible surfaces and flat roofs; 0 for others
    module_area: np.ndarray  # (n,) [m²] of it that carries modules
    specific_yield: np.ndarray | None = None  # (n,) [kWh/kWp] per year, AC; None without losses and inverter
    capacity_factor_ac: np.ndarray | None = None  # (T, g) AC power over nominal DC power
    sky: str = "isotropic"  # model of the diffuse sky
    series: HourlySeries | None = None  # of the requested surfaces


def join_energies(one, other, share):
    """Energy of a year from two with weathers that are dark in each other's hours; errors add up, as of the same rays.

    Parameters
    ----------
    one, other : Energy
    share : float
        Part of the sunny hours that belongs to the first.

    Returns
    -------
    Energy
    """
    joined = {name: add_known(getattr(one, name), getattr(other, name)) for name in ADDED}
    joined |= {name: share * getattr(one, name) + (1 - share) * getattr(other, name) for name in AVERAGED}
    if one.series is not None:
        values = {name: add_known(getattr(one.series, name), getattr(other.series, name)) for name in OF_SERIES}
        joined["series"] = replace(one.series, **values)
    return replace(one, **joined)


def add_known(one, other):
    """Sum of two results; None if the first is None: a run has a result in both seasons or in none."""
    return None if one is None else one + other
