"""Coordinate reference systems: the plane in true metres that a city stands in, and the ways
between it and its files.

Files have the units, the directions and the order of axes of their own system. A city has metres, x
east, y north.
"""

import copy
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pyproj
from pyproj.crs import ProjectedCRS
from pyproj.crs.coordinate_operation import TransverseMercatorConversion

from ..settings.errors import InputError

UNITS = {"m": 1.0, "ft": 0.3048, "us-ft": 1200 / 3937, "mm": 0.001, "cm": 0.01, "in": 0.0254}  # [m]
LOCAL = "local transverse Mercator"  # name of a plane around the middle of a city


@lru_cache(maxsize=64)  # of PROJ's slower ways
def plane_of(crs):
    """Horizontal part of a coordinate reference system, and metres per unit of its heights.

    Heights have the unit of the vertical axis or, without one, of the horizontal axes; metres if
    those are in degrees.

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


def transform_crs(places, source, target, path=None):
    """Transform points, east first, from one coordinate reference system to another.

    Parameters
    ----------
    places : array, (k, 2) float64
        In the units of the source system.
    source, target : str or pyproj.CRS
    path : path-like, optional
        Named in the error.

    Returns
    -------
    places : array, (k, 2) float64
        Infinite outside the area in which the target system is defined, where no path is given.

    Raises
    ------
    InputError
        A point lies there.
    """
    (source, _), (target, _) = plane_of(source), plane_of(target)
    turn = pyproj.Transformer.from_crs(source, target)
    there = _transform(turn, _as_registered(np.asarray(places, float), source, "xy")).T
    there = _as_registered(there, target, "xy")
    if path is not None and not np.isfinite(there).all():
        raise InputError(
            path,
            f"does not lie where {target.name} is defined",
            "give terrain that covers the city",
        )
    return there


@lru_cache(maxsize=64)
def _globe_of(plane):
    """Latitude and longitude, in degrees from Greenwich, on the datum of a plane: pyproj.CRS."""
    own = plane.geodetic_crs.to_2d()
    usual = own.axis_info[0].direction == "north" and own.axis_info[0].unit_name == "degree"
    if usual and own.prime_meridian is not None and own.prime_meridian.longitude == 0:
        return own
    members = copy.deepcopy(own.to_json_dict())
    members.pop("id", None)
    for key in ("datum", "datum_ensemble"):
        members.get(key, {}).pop("prime_meridian", None)
    axes = [
        {"name": name, "abbreviation": short, "direction": direction, "unit": "degree"}
        for name, short, direction in (("Latitude", "lat", "north"), ("Longitude", "lon", "east"))
    ]
    return pyproj.CRS.from_json_dict(
        members | {"coordinate_system": {"subtype": "ellipsoidal", "axis": axes}}
    )


def find_globe_places(places, plane, axes="xy"):
    """Latitudes and longitudes of points of a plane.

    Parameters
    ----------
    places : array, (k, 2) float64
        In the units of the plane.
    plane : pyproj.CRS
    axes : {'xy', 'yx'}
        Which of the two coordinates stands first: that along the meridian ('yx') or the other one.

    Returns
    -------
    latitude, longitude : array, (k,) float64 [°]
        Infinite where the plane does not hold.
    """
    return _transform(_turn_to_globe(plane), _as_registered(np.asarray(places, float), plane, axes))


def _transform(turn, places):
    # As lists: pyproj tries to make a number of an array with one point, and NumPy below 2.4 warns
    # of it.
    return np.array(turn.transform(*places.T.tolist()))


@lru_cache(maxsize=64)
def _turn_to_globe(plane):
    return pyproj.Transformer.from_crs(plane, _globe_of(plane))


def registered_axes(plane):
    """The order in which the registry has the axes of a plane: 'yx' where that along the meridian
    is the first.
    """
    first, second = plane.axis_info[:2]
    if second.direction in ("north", "south") and first.direction in (
        "north",
        "south",
    ):  # around a pole
        return "yx" if first.abbrev.upper() == "N" else "xy"
    return "yx" if first.direction in ("north", "south") else "xy"


def _as_registered(points, plane, axes):
    """Points brought from one order of axes to the registry's, or back."""
    return (
        points if axes == registered_axes(plane) else points[:, [1, 0, *range(2, points.shape[1])]]
    )


