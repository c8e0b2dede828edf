"""What the windows that a file does not draw take: the modules of facades with smaller and with
larger ones.
"""

from dataclasses import replace

import numpy as np

from ..modules.lay_city import lay_city


def vary_windows(transfer, energy, system, *, bands=(1.0, 1.8)):
    """Power and energy with windows 1.0 and 1.8 m high in place of the run's own.

    Only facades are laid out anew; every surface keeps its hours, so that its energy changes as its
    power does.

    Parameters
    ----------
    transfer : Transfer
    energy : Energy
        Of both.
    system : PvSystem
    bands : tuple of float
        [m] Of storeys of 3 m; the default of 1.4 m lies between.

    Returns
    -------
    list of dict
        `window_band` [m], `kwp`, `mwh_per_year` of all eligible surfaces, and their change in
        `percent`; empty where modules do not lie in rows, or no facade has such windows.
    """
    # Eligible facades that carry modules, or on which none fits with the run's windows; without
    # rows, windows or energy there is nothing to vary.
    rules = system.layout
    walls = (energy.kind == "facade") & energy.eligible & np.isin(energy.reason, ("", "narrow"))
    if energy.layout is None or not rules.window_band or not walls.any():
        return []
    area = np.asarray(transfer.surfaces.area, float)
    whole = energy.sum_potential(energy.eligible, area)
    if not whole["mwh_per_year"]:
        return []
    surfaces = replace(transfer.surfaces, kind=energy.kind)
    usable = system.share_usable(surfaces)
    parts = system.hidden_walls != "count"
    outcomes = []
    # Lay out the facades with each height of windows and count their modules.
    for band in bands:
        # Covered parts are cut out of the walls, unless the settings count them.
        _, count = lay_city(
            surfaces,
            transfer.outlines,
            walls & (usable > 0),
            replace(rules, window_band=band),
            hidden=1 - energy.open_area / np.where(area > 0, area, 1.0),
            taken=transfer.taken_at(system.clearance) if parts else None,
        )
        kwp = np.where(walls, count * usable * system.module.nominal_power / 1000, energy.kwp)
        sums = replace(energy, kwp=kwp).sum_potential(energy.eligible, area)
        # Hours stay, power changes: so does the energy of the whole.
        change = sums["mwh_per_year"] / whole["mwh_per_year"] - 1
        outcomes.append(
            {
                "window_band": band,
                "kwp": sums["kwp"],
                "mwh_per_year": sums["mwh_per_year"],
                "percent": 100 * change,
            }
        )
    return outcomes
