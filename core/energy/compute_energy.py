"""Transfer × Weather × module: irradiance and full load hours of every surface."""

import os
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from .check_inputs import check_hours, check_transfer
from .energy import Energy
from .fast_sapm import fast_sapm, tabulate_sapm
from .fill_behind import order_neighbours
from .groups import find_groups
from .hours import prepare_hours
from .pick_module import pick_module
from .plain_sapm import plain_sapm
from .sum_block import BlockSums, sum_block, take_block

BLOCK = 1024  # surfaces at a time: long enough that threads wait little for the interpreter, short enough for the cache
PLAIN_LIMIT = 5e6  # surface-hours up to which pvlib itself is called
YEAR = pd.Timedelta(days=365)
DEFAULT_MODULE = "SunPower_SPR_300_WHT__2007__E__"


def compute_energy(transfer, weather, module_name=DEFAULT_MODULE, threads=None, progress=None):
    """Irradiance, full load hours and capacity factors of a traced scene under one weather.

    The angle of incidence and the far ground are those of the true hour; visible shares and reflections those of the
    traced suns that stand for it. Reflected light counts as diffuse. Few surfaces are computed by pvlib itself, many by
    tables made from pvlib (0.01 % in full load hours).

    Parameters
    ----------
    transfer : Transfer
    weather : Weather
    module_name : str
        As in pvlib's Sandia library.
    threads : int, optional
        All processors if not given; the result does not depend on it.
    progress : callable, optional
        Called as progress(stage, done, total, unit) from the calling thread.

    Returns
    -------
    Energy
        Full load hours are NaN for surfaces of kind ground and downward.

    Raises
    ------
    InputError
        The Transfer, the weather or the module cannot be used.
    """
    check_transfer(transfer)
    check_hours(weather)
    module = pick_module(module_name)
    hours = prepare_hours(transfer.suns, weather, module)
    groups = find_groups(transfer.surfaces)
    electric = ~np.isin(np.asarray(transfer.surfaces.kind), ("ground", "downward"))
    sums, capacity_factor = sum_surfaces(
        transfer, hours, groups.weight, electric, module, threads=threads, progress=progress
    )
    years = count_years(weather)
    hour = weather.interval / pd.Timedelta(hours=1)
    by_month = np.where(electric[:, None], sums.capacity_factor_by_month * hour / years, np.nan)
    poa = sums.poa_global * hour / years / 1000.0
    series = np.zeros((len(weather.data), len(groups.names)))
    series[hours.interval] = capacity_factor
    full_load_hours = by_month.sum(axis=1)
    return Energy(
        direct_relative_annual=sums.direct_relative / max(hours.sunny.sum(), 1.0),
        direct_relative_annual_standard_error=np.asarray(transfer.direct_annual_standard_error, float),
        poa_global_annual=poa,
        full_load_hours=full_load_hours,
        full_load_hours_standard_error=estimate_error(transfer, weather, full_load_hours, poa, years),
        full_load_hours_by_month=by_month,
        times=weather.data.index,
        interval=weather.interval,
        groups=groups.names,
        group_count=groups.count,
        group_area=groups.area,
        capacity_factor=series,
        years=years,
    )


def sum_surfaces(transfer, hours, group_weight, electric, module, *, threads, progress):
    """Go through all surfaces, block by block on all threads, and add up in the order of the blocks.

    Parameters
    ----------
    transfer : Transfer
    hours : Hours
    group_weight : numpy.ndarray, (n, g)
        Share of each group's area.
    electric : numpy.ndarray, (n,) bool
        Surfaces whose full load hours are asked for.
    module : dict
        From `pick_module`.
    threads, progress
        As in `compute_energy`.

    Returns
    -------
    sums : BlockSums
        Of all surfaces.
    capacity_factor : numpy.ndarray, (h, g)
        Area-weighted mean of each group.
    """
    plain = electric.sum() * len(hours) < PLAIN_LIMIT
    dtype = np.float64 if plain else np.float32
    model = partial(plain_sapm, module=module) if plain else partial(fast_sapm, tables=tabulate_sapm(module))
    cut = partial(
        take_block,
        transfer,
        neighbours=order_neighbours(transfer.suns),
        reach=largest_mismatch(transfer.suns, hours),
        dtype=dtype,
    )
    exact, hours = hours, hours.as_type(dtype)
    tasks = [(rows, model) for rows in cut_blocks(np.flatnonzero(electric))]
    tasks += [(rows, None) for rows in cut_blocks(np.flatnonzero(~electric))]

    def run(task):
        rows, block_model = task
        return rows, sum_block(cut(rows, group_weight=group_weight[rows]), hours, block_model)

    count = len(electric)
    total = BlockSums(
        np.zeros(count), np.zeros(count), np.zeros((count, 12)), np.zeros((len(exact), group_weight.shape[1]))
    )
    done = 0
    # The matrix products are small: threads of their own would only wait for each other.
    with threadpool_limits(1, "blas"), ThreadPoolExecutor(threads or os.cpu_count() or 1) as pool:
        for rows, sums in pool.map(run, tasks):
            total.direct_relative[rows] = sums.direct_relative
            total.poa_global[rows] = sums.poa_global
            total.capacity_factor_by_month[rows] = sums.capacity_factor_by_month
            total.capacity_factor += sums.capacity_factor
            done += len(rows)
            if progress is not None:
                progress("electricity", float(done * len(exact)), float(count * len(exact)), "surface-hours")
    return total, total.capacity_factor


def cut_blocks(rows):
    """Blocks of at most BLOCK surfaces: list of (n,) int."""
    return [rows[first : first + BLOCK] for first in range(0, len(rows), BLOCK)]


def largest_mismatch(suns, hours):
    """Largest angle between the sun of an hour and the traced suns that stand for it [°]."""
    angle = 0.0
    for column in range(hours.match.shape[1]):
        used = hours.match_weight[:, column] != 0
        cosine = np.einsum("hi,hi->h", suns.direction[hours.match[used, column]], hours.direction[used])
        angle = max(angle, float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).max(initial=0.0)))
    return angle


def count_years(weather):
    """Years the weather covers: whole ones, or the part of one where it is shorter."""
    span = len(weather.data) * weather.interval / YEAR
    return float(int(span)) if span >= 1 else span


def estimate_error(transfer, weather, full_load_hours, poa, years):
    """Standard error of the full load hours from those of the two relative irradiances.

    The error of the irradiance is carried over in proportion, and the direct part's is taken as that of its mean over
    the suns' weights. [h]

    Parameters
    ----------
    transfer : Transfer
    weather : Weather
    full_load_hours : numpy.ndarray, (n,)
        [h] per year.
    poa : numpy.ndarray, (n,)
        [kWh/m²] per year.
    years : float
        The weather covers.

    Returns
    -------
    numpy.ndarray, (n,)
        NaN where there are no full load hours, or the error of the irradiance is unknown.
    """
    annual = weather.data[["dni", "dhi"]].sum() * (weather.interval / pd.Timedelta(hours=1)) / years / 1000.0
    direct = np.asarray(transfer.direct_annual_standard_error, float) * annual["dni"]
    diffuse = np.asarray(transfer.diffuse_relative_standard_error, float) * annual["dhi"]
    ratio = np.divide(full_load_hours, poa, out=np.zeros_like(poa), where=poa > 0)
    return np.where(np.isnan(full_load_hours), np.nan, ratio * np.hypot(direct, diffuse))