@dataclass(frozen=True)
class Grid:
    """The system of files, and the plane in true metres, x east, y north, in which their city
    stands.
    """

    # of the files, as accepted by pyproj.CRS.from_user_input; None if they give none
    crs: str | None = None
    # which coordinate stands first in them: 'xy' or, that along the meridian, 'yx'
    axes: str = "xy"
    plane: str | None = None  # as crs; None where the plane is the system's own

    def to_plane(self, points):
        """Points of the files, (m, 3) float64, in the plane [m]."""
        system, factor = plane_of(self.crs)
        heights = points[:, 2] * factor
        if self.plane is None:
            places = points[:, :2] if self.axes == "xy" else points[:, 1::-1]
        else:
            places = transform_crs(
                points[:, :2] if self.axes == "xy" else points[:, 1::-1], system, self.plane
            )
        return np.column_stack([places, heights])

    def to_files(self, points, axes=None):
        """Points of the plane, (m, 3) float64 [m], in the system of the files, in their order or in
        another one.
        """
        axes = axes or self.axes
        if self.crs is None:
            return points
        system, factor = plane_of(self.crs)
        places = points[:, :2]
        if self.plane is not None:
            places = transform_crs(places, self.plane, system)
        return np.column_stack([places if axes == "xy" else places[:, ::-1], points[:, 2] / factor])

    def measure_scale(self, place):
        """Scale of the system of the files along east and north at a place of the plane, (3,): two
        float; infinite where it does not hold, 1 without a system and for degrees.
        """
        if self.crs is None or plane_of(self.crs)[0].is_geographic:
            return np.ones(2)
        middle = self.to_files(np.array([place]), "xy")[0, :2]
        return _measure_steps(plane_of(self.crs)[0], middle, "xy")[0]


def choose_plane(crs, axes, points, source=None):
    """The plane in true metres for points of files.

    Their own system's where it has metres, x east, y north, and a scale within 0.3 % of 1 at the
    middle of the points; the same projection in metres where only the unit differs; else a
    transverse Mercator around that middle.

    Parameters
    ----------
    crs : str
    axes : {'xy', 'yx'}
    points : array, (m, 3) float64
        In the order and the units of the files.
    source : path-like, optional
        The file, named in errors; else the system is.

    Returns
    -------
    Grid
    note : str or None
        What was done, as a sentence; None where nothing was, or without points.

    Raises
    ------
    InputError
        The points have no place on Earth: beyond 90 or 360 degrees, or too far apart for one plane.
    """
    system, _ = plane_of(crs)
    # Without points there is nothing to judge: the file's own plane stays.
    if not len(points):
        return Grid(crs, axes), None
    # Degrees have no scale of metres: a plane around their middle takes their place.
    middle = 0.5 * (points[:, :2].min(axis=0) + points[:, :2].max(axis=0))
    if system.is_geographic:
        _check_degrees(_east_first(points, axes), system, source)
        note = f"Degrees of {system.name} projected to metres around their middle."
        grid = Grid(crs, axes, _local_plane(system, middle, axes, source))
    else:
        # Metres in the file's own plane stay where a step on it is as long as on Earth, and points
        # east and north; other units are only converted.
        unit = system.axis_info[0].unit_conversion_factor
        scale, turned = _measure_steps(system, middle, axes)
        directions = {axis.direction for axis in system.axis_info[:2]}
        # A step may be 0.3 % longer or shorter than on Earth: less than any error of the light.
        straight = (
            directions == {"east", "north"} and not turned and (np.abs(scale - 1) <= 0.003).all()
        )
        # What is straight stays, and where no step can be measured as well; units other than metres
        # are converted.
        if straight or not np.isfinite(scale).all():
            if unit == 1:
                return Grid(crs, axes), None
            note = f"Coordinates converted from {system.axis_info[0].unit_name} to metres."
            return Grid(crs, axes, _in_metres(system)), note
        # Anything else is brought to a plane of its own, and why is told.
        scales = " and ".join(f"{value:.4g}" for value in scale)
        why = f"has a scale of {scales} along east and north here"
        if directions != {"east", "north"} or turned:
            why = f"counts to the {' and '.join(axis.direction for axis in system.axis_info[:2])}"
        note = (
            f"{system.name} {why}: the city was brought to true metres east and north; what is "
            "written is as read."
        )
        grid = Grid(crs, axes, _local_plane(system, middle, axes, source))
    return grid, note


