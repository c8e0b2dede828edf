"""Where a scene stands: latitude, longitude and true north of its place, and the way from its files
to its own frame.

The frame has a local origin and y to true north; meridian convergence is the azimuth of grid north
from true north.
"""

import math

import numpy as np

from ..settings.errors import InputError
from .axis_order import MARGIN
from .site import Site
from .transform_crs import find_globe_places, plane_of


def locate_site(crs, point, latitude=None, longitude=None, *, source=None):
    """Latitude, longitude and meridian convergence of a point.

    The convergence is the ellipsoidal azimuth of a short step to grid north, which avoids differing
    sign conventions. It belongs to the system at the point, also where another latitude or
    longitude is given: walls that face true south do so wherever the city is set up.

    Parameters
    ----------
    crs : str or None
        As accepted by pyproj.CRS.from_user_input; planar, in metres, x east, y north.
    point : sequence of float, (2,) or (3,) [m]
        East and north in that system.
    latitude, longitude : float, optional
        [°] Given by the user; override the system's.
    source : path-like, optional
        The file, named in errors; else the system is.

    Returns
    -------
    latitude, longitude : float or None
        [°] None if neither the system nor the user gives them.
    convergence : float
        [°] Azimuth of grid north from true north; 0 without a system, or where it does not hold.

    Raises
    ------
    InputError
        Latitude or longitude is out of range, or only one of them is given and there is no system;
        or the point lies outside the system, and not both are given.
    """
    for name, value, bound in (("latitude", latitude, 90), ("longitude", longitude, 360)):
        if value is not None and not abs(value) <= bound:  # also true for NaN
            raise InputError(
                f"--{name}",
                f"{value} is out of range",
                f"give degrees between -{bound} and {bound}",
            )
    # Without a system the user's word counts, and grid north is taken as true north.
    if crs is None:
        if (latitude is None) != (longitude is None):
            missing = "longitude" if longitude is None else "latitude"
            problem = "is missing, and the files have no coordinate reference system"
            raise InputError(f"--{missing}", problem, "give both --latitude D --longitude D")
        return latitude, longitude, 0.0
    plane, _ = plane_of(crs)
    # A step of 100 m north on the grid is large against rounding, small against the curvature of a
    # meridian.
    steps = np.array([[point[0], point[1]], [point[0], point[1] + 100.0]])
    here, north = np.column_stack(find_globe_places(steps, plane)[::-1])
    # Where the system does not hold, the user's place counts, with grid north as true north;
    # without one the point is refused.
    if not all(math.isfinite(value) for value in (*here, *north)):
        if latitude is not None and longitude is not None:
            # the system does not hold there, so neither does its north
            return (
                latitude,
                longitude,
                0.0,
            )
        problem = f"the point {point[0]:.0f}, {point[1]:.0f} lies outside {plane.name}"
        raise InputError(
            source or plane.name, problem, "correct the srsName, or give --latitude and --longitude"
        )
    # Azimuth of that step on the ellipsoid: the convergence.
    azimuth, _, _ = plane.get_geod().inv(*here, *north)
    latitude = float(here[1]) if latitude is None else latitude
    longitude = float(here[0]) if longitude is None else longitude
    return latitude, longitude, float(azimuth)


def note_outside_use(crs, latitude, longitude):
    """Say that a place lies far outside the area for which its system is made.

    Coordinates that are local, or of another system, put it there: 0, 0 of the Dutch grid is in
    France.

    Parameters
    ----------
    crs : str or None
    latitude, longitude : float or None
        [°]

    Returns
    -------
    list of str
        A sentence for the report, or none.
    """
    if crs is None or latitude is None or (area := plane_of(crs)[0].area_of_use) is None:
        return []
    width = (area.east - area.west) % 360 or 360.0
    past_west = (longitude - area.west) % 360  # [°] eastwards from its western edge
    outside = max(
        area.south - latitude, latitude - area.north, min(past_west - width, 360 - past_west), 0.0
    )
    if outside <= MARGIN:
        return []
    place = (
        f"The city, at latitude {latitude:.3f}°, longitude {longitude:.3f}°, lies {outside:.1f}° "
        "outside"
    )
    cure = "If its coordinates are local, or of another system, give --latitude and --longitude."
    return [f"{place} the area of use of {crs} ({plane_of(crs)[0].name}). {cure}"]


AS_IN_FILES = Site(None, None, 0.0, 0.0, None, (0.0, 0.0, 0.0))
