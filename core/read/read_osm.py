"""Read OpenStreetMap data: XML (.osm), Overpass JSON, and PBF by osmium, of the extra `formats`.

Buildings are closed ways and multipolygons of ways; ways refer to nodes, which may come later.
"""

import json
from array import array
from functools import reduce
from pathlib import Path

import numpy as np
import shapely

from ..city.city import FileContent
from ..settings.errors import InputError
from ..settings.progress import silent
from .flat_map import OPENSTREETMAP, FeatureList
from .open_input import CUT, clean_name, open_input
from .parse_json import iterate_json
from .parse_xml import iterate_elements
from .read_gdal import need_package
from .read_geojson import DEGREES


class _Elements:
    """Nodes, ways and relations of a file."""

    def __init__(self):
        self._ids, self._places = array("q"), array("d")
        self.ways = {}  # id -> (list of ids of nodes or of places, tags)
        self.relations = []  # (id, [(type, id, role)], tags)
        self.notes = []

    def add_node(self, number, longitude, latitude):
        self._ids.append(number)
        self._places.extend((longitude, latitude))

    def find_places(self):
        """Places of nodes: their ids in order, (n,) int64, and longitudes and latitudes, (n, 2)."""
        ids = np.array(self._ids, np.int64)
        order = np.argsort(ids, kind="stable")
        return ids[order], np.array(self._places).reshape(-1, 2)[order]


def read_osm(path, report_share=silent):
    """Read the buildings and building parts of OpenStreetMap data.

    Parameters
    ----------
    path : path-like
        XML or JSON, plain or gzip-compressed; or PBF.
    report_share : callable, optional
        As in `open_input`.

    Returns
    -------
    FileContent
        With a FlatMap.

    Raises
    ------
    InputError
        Not OpenStreetMap data, or without buildings.
    """
    path, content = Path(path), FileContent(Path(path))
    with open_input(path) as stream:
        head = stream.read(4096).removeprefix(b"\xef\xbb\xbf").lstrip()
    # By its first sign: XML, JSON, or else PBF.
    if head.startswith(b"<"):
        elements = _read_xml(path, report_share)
    elif head.startswith(b"{"):
        elements = _read_json(path, content, report_share)
    else:
        elements = _read_pbf(path)
    content.attributions.append(OPENSTREETMAP)
    content.srs_names[DEGREES] = 1
    content.flat_map = _draw(elements, content)
    return content


def _read_xml(path, report_share):
    elements = _Elements()
    for element in iterate_elements(path, ("node", "way", "relation"), report_share=report_share):
        if element.get("visible") == "false" or element.get("action") == "delete":
            continue
        kind = element.tag.rpartition("}")[2]
        try:
            number = int(element.get("id"))
            if kind == "node":
                elements.add_node(number, float(element.get("lon")), float(element.get("lat")))
                continue
            tags = {tag.get("k"): tag.get("v") for tag in element.iterchildren("{*}tag")}
            if kind == "way":
                nodes = array("q", [int(node.get("ref")) for node in element.iterchildren("{*}nd")])
                elements.ways[number] = nodes, tags
            else:
                members = [
                    (member.get("type"), int(member.get("ref")), member.get("role"))
                    for member in element.iterchildren("{*}member")
                ]
                elements.relations.append((number, members, tags))
        except (TypeError, ValueError, OverflowError) as error:
            raise InputError(
                path, f"line {element.sourceline}: {kind} without numbers ({error})", CUT
            ) from error
    return elements


def _read_json(path, content, report_share):
    """Elements of the JSON of the Overpass API; ways and members may bring their places."""
    elements = _Elements()
    for value, line in iterate_json(path, content.notes, report_share):
        members = value.get("elements") if isinstance(value, dict) else None
        if not isinstance(members, list):
            raise InputError(path, f"line {line}: no list of elements", "export it again")
        for place, member in enumerate(members):
            try:
                _add_json(member, elements)
            except (TypeError, ValueError, KeyError, AttributeError, OverflowError) as error:
                words = f"element {place + 1} is not as Overpass writes it ({error})"
                raise InputError(path, words, CUT) from error
    return elements


def _add_json(element, elements):
    kind, number, tags = element["type"], int(element["id"]), element.get("tags") or {}
    if kind == "node":
        elements.add_node(number, float(element["lon"]), float(element["lat"]))
    elif kind == "way":
        shape = [[float(at["lon"]), float(at["lat"])] for at in element.get("geometry") or [] if at]
        elements.ways[number] = shape or array("q", map(int, element.get("nodes", []))), tags
    elif kind == "relation":
        members = []
        for member in element.get("members", []):
            members.append((member["type"], int(member["ref"]), member.get("role", "")))
            shape = [
                [float(at["lon"]), float(at["lat"])] for at in member.get("geometry") or [] if at
            ]
            if shape and members[-1][0] == "way":
                elements.ways.setdefault(members[-1][1], (shape, {}))
        elements.relations.append((number, members, tags))


