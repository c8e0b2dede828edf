"""Read GeoJSON (RFC 7946, with the `crs` member of 2008) and GeoJSONSeq: outlines of buildings with
attributes.
"""

from pathlib import Path

from ..city.city import FileContent
from ..settings.errors import InputError
from ..settings.progress import silent
from .flat_map import FeatureList
from .open_input import clean_name
from .parse_json import READ, iterate_json

GEOMETRIES = ("Polygon", "MultiPolygon", "GeometryCollection")
DEGREES = "OGC:CRS84"  # longitude and latitude on WGS 84, the system of GeoJSON that names none


def read_geojson(path, report_share=silent):
    """Read the outlines of one GeoJSON file.

    Parameters
    ----------
    path : path-like
        One text, or one feature a line; plain or gzip-compressed.
    report_share : callable, optional
        As in `open_input`.

    Returns
    -------
    FileContent
        With a FlatMap.

    Raises
    ------
    InputError
        Not GeoJSON, or without outlines.
    """
    content = FileContent(Path(path))
    features, number = FeatureList(content), 0
    # One collection, or features or bare geometries one a line; anything else is refused. Each
    # polygon is added to the map, with its feature's attributes.
    for value, line in iterate_json(path, content.notes, report_share):
        kind = value.get("type") if isinstance(value, dict) else None
        if kind == "FeatureCollection":
            # The head may name the reference system and the licence.
            _note_head(value, content, line)
            members = value.get("features")
            if not isinstance(members, list):
                raise InputError(path, f"line {line}: features is not a list", "export it again")
        elif kind == "Feature" or kind in GEOMETRIES:
            members = [value]
        else:
            word = clean_name(str(kind))[:60]
            problem = f"line {line}: JSON, but not GeoJSON (type {word!r})"
            raise InputError(path, problem, "give a GeoJSON or CityJSON file")
        for place, member in enumerate(members):
            number += 1
            _add(member, features, f"feature {number}", content)
            members[place] = None  # frees memory
            if place % 4096 == 4095:
                report_share(READ + (0.9 - READ) * place / len(members))
    content.flat_map = features.finish()
    # Without a named system: degrees if all numbers could be degrees, else a note says that it is
    # unknown.
    if not content.srs_names:
        far = abs(content.flat_map.points).max(axis=0)
        if (far <= (360, 90)).all() or (far <= (90, 360)).all():
            content.srs_names[DEGREES] = 1
        else:
            content.notes.append(
                f"{path} names no coordinate reference system, and its coordinates are no degrees."
            )
    return content


def _add(member, features, where, content):
    """Add one feature, or a geometry by itself."""
    if not isinstance(member, dict):
        content.skip("feature is not a JSON object", where)
        return
    alone = member.get("type") in GEOMETRIES
    attributes = {} if alone else member.get("properties")
    name = member.get("id")
    named = isinstance(name, (str, int)) and not isinstance(name, bool)
    features.add(
        member if alone else member.get("geometry"),
        attributes if isinstance(attributes, dict) else {},
        clean_name(str(name)) if named else "",
        where,
    )


def _note_head(value, content, line):
    """Reference system and attribution of a collection."""
    crs = value.get("crs")
    properties = crs.get("properties") if isinstance(crs, dict) else None
    name = properties.get("name", properties.get("code")) if isinstance(properties, dict) else crs
    if isinstance(name, int) and not isinstance(name, bool):
        name = f"EPSG:{name}"
    if isinstance(name, str) and name.strip():
        content.srs_names.setdefault(clean_name(name), line)
    for word in ("attribution", "copyright", "licence", "license"):
        text = value.get(word)
        if isinstance(text, str) and text.strip():
            content.attributions.append(clean_name(text.strip()))