def _measure_steps(plane, middle, axes, *, step=100.0):
    """Scale of a plane along its two axes at a place, and whether they are left-handed, so that all
    would be mirrored.

    Parameters
    ----------
    plane : pyproj.CRS
        Projected.
    middle : (2,) float64
    axes : {'xy', 'yx'}

    Returns
    -------
    scale : array, (2,) float64
        Metres of the plane in one of the Earth, along x and along y; infinite where the plane does
        not hold.
    left_handed : bool
    """
    unit = plane.axis_info[0].unit_conversion_factor
    x, y = middle if axes == "xy" else middle[::-1]
    # A step is large against rounding, small against the curvature of a parallel.
    places = np.array([[x, y], [x + step / unit, y], [x, y + step / unit]])
    latitude, longitude = find_globe_places(places, plane)
    if not (np.isfinite(latitude).all() and np.isfinite(longitude).all()):
        return np.full(2, np.inf), False
    start = np.repeat([longitude[0]], 2), np.repeat([latitude[0]], 2)
    azimuth, _, length = plane.get_geod().inv(*start, longitude[1:], latitude[1:])
    # Clockwise from the step along x to that along y: 270° where x is a quarter turn right of y.
    quarter = (azimuth[1] - azimuth[0]) % 360
    return step / np.asarray(length), quarter < 180


def _east_first(points, axes):
    return points if axes == "xy" else points[:, [1, 0, 2]]


def _check_degrees(points, system, source):
    """Raise an error where degrees are beyond what there is, or too far apart for one plane."""
    unit = np.degrees(system.axis_info[0].unit_conversion_factor)
    low, high = points[:, :2].min(axis=0) * unit, points[:, :2].max(axis=0) * unit
    if max(-low[1], high[1]) > 90 or max(-low[0], high[0]) > 360:
        problem = f"{system.name} has degrees, but its coordinates are beyond 90 or 360"
        raise InputError(source or system.name, problem, "correct the srsName")
    if high[0] - low[0] > 60 or high[1] - low[1] > 60:
        places = " and ".join(
            f"{first:g} to {last:g}" for first, last in zip(low, high, strict=True)
        )
        problem = f"longitudes and latitudes of {places}: too far apart for one plane"
        raise InputError(
            source or system.name, problem, "correct the coordinates, or give one city at a time"
        )


def _local_plane(system, middle, axes, source):
    """Transverse Mercator with scale 1 at a place of a system, on its datum: WKT."""
    (latitude,), (longitude,) = find_globe_places([middle], system, axes)
    if not np.isfinite([latitude, longitude]).all():
        raise InputError(
            source or system.name,
            f"the point {middle[0]:g}, {middle[1]:g} lies outside {system.name}",
            "correct the srsName, or the coordinates",
        )
    # Some metres beside the middle the scale is the same, and a city that was written has the same
    # plane again.
    conversion = TransverseMercatorConversion(round(latitude, 4), round(longitude, 4), 0, 0, 1)
    return ProjectedCRS(conversion, LOCAL, geodetic_crs=_globe_of(system)).to_wkt()


def _in_metres(system):
    """Write the projection of a system with metres, x east, y north: WKT."""
    members = copy.deepcopy(system.to_json_dict())
    members.pop("id", None)
    axes = [
        {"name": name, "abbreviation": name[0], "direction": direction, "unit": "metre"}
        for name, direction in (("Easting", "east"), ("Northing", "north"))
    ]
    members |= {
        "name": f"{system.name}, in metres",
        "coordinate_system": {"subtype": "Cartesian", "axis": axes},
    }
    return pyproj.CRS.from_json_dict(members).to_wkt()
