"""Collect the polygons and references of one CityGML building element."""

import re
from typing import NamedTuple

import numpy as np

from ..city.polygon import FileContent, Polygon, Reference
from ..settings.errors import InputError
from .limits import LARGEST_COORDINATE
from .place_shapes import read_anchor

XLINK = "{http://www.w3.org/1999/xlink}href"
GML_IDS = ("{http://www.opengis.net/gml}id", "{http://www.opengis.net/gml/3.2}id")
LEAVES = {"Polygon", "Triangle", "PolygonPatch", "Rectangle"}
THEMATIC = {
    "WallSurface", "RoofSurface", "GroundSurface", "ClosureSurface", "OuterCeilingSurface", "OuterFloorSurface",
    "Window", "Door", "WindowSurface", "DoorSurface", "BuildingInstallation", "BuildingConstructiveElement",
}  # fmt: skip
# Elements that are skipped: not an outer surface, or not geometry at all.
PASSED_BY = {
    "interiorRoom", "buildingRoom", "interiorBuildingInstallation", "interiorFurniture", "buildingFurniture",
    "InteriorWallSurface", "CeilingSurface", "FloorSurface", "appearance", "appearanceMember", "externalReference",
    "address", "genericAttribute", "genericAttributeSet", "stringAttribute", "intAttribute", "doubleAttribute",
    "dateAttribute", "uriAttribute", "measureAttribute", "Envelope", "creationDate", "terminationDate", "function",
    "usage", "class", "roofType", "measuredHeight", "height", "name", "description", "buildingSubdivision",
}  # fmt: skip
STEPS = THEMATIC | {"BuildingPart", "Solid", "OrientableSurface", "ImplicitGeometry", "interior"}
NO_SURFACES = ("TerrainIntersection", "Curve", "HeightType", "Network", "PointCloud", "Point")
LOD = re.compile(r"lod(\d)(.*)")
COORDINATES = ("{*}posList", "{*}pos", "{*}coordinates")


class Place(NamedTuple):
    """Context of the element that is being read."""

    building: int
    part: int = 0
    thematic: str = ""
    lod: str | None = None
    source: str = "multisurface"
    flipped: bool = False
    dimension: str | None = None


def collect_polygons(element, content, kinds):
    """Append the polygons of one top-level building to the content of its file.

    Parameters
    ----------
    element : lxml element
        The building.
    content : FileContent
        One building, its polygons and its references are appended.
    kinds : dict
        Cache, tag -> kind, shared by all buildings so that each tag is parsed once.
    """
    content.buildings.append(_identifier(element))
    _note_srs_name(element, content)
    _walk(element, Place(building=len(content.buildings) - 1), content, kinds)


def _walk(element, place, content, kinds):
    for child in element:
        kind = kinds.get(child.tag)
        if kind is None:
            kind = kinds[child.tag] = _kind(child.tag)
        if kind == "leaf":
            _add_polygon(child, place, content)
        elif kind == "ImplicitGeometry":
            _add_implicit(child, place, content, kinds)
        elif kind != "passed by":
            inner = _step(child, kind, place, content)
            if inner is not None:
                _walk_group(child, inner, content, kinds)


def _walk_group(element, place, content, kinds):
    first = len(content.polygons)
    _walk(element, place, content, kinds)
    if place.lod is not None:
        identifier = _identifier(element)
        if identifier:
            content.groups[identifier] = (first, len(content.polygons))


def _add_implicit(element, place, content, kinds):
    """Append the polygons of an implicit geometry, transformed to world coordinates."""
    name = _identifier(element) or f"line {element.sourceline}"
    anchor = read_anchor(element)
    shape = next(iter(element.iterchildren("{*}relativeGMLGeometry", "{*}relativeGeometry")), None)
    if place.lod is None or anchor is None or shape is None:
        content.skip("implicit geometry without a shape, a reference point or a level of detail", name)
        return
    local = FileContent(content.path)
    _walk(shape, place, local, kinds)
    for drawn in shape.iterchildren("*"):
        content.prototypes[_identifier(drawn)] = local.polygons
    for reason, names in local.skipped.items():
        content.skipped.setdefault(reason, []).extend(names)
    content.polygons += anchor.place(local.polygons)
    if XLINK in shape.attrib:
        content.instances.append((shape.attrib[XLINK].rpartition("#")[2], anchor, place, name))


