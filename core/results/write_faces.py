"""faces.csv: a row for each surface of the city."""

import numpy as np
import pandas as pd

from ..progress import untold
from .columns import COLUMNS, column_values

WRITTEN = 0.7  # share of the time until all numbers are text


def write_faces(path, transfer, energy, tell=untold):
    """Write what was found of each surface.

    Parameters
    ----------
    path : path-like
    transfer : Transfer
    energy : Energy
    tell : callable, optional
        `tell(share)` is called after each column.
    """
    tabled = [column for column in COLUMNS if column.tabled]
    columns = {column.name: column_values(column, transfer, energy) for column in tabled}
    columns |= {
        column.name: np.where(columns[column.name], "true", "false") for column in tabled if column.kind == "flag"
    }
    table = pd.DataFrame(columns)
    # Six digits, and not more behind the point than any reader could use.
    for number, name in enumerate(columns):
        tell(WRITTEN * number / len(columns))
        if table[name].dtype.kind == "f":
            table[name] = [f"{value:.6g}" if np.isfinite(value) else "" for value in table[name].to_numpy()]
    table.to_csv(path, index=False, lineterminator="\n")
