"""Charts of what is probed: energy of each month, and the day curve of the year, of June and of December."""

from dataclasses import replace

import numpy as np

from .attributes import PREFIX

CHARTS = PREFIX + "charts"  # property of the city: 12 months [MWh], then 24 hours for each of `CURVES` [kW]
CURVES = {"year": range(1, 13), "June": (6,), "December": (12,)}
MOST = 1000  # surfaces whose hours are computed for the day curve


def chart_surfaces(session, rows):
    """Energy of each month [MWh] and mean power at each hour of local mean solar time [kW]: (12 + 3 · 24,) float64.

    Parameters
    ----------
    session : Session
        With transfer, weather, energy and request.
    rows : (k,) int
        Surfaces. Of more than `MOST` there is no day curve (zeros).
    """
    from ..core.energy.pick_module import area_of_kwp
    from ..core.energy.pv_system import build_system

    energy, area = session.energy, session.transfer.surfaces.area
    counted = rows[np.isfinite(energy.full_load_hours[rows]) & (energy.counted_area[rows] > 0)]
    kwp = energy.module_area[counted] / area_of_kwp(build_system(session.request).module)
    kwp = kwp * area[counted] / energy.counted_area[counted]  # as in sum_potential
    months = kwp @ energy.full_load_hours_by_month[counted] / 1000
    hours = curve_of_day(session, counted, kwp) if 0 < len(counted) <= MOST else np.zeros((len(CURVES), 24))
    return np.concatenate([months, hours.ravel()])


def curve_of_day(session, rows, kwp):
    """Mean power at each hour of local mean solar time, in the months of each of `CURVES`: (3, 24) float64 [kW].

    Parameters
    ----------
    session : Session
    rows : (k,) int
    kwp : (k,) float64
        Nominal power of each surface [kWp].
    """
    from ..core.light.transfer import take_rows
    from ..core.study import compute_energy
    from ..core.sun.solar_days import local_middle

    transfer = take_rows(session.transfer, rows)
    request = replace(session.request, series=tuple(transfer.surfaces.surface_id))
    energy = compute_energy(transfer, session.weather, request)
    power = energy.series.capacity_factor @ kwp
    middle = local_middle(energy.times, energy.interval, energy.longitude)
    hour, month = middle.hour.to_numpy(), middle.month.to_numpy()
    curves = np.zeros((len(CURVES), 24))
    for row, months in enumerate(CURVES.values()):
        inside = np.isin(month, months)
        count = np.bincount(hour[inside], minlength=24)
        curves[row] = np.bincount(hour[inside], power[inside], 24) / np.maximum(count, 1)
    return curves


def read_charts(city):
    """Months (12,) [MWh] and curves (3, 24) [kW] of what was probed last, or None."""
    values = city.get(CHARTS) if city is not None else None
    if values is None:
        return None
    values = np.array(values)
    return values[:12], values[12:].reshape(len(CURVES), 24)
