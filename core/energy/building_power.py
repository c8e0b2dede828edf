"""AC power of the modules of each building: over time, and by hour of the day in each month."""

from dataclasses import replace
from datetime import timedelta, timezone

import numpy as np
import pandas as pd
from scipy import sparse

from ..sky.sky_models import split_sky
from .compute_energy import BLOCK, prepare_task, sum_blocks
from .energy import states_of_year
from .time_axis import lay_on_axis
from .timeline import COUNT, HOURS, zone_of


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
    names, building = _number_buildings(transfer)
    power = np.zeros((len(weather.data), len(names)), np.float32)
    for times, own, values in _power_of_blocks(
        transfer, weather, energy, system, building=building, threads=threads
    ):
        power[np.ix_(times, own)] += values
    if weather.zone is not None:
        power = (lay_on_axis(weather.data.index, weather.interval, weather.zone)[1] @ power).astype(
            np.float32
        )
    return names, power


def compute_building_hours(transfer, weather, energy, system, threads=None):
    """Mean AC power of the modules of each building in each hour of the day of each month.

    Of a weather of several years each month has as many days as in one year, spread over all years,
    and exactly the energy that it has in the mean of all years.

    Parameters as of `compute_building_power`.

    Returns
    -------
    names : (b,) numpy.ndarray of str
        Of the buildings, in alphabetical order.
    power : (b, 12, 24) numpy.ndarray, float32
        [kW] Months as of `Energy.full_load_hours_by_month`; hours of the day in this zone.
    zone : datetime.timezone
        Of the time axis if one is asked for, else the standard time of the nearest meridian of 15°.
    """
    # Each interval belongs to the hour of the day of its middle, in its month.
    names, building = _number_buildings(transfer)
    zone = weather.zone or timezone(timedelta(hours=zone_of(weather.longitude)))
    middle = weather.data.index + weather.interval / 2
    local = middle.tz_convert(zone)
    month = (middle if weather.zone is None else local).month.to_numpy() - 1
    place = HOURS * month + local.hour.to_numpy()
    # Of n years every nth day is computed, and shall stand for all; the rest is dark.
    days = (middle - middle[0].floor("D")) // pd.Timedelta(days=1)
    kept = days.to_numpy() % max(1, round(energy.years)) == 0
    sums = np.zeros((COUNT, len(names)))
    for times, own, values in _power_of_blocks(
        transfer, weather.darken(~kept), energy, system, building=building, threads=threads
    ):
        cells = sparse.csr_array(
            (np.ones(len(times), np.float32), (place[times], np.arange(len(times)))),
            shape=(COUNT, len(times)),
        )
        sums[:, own] += cells @ values
    # What a month has in the mean of all years, spread over its hours as summed [kWh a year].
    shares = sums.reshape(12, HOURS, -1)
    shares = shares / np.maximum(shares.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    kwp = _power_of_surfaces(transfer, energy)
    rows = np.flatnonzero(kwp)
    by_month = np.zeros((len(names), 12))
    np.add.at(by_month, building[rows], kwp[rows, None] * energy.full_load_hours_by_month[rows])
    # From energy to mean power: how long each cell is in a year [h].
    length = np.bincount(place, minlength=COUNT) * (weather.interval / pd.Timedelta(hours=1))
    length = np.maximum(length / energy.years, np.finfo(float).tiny).reshape(12, HOURS)
    power = by_month[:, :, None] * shares.transpose(2, 0, 1) / length
    return names, power.astype(np.float32), zone


def _number_buildings(transfer):
    """Names of the buildings, in alphabetical order, and the number of each surface's building."""
    return np.unique(
        np.array(transfer.surfaces.building_id, dtype=object).astype(str), return_inverse=True
    )


def _power_of_surfaces(transfer, energy):
    """Nominal power by which the hours of whole surfaces count, (n,) [kWp]; 0 where none counts."""
    return np.where(energy.eligible, energy.kwp_of_hours(transfer.surfaces.area), 0.0)


def _power_of_blocks(transfer, weather, energy, system, *, building, threads):
    """AC power of the modules of some buildings at a time: yields intervals (h,), buildings (k,)
    and their power, (h, k) [kW]. A building may come in several parts.
    """
    kwp = _power_of_surfaces(transfer, energy)
    rows = np.flatnonzero(kwp)
    # Surfaces in the order of buildings, so that a block has few of them.
    rows = rows[np.argsort(building[rows], kind="stable")]
    blocks = [rows[first : first + BLOCK] for first in range(0, len(rows), BLOCK)]

    def share_out(block):
        return np.where(building[block, None] == np.unique(building[block]), kwp[block, None], 0.0)

    # Each state of the trees gives the power of its own hours. What strings lose in shade is only
    # looked at where it counts.
    if system.strings != "string":
        transfer = replace(
            transfer,
            string_loss=None,
            bare=transfer.bare and replace(transfer.bare, string_loss=None),
        )
    for state, own in states_of_year(transfer, weather.data.index, weather.interval):
        year = weather.darken(~own)
        task = prepare_task(state, year, system, kwp > 0, split_sky(year, energy.sky))
        for block, sums in sum_blocks(task, blocks, share_out, threads):
            yield task.hours.interval, np.unique(building[block]), sums.capacity_factor
