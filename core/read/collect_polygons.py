"""Collect the polygons and references of CityGML elements; place implicit geometry; resolve
references.

An xlink names a polygon, or a group of polygons, that another element defines: it exists once. An
ImplicitGeometry is a prototype in local coordinates, instanced at many places.
"""

import re
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..city.city import FileContent, Polygon
from ..settings.errors import InputError
from .lifetimes import GONE, is_terminated, note_demolitions, read_ends
from .open_input import LARGEST_COORDINATE
from .read_attributes import read_attributes

XLINK = "{http://www.w3.org/1999/xlink}href"
THEMATIC = {
    "WallSurface",
    "RoofSurface",
    "GroundSurface",
    "ClosureSurface",
    "OuterCeilingSurface",
    "OuterFloorSurface",
    "Window",
    "Door",
    "WindowSurface",
    "DoorSurface",
    "BuildingInstallation",
    "BuildingConstructiveElement",
}
INSTALLATIONS = ("BuildingInstallation", "BuildingConstructiveElement")
# Elements that are skipped: not an outer surface, or not geometry at all.
PASSED_BY = {
    "interiorRoom",
    "buildingRoom",
    "interiorBuildingInstallation",
    "interiorFurniture",
    "buildingFurniture",
    "InteriorWallSurface",
    "CeilingSurface",
    "FloorSurface",
    "appearance",
    "appearanceMember",
    "externalReference",
    "address",
    "genericAttribute",
    "genericAttributeSet",
    "stringAttribute",
    "intAttribute",
    "doubleAttribute",
    "dateAttribute",
    "uriAttribute",
    "measureAttribute",
    "Envelope",
    "creationDate",
    "terminationDate",
    "function",
    "usage",
    "class",
    "roofType",
    "measuredHeight",
    "height",
    "name",
    "description",
    "buildingSubdivision",
}
STEPS = THEMATIC | {"BuildingPart", "Solid", "OrientableSurface", "ImplicitGeometry", "interior"}
OUTLINE = ("exterior", "outerBoundaryIs")  # the other rings are holes


class _Place(NamedTuple):
    """Context of the element that is being read."""

    building: int
    part: int = 0
    thematic: str = ""
    lod: str | None = None
    source: str = "multisurface"
    flipped: bool = False
    dimension: str | None = None
    installation: bool = False


def collect_polygons(element, content):
    """Append the polygons of one top-level building to the content of its file.

    Parameters
    ----------
    element : lxml element
        The building.
    content : FileContent
        One building, its polygons and its references are appended.
    """
    content.buildings.append(name_element(element))
    _note_srs_name(element, content)
    place = _Place(building=len(content.buildings) - 1)
    _keep_attributes(element, place, content)
    _walk(element, place, content)


def _keep_attributes(element, place, content):
    """Keep what a building or a part of one tells of itself, where it tells anything."""
    told = read_attributes(element)
    if told:
        content.attributes[place.building, place.part] = told


def _walk(element, place, content):
    for child in element:
        kind = _kind(child.tag)
        if kind == "leaf":
            _add_polygon(child, place, content)
        elif kind == "ImplicitGeometry":
            _add_implicit(child, place, content)
        elif kind != "passed by":
            first, inner = len(content.polygons), _step(child, kind, place, content)
            if inner is not None:
                _walk(child, inner, content)
                if inner.lod is not None and name_element(child):
                    content.groups[name_element(child)] = (first, len(content.polygons))


def _add_implicit(element, place, content):
    """Append the polygons of an implicit geometry, transformed to world coordinates; one that
    refers to a shape elsewhere waits in `content.instances` until the file is read.
    """
    # Where the shape is to stand: a reference point and a matrix of 4 × 4, both sound numbers. An
    # element without a matrix gets the identity.
    name = name_element(element) or f"line {element.sourceline}"
    point, matrix = (
        next(element.iterfind("{*}referencePoint//{*}pos"), None),
        element.find("{*}transformationMatrix"),
    )
    point = None if point is None else read_numbers([point])
    matrix = np.eye(4) if matrix is None else read_numbers([matrix])
    sound = all(
        numbers is not None and numbers.size == count and np.isfinite(numbers).all()
        for numbers, count in ((point, 3), (matrix, 16))
    )
    shape = next(iter(element.iterchildren("{*}relativeGMLGeometry", "{*}relativeGeometry")), None)
    # Without these, or a level of detail, it is left out and reported.
    if place.lod is None or not sound or shape is None:
        content.skip(
            "implicit geometry without a shape, a reference point or a level of detail", name
        )
        return
    # Read once in its own axes, kept for others that refer to it, and placed here.
    matrix = matrix.reshape(4, 4)
    matrix[:3, 3] += point
    local = FileContent(content.path)
    _walk(shape, place, local)
    for drawn in shape.iterchildren("*"):
        content.prototypes[name_element(drawn)] = local.polygons
    for reason, names in local.skipped.items():
        content.skipped.setdefault(reason, []).extend(names)
    content.polygons += place_prototype(local.polygons, matrix)
    if XLINK in shape.attrib:
        content.instances.append((shape.attrib[XLINK].rpartition("#")[2], matrix, place, name))


