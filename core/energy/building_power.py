"""Power of each building at every hour: that of its surfaces, summed as it is computed, so that none is kept."""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from threadpoolctl import threadpool_limits

from ..sun.sky_models import split_sky
from ..weather.weather import darken_hours
from .compute_energy import BLOCK, prepare_task
from .energy import kwp_of_hours, states_of_year
from .sum_block import direct_part, run_model


def compute_building_power(transfer, weather, energy, system, threads=None):
    """AC power of the modules of each building over time.

    Parameters
    ----------
    transfer : Transfer
    weather : Weather
    energy : Energy
        Of both and the system.
    system : PvSystem
    threads : int, optional
        By default all processors; the result does not depend on it.

    Returns
    -------
    names : (b,) numpy.ndarray of str
        Of the buildings, in alphabetical order.
    power : (T, b) numpy.ndarray, float32
        [kW] mean over each interval; 0 for buildings without modules.
    """
    names, building = np.unique(np.array(transfer.surfaces.building_id, dtype=object).astype(str), return_inverse=True)
    kwp = np.where(energy.eligible, kwp_of_hours(np.asarray(transfer.surfaces.area, float), energy, system), 0.0)
    rows = np.flatnonzero(kwp)
    rows = rows[np.argsort(building[rows], kind="stable")]
    blocks = [rows[first : first + BLOCK] for first in range(0, len(rows), BLOCK)]
    power = np.zeros((len(weather.data), len(names)), np.float32)
    for state, own in states_of_year(transfer, weather.data.index, weather.interval):
        year = darken_hours(weather, ~own)
        task = prepare_task(state, year, system, kwp > 0, split_sky(year, energy.sky))

        def run(rows, task=task):
            return sum_buildings_of_block(task, rows, kwp[rows], building[rows])

        # The matrix products are small: BLAS threads would only wait for each other.
        with threadpool_limits(1, "blas"), ThreadPoolExecutor(threads or os.cpu_count() or 1) as pool:
            for block, found in zip(blocks, pool.map(run, blocks), strict=True):
                power[np.ix_(task.hours.interval, np.unique(building[block]))] += found
    return names, power


def sum_buildings_of_block(task, rows, kwp, building):
    """Power of the buildings of some surfaces, (m,) in the order of the buildings: (h, b of the block) [kW]."""
    block, first = task.block(rows, np.zeros((len(rows), 0))), np.flatnonzero(np.diff(building, prepend=-1))
    power = np.zeros((len(task.hours), len(first)), np.float32)
    for start, stop in task.hours.chunks():
        part = task.hours.rows(start, stop)
        projection, direct = direct_part(block, part)
        ac = task.curves.ac(run_model(task.curves, block, part, direct, projection)[-1])
        power[start:stop] = np.add.reduceat(ac * kwp, first, axis=1)
    return power
