"""Places of a world: points of a grid, or stations."""

from dataclasses import dataclass

import numpy as np

from ..settings.errors import InputError

SOUTH, NORTH, WEST, EAST = -60.0, 90.0, -180.0, 180.0  # the paper's band


@dataclass
class Places:
    """The p places of a world, row by row if they are a grid."""

    latitude: np.ndarray  # (p,) [°]
    longitude: np.ndarray  # (p,) [°], from -180 to below 180
    rows: np.ndarray | None = None  # (a,) latitudes of the grid, ascending; None for stations
    columns: np.ndarray | None = None  # (b,) its longitudes, ascending
    names: list | None = None  # (p,) str of stations

    def __len__(self):
        return len(self.latitude)


def grid_places(rows, columns):
    """All points of a grid.

    Parameters
    ----------
    rows, columns : numpy.ndarray
        Latitudes and longitudes [°], ascending.

    Returns
    -------
    Places
    """
    latitude, longitude = np.repeat(rows, len(columns)), np.tile(columns, len(rows))
    return Places(latitude, longitude, rows, columns)


def regular_axes(step, latitudes=None, longitudes=None):
    """Latitudes and longitudes at multiples of a step.

    Parameters
    ----------
    step : float
        [°]
    latitudes, longitudes : tuple of float, optional
        First and last [°]; by default 60° S to 90° N, and all around. Longitudes from east to west cross the date line.

    Returns
    -------
    rows, columns : numpy.ndarray
        Ascending; -180° stands for 180° too.
    """
    check_region(latitudes, longitudes)
    south, north = latitudes or (SOUTH, NORTH)
    west, east = longitudes or (WEST, EAST)
    rows, columns = multiples(south, north, step), multiples(west, east + 360.0 * (east < west), step)
    columns = np.unique(np.where(columns >= 180.0, columns - 360.0, columns))
    return rows, columns


def check_region(latitudes=None, longitudes=None):
    """Refuse a region that is empty or not on Earth; parameters as of `regular_axes`."""
    if latitudes:
        check_range("--latitudes", *latitudes, 90.0)
    if longitudes:  # 170 to -170° is across the date line
        check_range("--longitudes", min(longitudes), max(longitudes), 180.0)


def check_range(option, first, last, most):
    """Refuse a range that is empty or not on Earth."""
    if not (-most <= first <= last <= most):
        raise InputError(
            option, f"{first:g} to {last:g} is no range", f"give two ascending numbers from -{most:g} to {most:g}"
        )


def multiples(first, last, step):
    """Numbers from the first to at most the last, a step apart."""
    return first + step * np.arange(int(np.floor((last - first) / step + 1e-9)) + 1)


def thin_axis(axis, step, limits):
    """Positions of the points of an axis within limits and about a step apart.

    Parameters
    ----------
    axis : numpy.ndarray
        Ascending [°].
    step : float or None
        [°]; None takes all.
    limits : tuple of float or None

    Returns
    -------
    numpy.ndarray of int
    """
    first, last = limits or (-np.inf, np.inf)
    above, below = axis >= first - 1e-6, axis <= last + 1e-6
    # From 170 to -170° is across the date line.
    inside = np.flatnonzero(above & below if first <= last else above | below)
    if step is None or len(axis) < 2:
        return inside
    stride = max(1, round(step / np.diff(axis).min()))
    gap = np.diff(axis[inside])
    # A region across the date line is in two parts: count from its western edge.
    start = gap.argmax() + 1 if len(gap) and gap.max() > 1.5 * np.median(gap) else 0
    return np.sort(np.roll(inside, -start)[::stride])
