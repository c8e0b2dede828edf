"""faces.csv: a row for each surface of the city."""

import numpy as np
import pandas as pd

from ..settings.progress import ignore_share
from .columns import column_values, tabled_columns

WRITTEN = 0.7  # share of the time for formatting the numbers


def write_faces(path, transfer, energy, report_share=ignore_share, *, monthly=False):
    """Write the results of each surface.

    Parameters
    ----------
    path : path-like
    transfer : Transfer
    energy : Energy
    report_share : callable, optional
        `report_share(share)` is called after each column.
    monthly : bool
        Whether to add columns with the full load hours of each month.
    """
    tabled = tabled_columns(energy)
    columns = {column.name: column_values(column, transfer, energy) for column in tabled}
    columns |= {
        column.name: np.where(columns[column.name], "true", "false") for column in tabled if column.kind == "flag"
    }
    columns |= name_months(energy.full_load_hours_by_month) if monthly else {}
    table = pd.DataFrame(columns)
    # Six significant digits.
    for number, name in enumerate(columns):
        report_share(WRITTEN * number / len(columns))
        if table[name].dtype.kind == "f":
            table[name] = [f"{value:.6g}" if np.isfinite(value) else "" for value in table[name].to_numpy()]
    table.to_csv(path, index=False, lineterminator="\n")


def name_months(by_month):
    """Columns of the months: full_load_hours_01 to _12, each (n,) [h]."""
    return {f"full_load_hours_{month + 1:02d}": by_month[:, month] for month in range(12)}
