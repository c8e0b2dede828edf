"""Buildings that stand far above or below all around them: −9999 where a survey had no height, 0 in
the mountains.
"""

import numpy as np
from scipy.spatial import cKDTree

from ..settings.errors import count_of, list_some
from .city import number_names
from .judge_sizes import NAMES, TALLEST, likely_units
from .polygons import measure_polygons, polygon_bounds

EARTH = (-600.0, 9500.0)  # [m] nothing is built lower or higher: the Dead Sea's shore is at −430 m
STRAY_TREE = "tree at a height that the Earth does not have: left out"


def find_strays(city, report):
    """Polygons of buildings to keep: all but those that stand far above or below what is around
    them.

    Bases of neighbours differ by no more than their distance and 200 m. A base is a stray if it is
    not so for most of the nearest 16, or if the building lies outside all heights of the Earth, or
    is over 1,500 m high. Where most buildings are such, as in a city in millimetres, none is.

    Parameters
    ----------
    city : City
    report : ImportReport
        Buildings that are left out are added, and are not counted any more; others that are over
        1,000 m high are named in a note.

    Returns
    -------
    array, (n,) bool
    """
    # Lowest and highest point of each building.
    building = number_names(city.building_id)
    low, high = polygon_bounds(city.points, city.ring_start, city.polygon_start)
    count = building.max(initial=-1) + 1
    lowest, highest = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(lowest, building, low)
    np.maximum.at(highest, building, high)
    base, top = lowest[:, 2], highest[:, 2]
    # What no building on Earth has; if most have it, it is the unit that is wrong, not the
    # building.
    stray = (base < EARTH[0]) | (top > EARTH[1]) | (top - base > 1500.0)
    if 2 * stray.sum() >= count:
        stray[:] = False
    # Base against the 16 nearest in plan: further off than their distance and 200 m, for most of
    # them.
    nearest = min(16, count - 1)
    if nearest > 1 and np.ptp(base[~stray]) > 200.0:
        distance, neighbour = cKDTree(0.5 * (lowest + highest)[:, :2]).query(
            0.5 * (lowest + highest)[:, :2], nearest + 1
        )
        far = np.abs(base[neighbour[:, 1:]] - base[:, None]) > 200.0 + distance[:, 1:]
        stray |= 2 * far.sum(axis=1) > nearest
    # Strays leave the city, and are told.
    gone = stray[building]
    if gone.any():
        names = list(
            dict.fromkeys(name for name, out in zip(city.building_id, gone, strict=True) if out)
        )
        report.skip(
            "heights that no building around it has: not believed, left out",
            names,
            measure_polygons(*city.shape)[0][gone].sum(),
        )
        report.building_count -= len(names)
    tall = np.flatnonzero((top - base > TALLEST) & ~stray)
    # Where most are, and no reference system tells the unit, a note on units stands already.
    if len(tall) and (city.crs is not None or 2 * len(tall) < count):
        names = list(dict.fromkeys(city.building_id))
        height = float(np.median((top - base)[tall]))
        likely = " or ".join(NAMES[unit] for unit in likely_units(height))
        meant = f" Heights in {likely}?" if likely else ""
        report.notes.append(
            f"{count_of(len(tall), 'building')} over 1,000 m high, half of them over {height:,.0f} "
            "m, which none on "
            f"Earth is; read as drawn: {list_some([names[k] for k in tall])}.{meant} Correct their "
            "heights."
        )
    return ~gone


def is_on_earth(points):
    """Whether all heights of points, (m, 3) float64 [m], are such as the Earth has."""
    return bool((points[:, 2] > EARTH[0]).all() and (points[:, 2] < EARTH[1]).all())