def _kind(tag):
    if not isinstance(tag, str):
        return "passed by"  # comments and processing instructions
    name = tag.rpartition("}")[2]
    lod = LOD.fullmatch(name)
    if lod:
        return "passed by" if lod.group(2).endswith(NO_SURFACES) else "lod" + lod.group(1)
    if name in LEAVES:
        return "leaf"
    if name in PASSED_BY:
        return "passed by"
    return name if name in STEPS else "other"


def _step(child, kind, place, content):
    """Context inside a child element, or None if it is to be skipped."""
    attributes = child.attrib
    if attributes:
        _note_srs_name(child, content)
        if "srsDimension" in attributes:
            place = place._replace(dimension=attributes["srsDimension"])
    if kind == "interior":  # cavities inside a solid receive no light
        return None
    if kind == "BuildingPart":
        content.part_count += 1
        place = place._replace(part=content.part_count)
    elif kind.startswith("lod"):
        place = place._replace(lod=kind[3:], source="surface" if place.thematic else "multisurface")
    elif kind in THEMATIC:
        place = place._replace(thematic=kind)
    elif kind == "Solid" and place.source == "multisurface":
        place = place._replace(source="solid")
    elif kind == "OrientableSurface" and attributes.get("orientation") == "-":
        place = place._replace(flipped=not place.flipped)
    if place.lod is not None and XLINK in attributes:
        target = attributes[XLINK].rpartition("#")[2]
        content.references.append(
            Reference(target, place.building, place.part, place.thematic, place.lod, place.source, place.flipped)
        )
    return place


def _identifier(element):
    for name in GML_IDS:
        if name in element.attrib:
            return element.attrib[name]
    return ""


def _note_srs_name(element, content):
    srs_name = element.get("srsName")
    if srs_name:
        content.srs_names.setdefault(srs_name, element.sourceline)


def _add_polygon(element, place, content):
    identifier = _identifier(element)
    _note_srs_name(element, content)
    outlines, holes, problem = [], [], None
    for part in element:
        if not isinstance(part.tag, str):
            continue
        name = part.tag.rpartition("}")[2]
        if name not in ("exterior", "interior", "outerBoundaryIs", "innerBoundaryIs"):
            continue
        points, trouble = _read_ring(part, place, content)
        problem = problem or trouble
        (outlines if name in ("exterior", "outerBoundaryIs") else holes).append(points)
    if place.lod is None:
        problem = problem or "no level of detail given"
    if len(outlines) != 1:
        problem = problem or "no exterior ring, or more than one"
    if problem:
        content.skip(problem, identifier or f"line {element.sourceline}")
        return
    rings, line = outlines + holes, element.sourceline
    where = place.building, place.part, place.thematic, place.lod, place.source
    content.polygons.append(Polygon(identifier, *where, rings, line, place.flipped))


def _read_ring(part, place, content):
    """Points of one ring (k, 3), and a problem with them or None."""
    texts, dimension = [], place.dimension
    for element in part.iter(*COORDINATES):
        text = element.text or ""
        if element.attrib:
            _note_srs_name(element, content)
            dimension = element.get("srsDimension", dimension)
        texts.append(text.replace(",", " ") if element.tag.endswith("coordinates") else text)
    try:
        numbers = np.array([float(word) for text in texts for word in text.split()])
    except ValueError:
        return None, "coordinates that are not numeric"
    if dimension == "2":
        return None, "2D coordinates without heights"
    if len(numbers) % 3:
        return None, "number of coordinates is not a multiple of 3"
    if len(numbers) and not np.abs(numbers).max() <= LARGEST_COORDINATE:  # also true for NaN
        problem = f"line {part.sourceline}: a coordinate is not finite or beyond {LARGEST_COORDINATE:g}"
        raise InputError(content.path, problem, "correct or remove this polygon")
    return numbers.reshape(-1, 3), None