@lru_cache(maxsize=1024)
def _kind(tag):
    if not isinstance(tag, str):
        return "passed by"  # comments and processing instructions
    name = tag.rpartition("}")[2]
    lod = re.fullmatch(r"lod(\d)(.*)", name)
    if lod:
        return (
            "passed by"
            if lod.group(2).endswith(
                ("TerrainIntersection", "Curve", "HeightType", "Network", "PointCloud", "Point")
            )
            else "lod" + lod.group(1)
        )
    if name in {"Polygon", "Triangle", "PolygonPatch", "Rectangle"}:
        return "leaf"
    if name in PASSED_BY:
        return "passed by"
    return name if name in STEPS else "other"


def _step(child, kind, place, content):
    """Context inside a child element, or None if it is to be skipped."""
    attributes = child.attrib
    if attributes:
        # Points in attributes and extensions may be in another system than the surfaces.
        if place.lod is not None or kind.startswith("lod"):
            _note_srs_name(child, content)
        if "srsDimension" in attributes:
            place = place._replace(dimension=attributes["srsDimension"])
    # What the element adds to the place of its polygons: cavities and demolished parts are skipped.
    if kind == "interior":  # cavities inside a solid receive no light
        return None
    if kind == "BuildingPart" and is_terminated(read_ends(child)):
        content.skip(GONE, name_element(child) or f"line {child.sourceline}")
        return None
    # Parts are counted; names of elements tell level of detail, class, and how the shape is given;
    # an orientation "-" turns the polygons over.
    if kind == "BuildingPart":
        content.part_count += 1
        place = place._replace(part=content.part_count)
        note_demolitions({(place.building, place.part): read_ends(child)}, content)
        _keep_attributes(child, place, content)
    elif kind.startswith("lod"):
        place = place._replace(lod=kind[3:], source="surface" if place.thematic else "multisurface")
    elif kind in THEMATIC:
        place = place._replace(
            thematic=kind, installation=place.installation or kind in INSTALLATIONS
        )
    elif kind == "Solid" and place.source == "multisurface":
        place = place._replace(source="solid")
    elif kind == "OrientableSurface" and attributes.get("orientation") == "-":
        place = place._replace(flipped=not place.flipped)
    # A reference to polygons elsewhere in the file waits until all of it is read.
    if place.lod is not None and XLINK in attributes:
        content.references.append((attributes[XLINK], place))
    return place


def name_element(element):
    """Identifier of an element, "" if it has none."""
    return next(
        (
            element.attrib[name]
            for name in ("{http://www.opengis.net/gml}id", "{http://www.opengis.net/gml/3.2}id")
            if name in element.attrib
        ),
        "",
    )


def _note_srs_name(element, content):
    srs_name = element.get("srsName")
    if srs_name:
        content.srs_names.setdefault(srs_name, element.sourceline)


def _add_polygon(element, place, content):
    identifier = name_element(element)
    _note_srs_name(element, content)
    outlines, holes, problem = [], [], None
    for part in element.iterchildren(
        *(f"{{*}}{name}" for name in (*OUTLINE, "interior", "innerBoundaryIs"))
    ):
        points, trouble = _read_ring(part, place, content)
        problem = problem or trouble
        (outlines if part.tag.endswith(OUTLINE) else holes).append(points)
    if place.lod is None:
        problem = problem or "no level of detail given"
    if len(outlines) != 1:
        problem = problem or "no exterior ring, or more than one"
    if problem:
        content.skip(problem, identifier or f"line {element.sourceline}")
        return
    rings, line = outlines + holes, element.sourceline
    where = place.building, place.part, place.thematic, (place.lod,), place.source
    drawn = Polygon(identifier, *where, rings, line, place.flipped, installation=place.installation)
    content.polygons.append(drawn)


