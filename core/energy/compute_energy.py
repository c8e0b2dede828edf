"""Transfer × Weather × PV system: irradiance and full load hours of every surface."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from ..light.transfer import Transfer
from ..settings.progress import silent
from ..settings.threads import map_in_order, usable_threads
from ..sky.horizon_band import SOURCES
from ..sky.sky_models import SkyParts, split_sky
from .check_inputs import check_hours, check_sky, check_strings, check_transfer
from .counted_area import find_counted_area, find_groups, find_lit_share
from .energy import Energy, HourlySeries, states_of_year
from .hours import Hours, prepare_hours
from .paying import choose_modules
from .power import PowerTables, PvlibCurves, ac_power, diffuse_incidence_factors, tabulate_power
from .pv_system import dc_system
from .standard_errors import errors_of_energy, state_errors
from .sum_block import Block, BlockSums, direct_part, run_model, sum_block
from .time_axis import lay_on_axis

# surfaces at a time: enough that threads wait little for the interpreter, few enough for the cache
BLOCK = 1024
# surface-hours up to which pvlib itself is called; for more, tables take half of its time or less
PLAIN_LIMIT = 1e6


def compute_energy(
    transfer, weather, system=None, threads=None, progress=silent, *, series=(), sky="isotropic"
):
    """Irradiance, full load hours and capacity factors of a traced scene under one weather.

    Angles of incidence and light from the far ground are computed for every hour; visible shares
    and reflections are taken from the traced suns that represent it. Reflected light counts as
    diffuse. Few surfaces are computed by pvlib itself, many by tables made with pvlib (accurate to
    10⁻⁵ of full load hours).

    Parameters
    ----------
    transfer : Transfer
    weather : Weather
    system : PvSystem, optional
        By default the paper's module on open racks, DC without losses.
    threads : int, optional
        By default all processors; the result does not depend on it.
    progress : callable, optional
        Called as progress(stage, done, total, unit) from the calling thread.
    series : sequence of int
        Surfaces (row indices) whose time series are kept.
    sky : str
        Model of the diffuse sky, of `settings.request.SKIES`. The Transfer must have its traced
        sources.

    Returns
    -------
    Energy
        Full load hours are NaN for surfaces of kind ground and downward, unless overhangs count as
        facades.

    Raises
    ------
    InputError
        If the Transfer or the weather is invalid, the sky's sources were not traced, or
        strings are counted whose loss in shade was not.
    """
    # A Transfer for each state of the trees, and which surfaces count, by group.
    check_hours(weather)
    states = states_of_year(transfer, weather.data.index, weather.interval)
    for state, _ in states:
        check_transfer(state)
    check_sky(transfer, sky)
    system = dc_system() if system is None else system
    check_strings(transfer, system)
    counted = find_counted_area(transfer, system)
    groups = find_groups(counted, transfer.surfaces.area)
    electric = (
        ~np.isin(np.asarray(transfer.surfaces.kind), ("ground", "downward")) | counted.eligible
    )
    # Where sums over hours, groups and single surfaces are collected. Each state of the trees is
    # computed in its own hours, the others dark, and the sums of both add up.
    rows, years, count = np.asarray(series, int), weather.year_count, len(weather.data)
    capacity_factor, hourly = (
        np.zeros((count, len(groups.names))),
        HourlySeries(rows, *np.zeros((3, count, len(rows)))),
    )
    sums, sunny = {}, []
    for state, own in states:  # trees carry leaves in some months and not in the others
        year = weather if own.all() else weather.darken(~own)
        task = prepare_task(state, year, system, electric, split_sky(year, sky))
        part = vars(_sum_surfaces(task, groups.weight, threads, progress))
        capacity_factor[task.hours.interval] = part.pop("capacity_factor")
        sums = {name: sums.get(name, 0.0) + values for name, values in part.items()}
        sunny.append(float(task.hours.sunny.sum()))
        if len(rows):
            _add_series(task, hourly)
    # From sums of power over intervals to hours a year, by month and by year, with and without
    # losses.
    hour = weather.interval / pd.Timedelta(hours=1)
    by_month = np.where(electric[:, None], sums["by_month"] * hour / years, np.nan)
    dc, poa = sums["dc"] * hour / years, sums["poa_global"] * hour / years / 1000.0
    full_load_hours = by_month.sum(axis=1)
    lost = sums["string_loss"] * hour / years if transfer.string_loss is not None else np.nan
    # Errors of direct light in both states hold for the hours of each; errors of hours follow.
    direct_errors = [
        share * one.direct_annual_standard_error
        for share, (one, _) in zip(sunny, states, strict=True)
    ]
    energy = Energy(
        **vars(counted),
        direct_relative_annual=sums["direct_relative"] / max(sum(sunny), 1.0),
        direct_relative_annual_standard_error=sum(direct_errors) / max(sum(sunny), 1.0),
        poa_global_annual=poa,
        full_load_hours=full_load_hours,
        full_load_hours_dc=np.where(electric, dc, np.nan),
        string_loss=np.where(electric, lost, np.nan),
        full_load_hours_by_month=by_month,
        full_load_hours_by_year=np.where(electric[:, None], sums["by_year"] * hour, np.nan),
        times=weather.data.index,
        interval=weather.interval,
        groups=groups.names,
        group_count=groups.count,
        group_area=groups.area,
        group_dc=np.where(electric, dc, 0.0) @ groups.weight,
        capacity_factor=capacity_factor,
        years=years,
        longitude=weather.longitude,
        sky=sky,
        series=hourly if len(rows) else None,
    )
    # What the user leaves out, or asks for more hours of, loses its modules; its light stays.
    energy = choose_modules(energy, transfer.surfaces, system)
    energy = state_errors(energy, errors_of_energy(transfer, weather, energy), groups)
    # Where the weather has a calendar of its own zone, series are laid on whole years of it.
    return energy if weather.zone is None else _lay_series(energy, weather.zone)


def _lay_series(energy, zone):
    """Lay the series of an Energy on whole intervals of calendar years of a zone."""
    axis, share = lay_on_axis(energy.times, energy.interval, zone)
    series = energy.series
    if series is not None:
        laid = {
            name: share @ getattr(series, name)
            for name in ("poa_direct", "poa_diffuse", "capacity_factor")
        }
        series = replace(series, **laid)
    return replace(
        energy, times=axis, capacity_factor=share @ energy.capacity_factor, series=series
    )


@dataclass
class _Task:
    """Data shared by all blocks of surfaces."""

    transfer: Transfer
    hours: Hours  # in the precision of the blocks
    curves: PvlibCurves | PowerTables
    iam: np.ndarray  # (2 + k, n) from `diffuse_incidence_factors`
    mounting: np.ndarray  # (n,) int from `PvSystem.mounting_of`
    lit_share: np.ndarray  # (n,) from `find_lit_share`
    electric: np.ndarray  # (n,) bool, surfaces with full load hours
    sky: SkyParts

    def block(self, rows, group_weight):
        """Data of some surfaces, rows (m,) int, with their weights in the groups, (m, g): Block."""
        own = {
            "iam": self.iam[:, rows].astype(self.hours.dni.dtype),
            "mounting": self.mounting[rows],
        }
        own |= {"lit_share": self.lit_share[rows], "sky": self.sky}
        block = Block.take(self.transfer, rows, group_weight=group_weight, **own)
        # Surfaces whose strings lose nothing at any sun need no further look.
        if self.electric[rows].any() and self.transfer.string_loss is not None:
            losses = self.transfer.string_loss[rows]
            if losses.any():
                block.string_loss = np.ascontiguousarray(losses.transpose(1, 2, 0))
        return block


def prepare_task(transfer, weather, system, electric, sky):
    """Data shared by all blocks: Task. Up to PLAIN_LIMIT surface-hours are computed by pvlib
    itself, more by tables.
    """
    hours = prepare_hours(transfer.suns, weather, system, sky, transfer.terrain)
    # Few surface-hours by pvlib in double precision, many by tables in single.
    plain = electric.sum() * len(hours) < PLAIN_LIMIT
    single = {
        name: values.astype(np.float32) if values.dtype.kind == "f" else values
        for name, values in vars(hours).items()
    }
    return _Task(
        transfer,
        hours if plain else Hours(**single),
        PvlibCurves(system) if plain else tabulate_power(system),
        diffuse_incidence_factors(
            transfer.surfaces.surface_tilt, system, [SOURCES[name] for name in sky.sources]
        ),
        system.mounting_of(transfer.surfaces.kind),
        find_lit_share(transfer, system),
        electric,
        sky,
    )


def _sum_surfaces(task, group_weight, threads, progress):
    """Process all surfaces in blocks on all threads, and sum in the order of the blocks.

    Parameters
    ----------
    task : Task
    group_weight : numpy.ndarray, (n, g)
        Area of each surface over the area of its group.
    threads, progress
        As in `compute_energy`.

    Returns
    -------
    BlockSums
        Of all surfaces.
    """
    # Surfaces with modules, and those without, apart: the latter need no power.
    kinds = np.flatnonzero(task.electric), np.flatnonzero(~task.electric)
    blocks = [rows[first : first + BLOCK] for rows in kinds for first in range(0, len(rows), BLOCK)]
    count, hours, done = len(task.electric), len(task.hours), 0
    single = (np.zeros(count) for _ in range(3))
    periods = (np.zeros((count, length)) for length in (12, task.hours.year_count))
    of_groups = np.zeros((hours, group_weight.shape[1]))
    total = BlockSums(*single, *periods, of_groups, np.zeros(count))
    progress("electricity", 0.0, float(count * hours), "surface-hours")
    for rows, sums in sum_blocks(task, blocks, lambda rows: group_weight[rows], threads):
        for name in vars(total).keys() - {"capacity_factor"}:
            getattr(total, name)[rows] = getattr(sums, name)
        total.capacity_factor += sums.capacity_factor
        done += len(rows)
        progress("electricity", float(done * hours), float(count * hours), "surface-hours")
    return total


def sum_blocks(task, blocks, weigh, threads):
    """Process blocks of surfaces on all threads: yields the rows and BlockSums of each, in their
    order.

    The surfaces of a block, rows (m,) int, have full load hours all or none; `weigh(rows)` gives
    their weights in the groups, (m, g).
    """

    def run(rows):
        curves = task.curves if task.electric[rows[0]] else None
        return rows, sum_block(task.block(rows, weigh(rows)), task.hours, curves)

    # The matrix products are small: BLAS threads would only wait for each other.
    with threadpool_limits(1, "blas"):
        yield from map_in_order(run, blocks, usable_threads(threads))


def _add_series(task, series):
    """Write the values of the intervals of a task into an HourlySeries."""
    block = task.block(series.rows, np.zeros((len(series.rows), 0)))
    for first, last in task.hours.chunks():
        part = task.hours.rows(first, last)
        projection, direct = direct_part(block, part)
        sunward, diffuse, dc, kept = run_model(task.curves, block, part, direct, projection)
        if kept is not None and task.curves.system.strings == "string":
            dc *= kept
        poa_direct = sunward * (part.dni / np.where(part.sunward == 0, 1, part.sunward))
        series.poa_direct[part.interval] = poa_direct * block.lit_share
        series.poa_diffuse[part.interval] = (diffuse + (sunward - poa_direct)) * block.lit_share
        series.capacity_factor[part.interval] = ac_power(dc, task.curves.system) * block.lit_share
