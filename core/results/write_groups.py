"""groups.csv: full load hours of the groups, by year, month and hour of the day."""

import numpy as np
import pandas as pd


def write_groups(path, energy):
    """Write area-weighted full load hours of the groups of eligible surfaces.

    Parameters
    ----------
    path : path-like
    energy : Energy
    """
    hours = energy.capacity_factor * (energy.interval / pd.Timedelta(hours=1)) / energy.years  # (T, g) [h]
    # An interval belongs to the month and hour (UTC) of its middle.
    times = energy.times.tz_convert("UTC") + energy.interval / 2
    parts = {
        "annual": ([""], np.zeros(len(times), int)),
        "month": (range(1, 13), times.month.to_numpy() - 1),
        "hour": (range(24), times.hour.to_numpy()),
    }
    rows = []
    for group, (kind, orientation) in enumerate(energy.groups):
        for period, (names, place) in parts.items():
            sums = np.bincount(place, weights=hours[:, group], minlength=len(names))
            rows += [
                (kind, orientation, period, name, f"{value:.6g}", energy.group_count[group], energy.group_area[group])
                for name, value in zip(names, sums, strict=True)
            ]
    columns = ["kind", "orientation", "period", "index", "full_load_hours", "count", "area"]
    pd.DataFrame(rows, columns=columns).to_csv(path, index=False, lineterminator="\n", float_format="%.6g")
