"""Results of a Transfer with one weather and one PV system: what surfaces and groups get and give,
and its totals.
"""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from .counted_area import CountedArea


@dataclass
class HourlySeries:
    """Time series of k surfaces."""

    rows: np.ndarray  # (k,) int, row indices of the surfaces
    poa_direct: np.ndarray  # (T, k) [Wm⁻²] direct sunlight
    poa_diffuse: np.ndarray  # (T, k) [Wm⁻²] sky with circumsolar light, and all reflected light
    capacity_factor: np.ndarray  # (T, k) AC power over nominal DC power


@dataclass
class Energy(CountedArea):
    """Irradiance and full load hours of n surfaces, capacity factors of the groups."""

    direct_relative_annual: np.ndarray  # (n,) over suns above 2°, reflections included
    direct_relative_annual_standard_error: np.ndarray  # (n,)
    poa_global_annual: np.ndarray  # (n,) [kWh/m²] per year
    full_load_hours: np.ndarray  # (n,) [h] per year, AC; NaN for ground and downward surfaces
    full_load_hours_dc: np.ndarray  # (n,) [h] before losses and inverter
    # (n,) [h] per year that strings of modules lose in shade, counted or not; NaN: unknown
    string_loss: np.ndarray
    full_load_hours_by_month: np.ndarray  # (n, 12) [h]
    full_load_hours_by_year: np.ndarray  # (n, y) [h] of `split_years`; (n, 0) for a single year
    times: pd.DatetimeIndex  # (T,) UTC, start of each interval
    interval: pd.Timedelta
    groups: list  # (g,) of (kind, orientation), those that have eligible surfaces
    group_count: np.ndarray  # (g,) eligible surfaces
    group_area: np.ndarray  # (g,) [m²] counted area
    group_dc: np.ndarray  # (g,) [h] mean full load hours of each group, DC
    capacity_factor: np.ndarray  # (T, g) float64, mean over the group's counted area
    years: float  # number of years of the weather
    longitude: float  # [°] of the weather
    # (n,) [h] from rays, patch sizes and suns
    full_load_hours_standard_error: np.ndarray | None = None
    # (g,) [h] of the mean full load hours of each group
    group_standard_error: np.ndarray | None = None
    # [h] of the mean over the counted area of all groups, from rays only
    sampling_error: float = np.nan
    sky: str = "isotropic"  # model of the diffuse sky
    series: HourlySeries | None = None  # of the requested surfaces
    # all modules, where the user's choice takes some off; None: it takes none
    every: CountedArea | None = None

    def kwp_of_hours(self, area):
        """Nominal power by which the hours of whole polygons count, as their modules lie on the
        counted area: (n,) [kWp].

        Parameters
        ----------
        area : numpy.ndarray, (n,)
            Whole area of the surfaces [m²].

        Returns
        -------
        numpy.ndarray
            0 for surfaces without modules or hours.
        """
        counts = np.isfinite(self.full_load_hours) & (self.counted_area > 0)
        spread = np.divide(area, self.counted_area, out=np.zeros(len(counts)), where=counts)
        return self.kwp * spread

    def sum_potential(self, rows, area):
        """Total power and energy and mean full load hours of some surfaces.

        Parameters
        ----------
        rows : numpy.ndarray
            Surfaces, (k,) int or (n,) bool; those without full load hours are skipped.
        area : numpy.ndarray, (n,)
            Whole area of the surfaces [m²].

        Returns
        -------
        dict of str to float
            eligible_area (counted) and module_area [m²], module_count, kwp [kWp], full_load_hours
            [h] (energy over power) and mwh_per_year [MWh]; before the inverter: full_load_hours_dc,
            mwh_dc_per_year. Hours are None without modules.
        """
        rows = np.arange(len(area))[rows]
        rows = rows[np.isfinite(self.full_load_hours[rows]) & self.summed[rows]]
        total = {
            "eligible_area": self.counted_area[rows].sum(),
            "module_area": self.module_area[rows].sum(),
            "module_count": self.module_count[rows].sum(),
            "kwp": self.kwp[rows].sum(),
        }
        # Energy is hours times power [MWh]; hours of all are energy over power.
        for name, sum_name in (
            ("full_load_hours", "mwh_per_year"),
            ("full_load_hours_dc", "mwh_dc_per_year"),
        ):
            total[sum_name] = self.kwp_of_hours(area)[rows] @ getattr(self, name)[rows] / 1000
            total[name] = 1000 * total[sum_name] / total["kwp"] if total["kwp"] else None
        return {name: None if value is None else float(value) for name, value in total.items()}

    def sum_string_loss(self, area, counted):
        """What strings of modules lose in shade: of all, of each kind and of each group.

        Parameters
        ----------
        area : numpy.ndarray, (n,)
            Whole area of the surfaces [m²].
        counted : bool
            Whether the hours of the Energy are without it.

        Returns
        -------
        dict or None
            counted, mwh_per_year [MWh], and percent of the energy of single modules: of all, of
            `kinds` and of `groups`; None where it is unknown.
        """
        kwp = np.where(self.eligible, self.kwp_of_hours(area), 0.0)
        if np.isnan(self.string_loss[kwp > 0]).any():
            return None
        lost, rest = (
            kwp * np.nan_to_num(hours) / 1000 for hours in (self.string_loss, self.full_load_hours)
        )
        whole = rest + counted * lost

        def percent(rows):
            return float(100 * lost[rows].sum() / whole[rows].sum()) if whole[rows].any() else None

        own = {kind: self.kind == kind for kind in np.unique(self.kind[kwp > 0]).tolist()}
        facing = {
            " ".join(name): (self.kind == name[0]) & (self.orientation == name[1])
            for name in self.groups
        }
        return {
            "counted": counted,
            "mwh_per_year": float(lost.sum()),
            "percent": percent(np.ones(len(kwp), bool)),
            "kinds": {name: percent(rows) for name, rows in own.items()},
            "groups": {name: percent(rows) for name, rows in facing.items()},
        }

    def sum_years(self):
        """Full load hours [h] of each group, (g,), by calendar year; empty for a single one."""
        years, length = (
            split_years(self.times, self.interval),
            self.interval / pd.Timedelta(hours=1),
        )
        return (
            {year: self.capacity_factor[own].sum(axis=0) * length for year, own in years}
            if len(years) > 1
            else {}
        )


