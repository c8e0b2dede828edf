"""Coordinate reference systems: names as pyproj knows them, east before north, metres; and from one to another.

Points in degrees or feet become planar metres, x east, y north.
"""

import re
import warnings

import numpy as np
import pyproj

from ..settings.errors import InputError

UNITS = {"m": 1.0, "ft": 0.3048, "us-ft": 1200 / 3937}  # [m]
# Names used by German surveys; the vertical system follows after "*".
SURVEYS = "urn:adv:crs:"
ADV_NAMES = {
    r"ETRS89_UTM(\d\d)": lambda zone: f"EPSG:258{zone}",
    r"DE_DHDN_3GK(\d)": lambda zone: f"EPSG:3146{4 + int(zone)}",
}
# Swiss files often name the datum only; the size of coordinates tells LV03 (6 digits) from LV95 (7 digits).
SWISS_NAMES = ("CH1903", "CH1903+", "LV03", "LV95")


def name_crs(srs_name, easting=None):
    """Name of a coordinate reference system for pyproj.

    Parameters
    ----------
    srs_name : str
        As in the file: ``EPSG:25833``, ``urn:ogc:def:crs:EPSG::25833``,
        ``urn:adv:crs:ETRS89_UTM32*DE_DHHN2016_NH``, ``http://www.opengis.net/def/crs/EPSG/0/6697``, ``CH1903``, …
    easting : float, optional
        First coordinate of any point [units of the system]; distinguishes the Swiss grids.

    Returns
    -------
    str or None
        None if the spelling is not known to us or to PROJ.
    """
    text = srs_name.strip()
    for name in _candidates(text, easting):
        try:
            pyproj.CRS.from_user_input(name)
        except pyproj.exceptions.CRSError:
            continue
        return name
    return None


def choose_crs(srs_names, easting, path):
    """The one coordinate reference system that a file names.

    Parameters
    ----------
    srs_names : dict
        Spelling -> line in the file.
    easting : float or None
        As of `name_crs`.
    path : path-like

    Returns
    -------
    str or None
        None if it names none that is known.
    dict
        Spellings that are not known, and their lines.

    Raises
    ------
    InputError
        It names two.
    """
    named, unknown = {}, {}
    for srs_name, line in srs_names.items():
        crs = name_crs(srs_name, easting)
        if crs is None:
            unknown[srs_name] = line
        else:
            named.setdefault(crs, f"{srs_name!r} (line {line})")
    if len({crs.split("+")[0] for crs in named}) > 1:
        problem = f"uses two coordinate reference systems: {' and '.join(list(named.values())[:2])}"
        raise InputError(path, problem, "convert it to one of them")
    return max(named, key=len, default=None), unknown


def _candidates(text, easting):
    lowered = text.lower()
    if text.upper() in SWISS_NAMES:
        seven_digits = easting is not None and abs(easting) > 1e6
        yield "EPSG:2056" if seven_digits or (easting is None and text != "CH1903") else "EPSG:21781"
    word = text[len(SURVEYS) :].split("*")[0] if lowered.startswith(SURVEYS) else ""
    for pattern, write in ADV_NAMES.items():
        if match := re.fullmatch(pattern, word, re.IGNORECASE):
            yield write(match[1])
    # A code is the last number after each "EPSG", whatever stands between (version, colons, slashes).
    words = [word for piece in lowered.split("epsg")[1:] for word in re.split(r"[:/#?&,+*; ]+|crs$", piece)]
    codes = [word for word in words if re.fullmatch(r"\d{4,6}", word)][:2]
    if codes:
        yield "EPSG:" + "+".join(codes)
        yield f"EPSG:{codes[0]}"
    if lowered.startswith(("urn:", "http")) or (not codes and re.search(r"\d", text)):
        yield text


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


def transform_crs(places, source, target, path):
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
    plane, height_factor = system.sub_crs_list[0] if system.is_compound else system, plane_of(system)[1]
    if plane.is_geographic:
        return _project(points, system, plane, height_factor)
    if plane.is_geocentric:
        raise InputError(crs, "geocentric coordinates are not supported", "project them to a plane first")
    factor = plane.axis_info[0].unit_conversion_factor
    points, turned = east_first(points, plane)
    if factor == 1 and height_factor == 1:
        return points, crs, turned
    name = plane.axis_info[0].unit_name
    note = f"Coordinates converted from {name} to metres."
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # PROJ strings lose the name of the system, not its numbers
        words = plane.to_proj4().split()
    words = [word for word in words if not word.startswith(("+units=", "+to_meter=", "+type="))]
    points = points * [factor, factor, height_factor]
    return points, " ".join([*words, "+units=m", "+type=crs"]), " ".join(filter(None, [note, turned]))


def _project(points, system, plane, height_factor):
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
    return np.column_stack([east, north, points[:, 2] * height_factor]), local, note


def _within(longitude, latitude, area, margin=1.0):
    inside = (longitude >= area.west - margin) & (longitude <= area.east + margin)
    return bool(np.all(inside & (latitude >= area.south - margin) & (latitude <= area.north + margin)))


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
    if _within(*back.transform(x, y), area) or not _within(*back.transform(y, x), area):
        return points, None
    return points[:, [1, 0, 2]], "Coordinates are north first in the file; swapped to east first."