def _read_pbf(path):
    need_package(path, "osmium", "OpenStreetMap PBF")
    import osmium

    elements = _Elements()
    with InputError.parsing(path, "cannot be read as PBF", CUT):
        for element in osmium.FileProcessor(str(path)):
            tags = {tag.k: tag.v for tag in element.tags}
            if element.is_node():
                elements.add_node(element.id, element.lon, element.lat)
            elif element.is_way():
                elements.ways[element.id] = [node.ref for node in element.nodes], tags
            elif element.is_relation():
                kinds = {"n": "node", "w": "way", "r": "relation"}
                members = [
                    (kinds[member.type], member.ref, member.role) for member in element.members
                ]
                elements.relations.append((element.id, members, tags))
    return elements


def _is_building(tags):
    return any(tags.get(key, "no") != "no" for key in ("building", "building:part"))


def _draw(elements, content):
    """Outlines of all buildings and parts among the elements of OpenStreetMap: FlatMap."""
    # Places of nodes, sorted by id.
    ids, places = elements.find_places()
    features, incomplete = FeatureList(content), []

    def line_of(number):
        """Places along a way, (k, 2); None where one is not in the file."""
        # Ways of Overpass may bring their places; others name nodes.
        nodes, _ = elements.ways.get(number, ([], {}))
        if isinstance(nodes, list) and nodes:
            return np.array(nodes)
        wanted = np.array(nodes, np.int64)
        rows = np.searchsorted(ids, wanted)
        if (
            not len(wanted)
            or (rows == len(ids)).any()
            or (ids[np.minimum(rows, len(ids) - 1)] != wanted).any()
        ):
            return None
        return places[rows]

    # Relations of buildings link parts to their outline, wherever in the file they stand.
    links, drawn = {}, set()
    for _, members, tags in elements.relations:
        outlines = [f"{kind}/{ref}" for kind, ref, role in members if role == "outline"]
        if tags.get("type") == "building" and outlines:
            links |= {f"{kind}/{ref}": outlines[0] for kind, ref, role in members if role == "part"}
    # Multipolygons draw buildings with holes; one whose rings are not all there is incomplete.
    for number, members, tags in elements.relations:
        if tags.get("type") == "multipolygon":
            # Tags of the multipolygon, or in old data of its only outer way; others are no
            # buildings.
            own = tags if _is_building(tags) else _tags_of_outer(members, elements.ways)
            if own is None:
                continue
            shape = _assemble(members, line_of)
            name = f"relation/{number}"
            if shape is None:
                incomplete.append(name)
                continue
            # Ways that gave it their tags are not drawn once more below.
            drawn |= {ref for kind, ref, role in members if kind == "way" and own is not tags}
            features.add(
                json.loads(shapely.to_geojson(shape)), _with_link(own, links, name), name, name
            )
    # Closed ways that are buildings and not drawn by a multipolygon already.
    for number, (_, tags) in elements.ways.items():
        if not _is_building(tags) or number in drawn:
            continue
        name, line = f"way/{number}", line_of(number)
        if line is None or len(line) < 4 or (line[0] != line[-1]).any():
            incomplete.append(name)
            continue
        shape = {"type": "Polygon", "coordinates": [line.tolist()]}
        features.add(shape, _with_link(tags, links, name), name, name)
    # Buildings that are not closed, or cut off at the edge of the download, are left out and told.
    for name in incomplete:
        content.skip("building that is not closed, or of which the file has a part only", name)
    return features.finish()


def _with_link(tags, links, name):
    """Tags of a building or part, with the building that a relation names for it."""
    tags = {clean_name(str(key)): value for key, value in tags.items()}
    return tags | {"building_id": links[name]} if name in links else tags


def _tags_of_outer(members, ways):
    """Tags of the outer way of a multipolygon, as in old data; None where that is no building."""
    outer = [ref for kind, ref, role in members if kind == "way" and role in ("outer", "")]
    tags = [ways[ref][1] for ref in outer if ref in ways and _is_building(ways[ref][1])]
    return tags[0] if len(tags) == 1 == len(outer) else None


def _assemble(members, line_of):
    """Multipolygon of ways, each a piece of a ring: shapely geometry; None where pieces are
    missing.
    """
    lines = [line_of(ref) for kind, ref, _ in members if kind == "way"]
    if not lines or any(
        line is None or len(line) < 2 or not np.isfinite(line).all() for line in lines
    ):
        return None
    rings = shapely.get_parts(shapely.line_merge(shapely.MultiLineString(lines)))
    sizes = shapely.get_num_coordinates(rings)
    if not shapely.is_closed(rings).all() or (sizes < 4).any():
        return None
    # Rings one inside another are holes and islands by turns, whatever their roles say.
    shapes = shapely.make_valid([shapely.Polygon(ring) for ring in rings])
    return reduce(shapely.symmetric_difference, shapes)
