"""The supply curve: power and energy that are left above each number of full load hours."""

import numpy as np

STEP = 10.0  # [h] between two points of the supply curve
SIDES = {"facades": ("facade",), "roofs": ("roof", "steep", "flat", "rack")}


def sum_by_hours(kind, hours, kwp):
    """Power and energy of surfaces by their hours, in steps of 10 h.

    Parameters
    ----------
    kind : (n,) str
    hours : (n,) float [h]
        Of the modules of each surface.
    kwp : (n,) float [kWp]

    Returns
    -------
    numpy.ndarray, (2, 2, k)
        Of facades and roofs the power [kWp] and the energy [MWh] in each step of 8,760 h.
    """
    steps = int(8760 / STEP)
    place = np.minimum(hours / STEP, steps - 1).astype(int)
    sums = np.zeros((2, 2, steps))
    for side, kinds in enumerate(SIDES.values()):
        own = np.isin(kind, kinds)
        for row, values in enumerate((kwp, kwp * hours / 1000)):
            sums[side, row] = np.bincount(place[own], values[own], steps)
    return sums


def supply_curve(sums):
    """What is left of facades and roofs where at least 0, 10, 20 … hours are asked for.

    Parameters
    ----------
    sums : (2, 2, k)
        Of `sum_by_hours`.

    Returns
    -------
    dict
        `step` [h], and of each side lists of the `kwp` and `mwh` that are left, up to the first
        step that leaves nothing.
    """
    left = np.cumsum(sums[..., ::-1], axis=-1)[..., ::-1]
    last = int(np.count_nonzero(left[:, 0].any(axis=0)))
    curves = {
        side: {
            name: [*(float(f"{value:.6g}") for value in own[:last]), 0.0]
            for name, own in zip(("kwp", "mwh"), rows, strict=True)
        }
        for side, rows in zip(SIDES, left, strict=True)
    }
    return {"step": STEP, **curves}