def states_of_year(transfer, times, interval):
    """States of a Transfer's trees, and in which intervals each holds, by the month of their
    middle.

    Parameters
    ----------
    transfer : Transfer
        With leafless trees in `bare`, in leaf in its `leaf_months`; else in one state all year.
    times : pandas.DatetimeIndex, (t,)
        Start of each interval.
    interval : pandas.Timedelta

    Returns
    -------
    list of (Transfer, numpy.ndarray)
        (t,) bool each.
    """
    if transfer.bare is None:
        return [(transfer, np.ones(len(times), bool))]
    in_leaf = np.isin((times + interval / 2).month, transfer.leaf_months)
    return [
        (replace(transfer, bare=None), in_leaf),
        (replace(transfer.bare, record=transfer.record), ~in_leaf),
    ]


def exceeded_energy(by_year):
    """Energy that is exceeded in half (P50) and in nine of ten (P90) of the given years.

    The k-th lowest of y years is not reached in a share k/(y + 1), whatever the distribution
    (Weibull's plotting position); in between lies a straight line. With fewer than nine years P90
    is the lowest of them.

    Parameters
    ----------
    by_year : numpy.ndarray, (y,) or (y, b)

    Returns
    -------
    dict of str to numpy.ndarray, () or (b,)
        "p50" and "p90"; empty for fewer than two years.
    """
    if len(by_year) < 2:
        return {}
    return {
        f"p{share}": np.quantile(by_year, 1 - share / 100, axis=0, method="weibull")
        for share in (50, 90)
    }


def split_years(times, interval):
    """Years of a time axis, counted from its first instant.

    There may be gaps between years, and a year may start at another hour than in UTC.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (T,)
        Start of each interval, tz-aware, ascending.
    interval : pandas.Timedelta

    Returns
    -------
    list of (int, numpy.ndarray)
        Calendar year that contains most of it, and its intervals (k,) int; incomplete years are
        skipped.
    """
    years, first = [], times[0]
    for number in range(times[-1].year - first.year + 1):
        start, stop = first + pd.DateOffset(years=number), first + pd.DateOffset(years=number + 1)
        inside = np.flatnonzero((times >= start) & (times < stop))
        # Shorter years are not reported separately.
        if len(inside) * interval >= pd.Timedelta(days=364):
            years.append(((start + (stop - start) / 2).year, inside))
    return years
