"""groups.csv: full load hours of the groups, by year, month and hour of the day."""

import numpy as np
import pandas as pd

from ..energy.energy import split_years
from ..sun.solar_position import local_middle

HOUR = pd.Timedelta(hours=1)
COLUMNS = ["kind", "orientation", "period", "index", "full_load_hours", "count", "area"]
COLUMNS.append("full_load_hours_standard_error")


def write_groups(path, energy):
    """Write full load hours of the groups of eligible surfaces, means over their counted area, and their errors.

    Parameters
    ----------
    path : path-like
    energy : Energy
    """
    places = place_periods(energy)
    hours = sum_periods(energy.capacity_factor, energy, places)
    ac = None if energy.capacity_factor_ac is None else sum_periods(energy.capacity_factor_ac, energy, places)
    rows = []
    for group, names in enumerate(energy.groups):
        for period, index in hours:
            values = [f"{table[period, index][group]:.6g}" for table in (hours, ac) if table is not None]
            error = energy.group_standard_error[group] if period == "annual" else np.nan
            counted = energy.group_count[group], energy.group_area[group], error
            rows.append((*names, period, index, values[0], *counted, *values[1:]))
    columns = COLUMNS + ([] if ac is None else ["specific_yield"])
    pd.DataFrame(rows, columns=columns).to_csv(path, index=False, lineterminator="\n", float_format="%.6g")


def place_periods(energy):
    """Periods of the tables, and the intervals that belong to each.

    An interval belongs to the month and hour (UTC) of its middle. It is split between hours of local mean solar time,
    which start at any time within those of UTC. Years are separate if the weather covers several.

    Returns
    -------
    list of (str, list, list of (numpy.ndarray, numpy.ndarray or float))
        Period, its indices, and parts: for each interval the position in the indices, (T,) int, and its share.
    """
    middle = energy.times.tz_convert("UTC") + energy.interval / 2
    solar = local_middle(energy.times, energy.interval, energy.longitude) - energy.interval / 2
    periods = [
        ("annual", [""], [(np.zeros(len(middle), int), 1.0)]),
        ("month", list(range(1, 13)), [(middle.month.to_numpy() - 1, 1.0)]),
        ("hour", list(range(24)), [(middle.hour.to_numpy(), 1.0)]),
        ("solar_hour", list(range(24)), split_hours(solar, energy.interval)),
    ]
    years = split_years(energy.times, energy.interval)
    if len(years) > 1:
        place, inside = np.zeros(len(middle), int), np.zeros(len(middle))
        for number, (_, chosen) in enumerate(years):
            place[chosen], inside[chosen] = number, energy.years
        periods.append(("year", [year for year, _ in years], [(place, inside)]))
    return periods


def split_hours(start, interval):
    """Hours of the day that intervals overlap, and the share of each interval in them.

    Parameters
    ----------
    start : pandas.DatetimeIndex, (T,)
        Start of the intervals.
    interval : pandas.Timedelta

    Returns
    -------
    list of (numpy.ndarray, numpy.ndarray)
        Hour (T,) int and share (T,); the shares of an interval sum to 1.
    """
    length = interval / HOUR
    begin = ((start - start.floor("D")) / HOUR).to_numpy()
    first = np.floor(begin)
    parts = []
    for number in range(int(np.ceil(length)) + 1):
        low = np.maximum(first + number, begin)
        high = np.minimum(first + number + 1, begin + length)
        parts.append(((first + number).astype(int) % 24, np.maximum(high - low, 0.0) / length))
    return parts


def sum_periods(capacity_factor, energy, periods):
    """Full load hours of each group in each period, per year.

    Parameters
    ----------
    capacity_factor : numpy.ndarray, (T, g)
    energy : Energy
    periods : list
        From `place_periods`.

    Returns
    -------
    dict of (str, int or str) to numpy.ndarray, (g,)
        By period and index [h].
    """
    hours = capacity_factor * (energy.interval / HOUR) / energy.years  # (T, g) [h]
    sums = {}
    for period, names, parts in periods:
        table = np.zeros((len(names), hours.shape[1]))
        for place, share in parts:
            for group in range(hours.shape[1]):
                table[:, group] += np.bincount(place, weights=hours[:, group] * share, minlength=len(names))
        sums.update({(period, name): row for name, row in zip(names, table, strict=True)})
    return sums
