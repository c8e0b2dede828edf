"""Installable power and annual energy of surfaces."""

import numpy as np

from .pick_module import area_of_kwp


def sum_potential(rows, area, energy, system):
    """Total power and energy and mean full load hours of some surfaces.

    Parameters
    ----------
    rows : numpy.ndarray
        Surfaces, (k,) int or (n,) bool; those without full load hours are skipped.
    area : numpy.ndarray, (n,)
        Whole area of the surfaces [m²].
    energy : Energy
    system : PvSystem

    Returns
    -------
    dict of str to float
        eligible_area (counted) and module_area [m²], kwp [kWp], full_load_hours [h] (Σ FLH·A over the counted area),
        mwh_per_year [MWh] DC; with losses or an inverter also specific_yield [kWh/kWp] and mwh_ac_per_year [MWh].
        Hours are None without any area.
    """
    rows = np.flatnonzero(rows) if np.asarray(rows).dtype == bool else np.asarray(rows)
    rows = rows[np.isfinite(energy.full_load_hours[rows]) & (energy.counted_area[rows] > 0)]
    counted, kwp = energy.counted_area[rows], energy.module_area[rows] / area_of_kwp(system.module)
    spread = area[rows] / counted  # hours are means over whole polygons; here over the counted area
    total = {"eligible_area": counted.sum(), "module_area": energy.module_area[rows].sum(), "kwp": kwp.sum()}
    columns = {"full_load_hours": ("mwh_per_year", energy.full_load_hours)}
    if energy.specific_yield is not None:
        columns["specific_yield"] = ("mwh_ac_per_year", energy.specific_yield)
    for name, (sum_name, values) in columns.items():
        hours = values[rows] * spread
        total[name] = (counted @ hours) / counted.sum() if len(rows) else None
        total[sum_name] = kwp @ hours / 1000
    return {name: None if value is None else float(value) for name, value in total.items()}
