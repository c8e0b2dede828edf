"""Convert coordinates in degrees or feet to planar metres, x east, y north."""

import warnings

import numpy as np
import pyproj

from ..settings.errors import InputError

UNITS = {"m": 1.0, "ft": 0.3048, "us-ft": 1200 / 3937}  # [m]


def convert_to_metres(points, crs, unit="m"):
    """Points in metres, and the coordinate reference system they are then in.

    Degrees are projected to a transverse Mercator plane centred on the points, with scale 1 there. Feet become metres
    of the same projection; heights have the unit of the vertical axis or, without one, of the horizontal axes.

    Parameters
    ----------
    points : array, (m, 3) float64
        In the units and the axis order of the file.
    crs : str or None
    unit : {'m', 'ft', 'us-ft'}
        For points without a coordinate reference system.

    Returns
    -------
    points : array, (m, 3) float64 [m]
    crs : str or None
    note : str or None
        What was converted, as a sentence.

    Raises
    ------
    InputError
        The unit is not known, or the points cannot be projected to a plane: geocentric coordinates, beyond 90 or 360
        degrees, or too far apart.
    """
    if unit not in UNITS:
        raise InputError("--unit", f"{unit!r} is not known", f"choose one of {', '.join(UNITS)}")
    if crs is None:
        note = None if unit == "m" else f"Coordinates converted from {unit} to metres."
        return points * UNITS[unit], None, note
    system = pyproj.CRS.from_user_input(crs)
    plane = system.sub_crs_list[0] if system.is_compound else system
    if plane.is_geographic:
        return _project(points, system, plane)
    if plane.is_geocentric:
        raise InputError(crs, "geocentric coordinates are not supported", "project them to a plane first")
    factor = plane.axis_info[0].unit_conversion_factor
    height_factor = _height_factor(system, factor)
    points, turned = east_first(points, plane)
    if factor == 1 and height_factor == 1:
        return points, crs, turned
    name = plane.axis_info[0].unit_name
    note = f"Coordinates converted from {name} to metres."
    return points * [factor, factor, height_factor], _in_metres(plane), " ".join(filter(None, [note, turned]))


def _height_factor(system, plane_factor):
    if system.is_compound:
        return system.sub_crs_list[1].axis_info[0].unit_conversion_factor
    if len(system.axis_info) > 2:
        return system.axis_info[2].unit_conversion_factor
    return plane_factor


def _in_metres(plane):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # PROJ strings lose the name of the system, not its numbers
        words = plane.to_proj4().split()
    words = [word for word in words if not word.startswith(("+units=", "+to_meter=", "+type="))]
    return " ".join([*words, "+units=m", "+type=crs"])


def _project(points, system, plane):
    """Degrees to metres around the middle of the points."""
    points, _ = east_first(points, plane)
    longitude, latitude = points[:, 0], points[:, 1]
    if len(points) and (np.abs(latitude).max() > 90 or np.abs(longitude).max() > 360):
        raise InputError(system.name, "degrees expected, the coordinates are beyond 90 or 360", "correct the srsName")
    middle = [0.5 * (values.min() + values.max()) if len(points) else 0.0 for values in (longitude, latitude)]
    ellipsoid = plane.ellipsoid
    shape = f"+a={ellipsoid.semi_major_metre:.10g} +rf={ellipsoid.inverse_flattening:.12g}"
    local = f"+proj=tmerc +lon_0={middle[0]:.9f} +lat_0={middle[1]:.9f} +k=1 {shape} +units=m +type=crs"
    east, north = pyproj.Proj(local)(longitude, latitude)
    if not (np.isfinite(east).all() and np.isfinite(north).all()):
        places = " and ".join(f"{values.min():g} to {values.max():g}" for values in (longitude, latitude))
        problem = f"longitudes and latitudes of {places}: too far apart for one plane"
        raise InputError(system.name, problem, "correct the coordinates, or give one city at a time")
    note = f"Degrees of {system.name} projected to metres around their middle."
    height = points[:, 2] * (_height_factor(system, 1.0) if len(system.axis_info) > 2 else 1.0)
    return np.column_stack([east, north, height]), local, note


def _within(longitude, latitude, area, margin=1.0):
    inside = (longitude >= area.west - margin) & (longitude <= area.east + margin)
    return bool((inside & (latitude >= area.south - margin) & (latitude <= area.north + margin)).all())


def east_first(points, plane):
    """Points with east before north, swapped if needed.

    Degrees are in the axis order of their system, unless only the other order is within its area of use. Most files
    with planar systems give east first, whatever the registry's axis order.

    Parameters
    ----------
    points : array, (m, 3) float64
    plane : pyproj.CRS
        The horizontal part of their system.

    Returns
    -------
    points : array, (m, 3) float64
    note : str or None
        What was done against expectation, as a sentence.
    """
    area = plane.area_of_use
    if plane.is_geographic:
        turned = points[:, [1, 0, 2]]
        points, other = (points, turned) if plane.axis_info[0].direction == "east" else (turned, points)
        swap = area is not None and not _within(*points[:, :2].T, area) and _within(*other[:, :2].T, area)
        return (other if swap else points), None
    if area is None or not len(points):
        return points, None
    back = pyproj.Transformer.from_crs(plane, plane.geodetic_crs, always_xy=True)
    x, y = np.median(points[:, 0]), np.median(points[:, 1])
    if _within(*_arrays(back.transform(x, y)), area) or not _within(*_arrays(back.transform(y, x)), area):
        return points, None
    return points[:, [1, 0, 2]], "Coordinates are north first in the file; swapped to east first."


def _arrays(pair):
    return np.array([pair[0]]), np.array([pair[1]])
