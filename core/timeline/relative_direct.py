"""Direct irradiance per DNI of the surfaces under any sun, from the traced suns that represent it."""

import numpy as np

from ..energy.fill_behind import filled_share, order_neighbours
from ..horizon.horizon import is_above
from ..sun.match_suns import match_suns
from ..sun.solar_position import is_sunny, solar_position, sun_direction
from ..sun.values_at import largest_mismatch, values_at

BLOCK = 1024  # surfaces at a time


def relative_direct(transfer, times, interval, latitude, longitude):
    """Direct irradiance of surfaces per DNI, with all reflections of it.

    Angles of incidence are those of mid-interval, visible shares and reflections those of the traced suns that
    represent it, as in `energy.compute_energy`.

    Parameters
    ----------
    transfer : Transfer
        Of n surfaces.
    times : pandas.DatetimeIndex, (t,)
        Starts of the intervals, tz-aware.
    interval : pandas.Timedelta
    latitude, longitude : float
        Of the place [°].

    Returns
    -------
    relative : numpy.ndarray, (t, n) float32
        0 while the sun is below 2° or behind distant terrain.
    direction : numpy.ndarray, (t, 3)
        Towards the sun.
    """
    sun = solar_position(times, interval, latitude, longitude)
    direction = sun_direction(sun["apparent_zenith"], sun["solar_azimuth"])
    lit = is_sunny(sun["apparent_zenith"]) & is_above(transfer.terrain, direction)
    relative = np.zeros((len(times), len(transfer.surfaces)), np.float32)
    if not lit.any():
        return relative, direction
    for state, own in _states(transfer, (times + interval / 2).month.to_numpy()):
        rows = np.flatnonzero(lit & own)
        match = match_suns(state.suns, times, interval, latitude, longitude, position=sun)
        relative[rows] = _add_blocks(state, direction[rows], match.index[rows], match.weight[rows])
    return relative, direction


def _states(transfer, month):
    # Trees carry leaves in some months and not in the others.
    if transfer.bare is None:
        return [(transfer, np.ones(len(month), bool))]
    in_leaf = np.isin(month, transfer.leaf_months)
    return [(transfer, in_leaf), (transfer.bare, ~in_leaf)]


def _add_blocks(transfer, direction, index, weight):
    # (t, n): direct sunlight, light by way of the open ground, and all other reflections of sunlight.
    suns, surfaces = transfer.suns, transfer.surfaces
    neighbours, found = order_neighbours(suns), np.empty((len(direction), len(surfaces)), np.float32)
    match, reach = (index, weight), largest_mismatch(suns, direction, index, weight)
    height = np.maximum(direction[:, 2:], 0.0)
    for first in range(0, len(surfaces), BLOCK):
        rows = slice(first, first + BLOCK)
        normal = surfaces.normal[rows].T
        visible = filled_share(transfer, rows, neighbours, reach)
        part = values_at(visible, *match) * np.maximum(direction @ normal, 0)
        part += values_at(np.asarray(transfer.direct_reflected[rows]).T, *match)
        found[:, rows] = part + height * (transfer.far_ground_view_factor[rows] * transfer.ground_albedo)
    return found
