"""Time series of irradiance and power of single surfaces."""

from dataclasses import dataclass

import numpy as np

from .sum_block import direct_part, run_model


@dataclass
class HourlySeries:
    """Time series of k surfaces."""

    rows: np.ndarray  # (k,) int, row indices of the surfaces
    poa_direct: np.ndarray  # (T, k) [Wm⁻²] direct sunlight
    poa_diffuse: np.ndarray  # (T, k) [Wm⁻²] sky, circumsolar light included, and all reflected light
    capacity_factor: np.ndarray  # (T, k) DC power over nominal power
    capacity_factor_ac: np.ndarray | None  # (T, k) AC power over nominal DC power; None without AC


def compute_series(rows, block, hours, model, *, count, ac=False):
    """Time series of the surfaces of a block.

    Parameters
    ----------
    rows : numpy.ndarray, (k,) int
        The surfaces of the block.
    block : Block
    hours : Hours
        In the block's precision.
    model : PlainPower or FastPower
    count : int
        Number of intervals of the weather.
    ac : bool
        Whether to compute AC power.

    Returns
    -------
    HourlySeries
    """
    values = np.zeros((3, count, len(rows)))
    for _, first, last in hours.chunks():
        part = hours.rows(first, last)
        projection, direct = direct_part(block, part)
        sunward, diffuse, power = run_model(model, block, part, direct, projection)
        dark = part.sunward == 0
        poa_direct = sunward * (part.dni / np.where(dark, 1, part.sunward))
        values[:, part.interval] = poa_direct, diffuse + (sunward - poa_direct), power
    return HourlySeries(rows, *values, model.ac(values[2].astype(block.normal.dtype)) if ac else None)
