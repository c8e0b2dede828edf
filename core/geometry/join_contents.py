"""Bring the contents of several files to one coordinate reference system in metres, and join them."""

import numpy as np
import pyproj

from ..errors import InputError
from .assemble_city import assemble_city
from .convert_to_metres import convert_to_metres
from .name_crs import name_crs
from .place_shapes import leave_out_degrees


def join_contents(contents, lod=None, unit="m"):
    """One City from the contents of files.

    Parameters
    ----------
    contents : list of FileContent
    lod : str, optional
    unit : {'m', 'ft', 'us-ft'}
        Where no file names a coordinate reference system.

    Returns
    -------
    City

    Raises
    ------
    InputError
        The files stand in different coordinate reference systems.
    """
    for content in contents:
        content.crs = _crs_of(content)
        if content.crs and pyproj.CRS.from_user_input(content.crs).is_geographic:
            leave_out_degrees(content)
    crs = _common_crs(contents)
    rings = [ring for content in contents for polygon in content.polygons for ring in polygon.rings]
    points = np.concatenate([np.empty((0, 3)), *rings])
    points, crs, note = convert_to_metres(points, crs, unit)
    if note:
        contents[0].notes.append(note)
    ends = np.cumsum([len(ring) for ring in rings]) if rings else []
    pieces = iter(np.split(points, ends[:-1]) if rings else [])
    for content in contents:
        for polygon in content.polygons:
            polygon.rings = [next(pieces) for _ in polygon.rings]
    return assemble_city(contents, crs, lod)


def _crs_of(content):
    """The one system that a file names, or None."""
    easting = next((polygon.rings[0][0, 0] for polygon in content.polygons if len(polygon.rings[0])), None)
    named = {}
    for srs_name, line in content.srs_names.items():
        crs = name_crs(srs_name, easting)
        if crs is None:
            content.notes.append(f"{content.path}, line {line}: srsName {srs_name!r} means nothing to PROJ.")
        else:
            named.setdefault(crs, (srs_name, line))
    if len({crs.split("+")[0] for crs in named}) > 1:
        spellings = " and ".join(f"{name!r} (line {line})" for name, line in list(named.values())[:2])
        raise InputError(content.path, f"two coordinate reference systems: {spellings}", "convert it to one of them")
    return max(named, key=len, default=None)


def _common_crs(contents):
    named = {content.crs: content for content in contents if content.crs}
    if len({crs.split("+")[0] for crs in named}) > 1:
        first, second = list(named)[:2]
        problem = f"stands in {second}, but {named[first].path} in {first}"
        raise InputError(named[second].path, problem, "bring all files to one coordinate reference system")
    for content in contents:
        if named and content.crs is None:
            content.notes.append(f"{content.path} names no coordinate reference system; taken as {max(named)}.")
    return max(named, key=len, default=None)
