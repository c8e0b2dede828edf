"""series.csv: time series of irradiance and power of chosen surfaces."""

import numpy as np
import pandas as pd


def write_series(path, transfer, energy):
    """Write the time series of the requested surfaces, surface by surface.

    Parameters
    ----------
    path : path-like
    transfer : Transfer
    energy : Energy
        With `series`.
    """
    series = energy.series
    count = len(series.rows)
    names = np.array(transfer.surfaces.surface_id, dtype=object)[series.rows]
    times = energy.times.tz_convert("UTC").strftime("%Y-%m-%dT%H:%M:%SZ")
    columns = {"surface_id": np.repeat(names, len(times)), "time": np.tile(times, count)}
    for name in ("poa_direct", "poa_diffuse", "capacity_factor", "capacity_factor_ac"):
        values = getattr(series, name)
        if values is not None:
            columns[name] = values.T.ravel()
    pd.DataFrame(columns).to_csv(path, index=False, lineterminator="\n", float_format="%.6g")
