"""What one weather and one module make of a Transfer."""

from dataclasses import dataclass

import numpy as np
import pandas as pd


@dataclass
class Energy:
    """Irradiance and full load hours of n surfaces, capacity factors of the groups."""

    direct_relative_annual: np.ndarray  # (n,) mean over intervals with the sun above 2°, reflections included
    direct_relative_annual_standard_error: np.ndarray  # (n,)
    poa_global_annual: np.ndarray  # (n,) [kWh/m²] per year
    full_load_hours: np.ndarray  # (n,) [h] per year; NaN for ground and downward surfaces
    full_load_hours_standard_error: np.ndarray  # (n,) [h]
    full_load_hours_by_month: np.ndarray  # (n, 12) [h]
    times: pd.DatetimeIndex  # (T,) UTC, start of each interval
    interval: pd.Timedelta
    groups: list  # (g,) of (kind, orientation), those that have eligible surfaces
    group_count: np.ndarray  # (g,) eligible surfaces
    group_area: np.ndarray  # (g,) [m²]
    capacity_factor: np.ndarray  # (T, g) float64, area-weighted over the eligible surfaces of the group
    years: float  # how many years the weather spans
