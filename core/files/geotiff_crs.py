"""Coordinate reference system and unit of heights of a GeoTIFF, from its keys (OGC 19-008r4)."""

import pyproj
from pyproj.exceptions import CRSError

USER_DEFINED = 32767
PROJECTED, GEOGRAPHIC = 1, 2  # types of model
LENGTHS = {9001: 1.0, 9002: 0.3048, 9003: 1200 / 3937}  # EPSG's units [m]
WORDS = {9001: "metre", 9002: "foot", 9003: "us survey foot"}


class UnknownSystemError(ValueError):
    """A system that is described by parameters, not by a number of EPSG."""


def crs_of_keys(keys):
    """Coordinate reference system of a GeoTIFF.

    Parameters
    ----------
    keys : dict
        GeoTIFF keys by name.

    Returns
    -------
    crs : str or None
        WKT; None if there is none.
    unit : str
        Of the heights, "" if not told.

    Raises
    ------
    UnknownSystemError
    """
    model = int(keys.get("GTModelTypeGeoKey", 0))
    name = {PROJECTED: "ProjectedCSTypeGeoKey", GEOGRAPHIC: "GeographicTypeGeoKey"}.get(model)
    unit = WORDS.get(int(keys.get("VerticalUnitsGeoKey", 0)), "")
    if name is None:
        return None, unit
    code = int(keys.get(name, USER_DEFINED))
    vertical = int(keys.get("VerticalCSTypeGeoKey", USER_DEFINED))
    if code in (0, USER_DEFINED):
        raise UnknownSystemError("its coordinate reference system has no EPSG code")
    system = read_code(code)
    given = LENGTHS.get(int(keys.get("ProjLinearUnitsGeoKey", 0)))
    if model == PROJECTED and given and abs(given / system.axis_info[0].unit_conversion_factor - 1) > 1e-9:
        raise UnknownSystemError(f"its unit of length is not that of EPSG:{code}")
    if 0 < vertical < USER_DEFINED and not unit and read_code(vertical).is_vertical:
        system = read_code(f"{code}+{vertical}")
    return system.to_wkt(), unit


def read_code(code):
    """A system of EPSG.

    Raises
    ------
    UnknownSystemError
    """
    try:
        return pyproj.CRS.from_user_input(f"EPSG:{code}")
    except CRSError as error:
        raise UnknownSystemError(f"its coordinate reference system EPSG:{code} is not known") from error
