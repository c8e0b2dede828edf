"""Transform horizontal coordinates between coordinate reference systems, and find the unit of heights."""

import numpy as np
import pyproj

from ..settings.errors import InputError


def plane_of(crs):
    """Horizontal part of a coordinate reference system, and metres per unit of its heights.

    Heights have the unit of the vertical axis or, without one, of the horizontal axes; metres if those are in degrees.

    Returns
    -------
    pyproj.CRS, float
    """
    system = pyproj.CRS.from_user_input(crs)
    plane = system.sub_crs_list[0] if system.is_compound else system.to_2d()
    if system.is_compound:
        return plane, system.sub_crs_list[1].axis_info[0].unit_conversion_factor
    if len(system.axis_info) > 2:
        return plane, system.axis_info[2].unit_conversion_factor
    return plane, 1.0 if plane.is_geographic else plane.axis_info[0].unit_conversion_factor


def bring_places(places, source, target, path):
    """Transform points, east first, from one coordinate reference system to another.

    Parameters
    ----------
    places : array, (k, 2) float64
        In the units of the source system.
    source, target : str or pyproj.CRS
    path : path-like
        For error messages.

    Returns
    -------
    places : array, (k, 2) float64

    Raises
    ------
    InputError
        A point lies outside the area in which the target system is defined.
    """
    (source, _), (target, _) = plane_of(source), plane_of(target)
    turn = pyproj.Transformer.from_crs(source, target, always_xy=True)
    there = np.column_stack(turn.transform(*np.asarray(places, float).T))
    if not np.isfinite(there).all():
        raise InputError(path, f"does not lie where {target.name} is defined", "give terrain that covers the city")
    return there


def full_turn(crs):
    """What longitudes of a system in degrees grow by around the Earth; None for any other system."""
    plane, _ = plane_of(crs)
    return 2 * np.pi / plane.axis_info[0].unit_conversion_factor if plane.is_geographic else None


def turn_towards(longitude, middle, turn):
    """The same longitudes, each no further than half a turn from a middle one: a map may go on beyond 180°."""
    return middle + (longitude - middle + turn / 2) % turn - turn / 2
