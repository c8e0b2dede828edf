"""buildings.csv: totals of each building."""

import numpy as np
import pandas as pd

from ..energy.energy import sum_potential
from .write_faces import name_months


def write_buildings(path, transfer, energy, system, *, monthly=False):
    """Write sums over the eligible surfaces of each building.

    Parameters
    ----------
    path : path-like
    transfer : Transfer
    energy : Energy
    system : PvSystem
    monthly : bool
        Whether to add columns with the full load hours of each month.
    """
    rows = sum_buildings(transfer, energy, system, monthly=monthly)
    table = pd.DataFrame(rows)
    for column in table.columns[3:]:
        values = np.array([np.nan if value is None else np.squeeze(value) for value in table[column]], float)
        table[column] = [f"{value:.6g}" if np.isfinite(value) else "" for value in values]
    table.to_csv(path, index=False, lineterminator="\n")


def sum_buildings(transfer, energy, system, *, monthly=False):
    """Sums over the eligible surfaces of each building, in alphabetical order: list of dict.

    Parameters as in `write_buildings`.
    """
    area = np.asarray(transfer.surfaces.area, float)
    names, building = np.unique(np.array(transfer.surfaces.building_id, dtype=object).astype(str), return_inverse=True)
    order = np.argsort(building, kind="stable")
    members = np.split(order, np.searchsorted(building[order], np.arange(1, len(names))))
    rows = []
    for name, own in zip(names, members, strict=True):
        eligible = own[energy.eligible[own]]
        row = {"building_id": name, "surfaces": len(own), "eligible": len(eligible)}
        row |= sum_potential(eligible, area, energy, system)
        row["flat_roof_kwp"] = sum_potential(own[energy.flat_roof[own]], area, energy, system)["kwp"]
        if monthly:
            hours = area[eligible] @ energy.full_load_hours_by_month[eligible]  # (12,) [m²h]
            with np.errstate(invalid="ignore"):
                row |= name_months((hours / energy.counted_area[eligible].sum())[None, :])
        rows.append(row)
    return rows