def read_numbers(elements):
    """Numbers in the texts of elements of GML, (k,) float64; None if a word is not a number."""
    words = []
    for element in elements:
        text = element.text or ""
        words += (text.replace(",", " ") if element.tag.endswith("coordinates") else text).split()
    try:
        return np.array([float(word) for word in words])
    except ValueError:
        return None


def _read_ring(part, place, content):
    """Points of one ring (k, 3), and a problem with them or None."""
    elements, dimension = list(part.iter("{*}posList", "{*}pos", "{*}coordinates")), place.dimension
    for element in elements:
        if element.attrib:
            _note_srs_name(element, content)
            dimension = element.get("srsDimension", dimension)
    numbers = read_numbers(elements)
    if numbers is None:
        words = " ".join(element.text or "" for element in elements)
        return None, "coordinates with a decimal comma, not a point" if re.search(
            r"\d,\d", words
        ) else "coordinates that are not numeric"
    if dimension == "2":
        return None, "2D coordinates without heights"
    if len(numbers) % 3:
        return None, "number of coordinates is not a multiple of 3"
    if len(numbers) and not np.abs(numbers).max() <= LARGEST_COORDINATE:  # also true for NaN
        raise InputError(
            content.path,
            f"line {part.sourceline}: a coordinate is not finite or beyond {LARGEST_COORDINATE:g}",
            "correct or remove this polygon",
        )
    return numbers.reshape(-1, 3), None


def place_prototype(polygons, matrix):
    """Polygons of a prototype at the place of one instance: list of Polygon.

    Parameters
    ----------
    polygons : list of Polygon
        In local coordinates.
    matrix : (4, 4) float64
        Rotation and scale, and in the last column the place in the units of the file.
    """
    turn, step = matrix[:3, :3].T, matrix[:3, 3]
    return [
        replace(polygon, rings=[ring @ turn + step for ring in polygon.rings], implicit=True)
        for polygon in polygons
    ]


def resolve_references(content):
    """Apply references to their polygons, and instance the prototypes that are given by reference.

    A reference gives a polygon its thematic class, a further LoD, its orientation. A Solid that
    references the polygons of its boundary surfaces adds nothing; a boundary surface that
    references polygons of a Solid gives them its class. Polygons referenced by another building
    stay with the building that defines them.

    Parameters
    ----------
    content : FileContent
        Changed in place.
    """
    # Polygons by their id; the first of one id counts.
    index = {
        polygon.surface_id: polygon for polygon in reversed(content.polygons) if polygon.surface_id
    }
    # A reference to a polygon, or to a group of polygons, of its own building adds a level of
    # detail, a class where there is none, and as part of a solid a turn.
    for link, reference in content.references:
        file, _, target = link.rpartition("#")
        # A reference to what the file does not hold is reported.
        if target not in index and target not in content.groups:
            content.skip(
                "reference to a polygon in another file, which is not read"
                if file
                else "reference to a polygon that is not in the file",
                link if file else target,
            )
            continue
        known = index.get(target)
        for polygon in [known] if known else content.polygons[slice(*content.groups[target])]:
            if polygon.building != reference.building:
                continue
            if reference.thematic and not polygon.thematic:
                polygon.thematic, polygon.source = reference.thematic, "surface"
            if (
                reference.flipped
                and reference.source == "solid"
                and reference.part in (0, polygon.part)
            ):
                # the solid defines its outside; a neighbour's solid does not
                polygon.flipped = True
            polygon.installation &= reference.installation  # the solid of a building may include it
            if reference.lod not in polygon.lods:
                polygon.lods += (reference.lod,)
    # A prototype is placed by each instance, with the building and level of this.
    for target, matrix, place, name in content.instances:
        shape = content.prototypes.get(target)
        if shape is None:
            content.skip("implicit geometry whose prototype is not in the file", name)
            continue
        own = {
            "building": place.building,
            "part": place.part,
            "lods": (place.lod,),
            "installation": place.installation,
        }
        drawn = [
            replace(one, thematic=place.thematic or one.thematic, material="", **own)
            for one in shape
        ]
        content.polygons += place_prototype(drawn, matrix)
