"""groups.csv: full load hours of the groups, by year, month and hour of the day."""

import numpy as np
import pandas as pd

from ..energy.years import split_years
from ..sun.solar_days import local_middle

COLUMNS = ["kind", "orientation", "period", "index", "full_load_hours", "count", "area"]


def write_groups(path, energy):
    """Write full load hours of the groups of eligible surfaces, means over their area that counts.

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
        for row, (period, index) in enumerate(hours.index):
            values = [f"{table[group].iloc[row]:.6g}" for table in (hours, ac) if table is not None]
            rows.append((*names, period, index, values[0], energy.group_count[group], energy.group_area[group]))
            rows[-1] += tuple(values[1:])
    columns = COLUMNS + ([] if ac is None else ["specific_yield"])
    pd.DataFrame(rows, columns=columns).to_csv(path, index=False, lineterminator="\n", float_format="%.6g")


def place_periods(energy):
    """Periods that the tables tell, and the intervals that belong to each.

    An interval belongs to the month and hour of its middle: months and hours in UTC, hours of local mean solar time
    beside them. Years stand by themselves where the weather covers several.

    Returns
    -------
    list of (str, list, numpy.ndarray)
        Period, its indices, and the place of each interval among them, (T,) int; -1 belongs to none.
    """
    middle = energy.times.tz_convert("UTC") + energy.interval / 2
    solar = local_middle(energy.times, energy.interval, energy.longitude)
    periods = [
        ("annual", [""], np.zeros(len(middle), int)),
        ("month", list(range(1, 13)), middle.month.to_numpy() - 1),
        ("hour", list(range(24)), middle.hour.to_numpy()),
        ("solar_hour", list(range(24)), solar.hour.to_numpy()),
    ]
    years = split_years(energy.times, energy.interval)
    if len(years) > 1:
        place = np.full(len(middle), -1)
        for number, (_, inside) in enumerate(years):
            place[inside] = number
        periods.append(("year", [year for year, _ in years], place))
    return periods


def sum_periods(capacity_factor, energy, periods):
    """Hours of each group in each period, per year.

    Parameters
    ----------
    capacity_factor : numpy.ndarray, (T, g)
    energy : Energy
    periods : list
        From `place_periods`.

    Returns
    -------
    pandas.DataFrame
        A row for each period and index, a column for each group [h].
    """
    hours = capacity_factor * (energy.interval / pd.Timedelta(hours=1))  # (T, g) [h]
    tables = {}
    for period, names, place in periods:
        inside = place >= 0
        years = 1.0 if period == "year" else energy.years
        for group in range(hours.shape[1]):
            sums = np.bincount(place[inside], weights=hours[inside, group], minlength=len(names)) / years
            for name, value in zip(names, sums, strict=True):
                tables.setdefault((period, name), []).append(value)
    index = list(tables)
    return pd.DataFrame(list(tables.values()), index=pd.Index(index, tupleize_cols=False))
