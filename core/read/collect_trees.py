"""Collect trees from SolitaryVegetationObjects and PlantCovers, of CityGML and of CityJSON."""

from dataclasses import replace

import numpy as np

from ..city.choose_levels import rank_lod
from ..city.city import Tree
from ..settings.errors import InputError
from .collect_polygons import collect_polygons, read_numbers, resolve_references
from .collect_shapes import INSTANCE, Owner, collect_shapes
from .open_input import clean_name

PLANTS = ("SolitaryVegetationObject", "PlantCover")
METRES = ("", "m", "metre", "meter", "metres", "meters")
EVERGREEN = ("1060", "conifer", "evergreen")  # class: 1060 is coniferous trees in the standard's list
DENSITY = "leafAreaDensity"
FIELDS = {"height": "height", "crownDiameter": "crown_diameter", "trunkDiameter": "trunk_diameter"}
FIELDS |= {"averageHeight": "height", DENSITY: "area_density"}  # the former is that of a cover
POINTS = "MultiPoint"


def collect_tree(element, content):
    """Append one tree to the content of its file, and its polygons to the file's plants.

    Parameters
    ----------
    element : lxml element
        A SolitaryVegetationObject or a PlantCover.
    content : FileContent

    Raises
    ------
    InputError
        A number of the tree cannot be used.
    """
    cover = element.tag.endswith(PLANTS[1])
    collect_polygons(element, content.plants)
    name = content.plants.buildings[-1] or f"tree_{len(content.trees) + 1}"
    tree = Tree(name, content.path, element.sourceline, cover)
    given = {}
    for child in element.iterchildren("*"):
        generic = child.get("name") == DENSITY
        word = DENSITY if generic else child.tag.rpartition("}")[2]
        given[word] = child.findtext("{*}value") if generic else child.text, child.get("uom")
    set_attributes(tree, given)
    places = ("{*}referencePoint//{*}pos", "{*}Point/{*}pos")
    points = [read_numbers([found]) for path in places for found in element.iterfind(f".//{path}")]
    known = (point for point in points if point is not None and len(point) == 3 and np.isfinite(point).all())
    tree.place = next(known, None)
    content.trees.append(tree)


def set_attributes(tree, given):
    """Set lengths, density and class of a tree.

    Parameters
    ----------
    tree : Tree
        Changed in place.
    given : dict of str to tuple
        Word of the file -> value, and its unit or None.

    Raises
    ------
    InputError
        A number is none, not above 0 (a density: below 0), or not in metres.
    """
    for word, field in FIELDS.items():
        text, unit = given.get(word, (None, None))
        if text is None or not str(text).strip() or (word == "averageHeight" and not tree.cover):
            continue
        try:
            value = np.nan if isinstance(text, bool) else float(text)
        except (ValueError, TypeError):
            value = np.nan
        zero = word == DENSITY
        if not (np.isfinite(value) and (value >= 0 if zero else value > 0)):
            cure = f"give a number {'of at least' if zero else 'above'} 0, or leave it out"
            raise InputError(tree.path, f"{tree.where}: {word} is {str(text).strip()[:20]!r}", cure)
        if unit and not zero and unit.rpartition("#")[2].rpartition(":")[2].lower() not in METRES:
            raise InputError(tree.path, f"{tree.where}: {word} is in {unit[:20]!r}", "give metres")
        setattr(tree, field, value)
    kind = str(given.get("class", ("",))[0] or "").lower()
    tree.evergreen = any(word in kind for word in EVERGREEN)


def finish_trees(content):
    """Give each tree the polygons of its best level of detail.

    Parameters
    ----------
    content : FileContent
        Changed in place.
    """
    plants = content.plants
    resolve_references(plants)
    drawn = {}
    for polygon in plants.polygons:
        drawn.setdefault(polygon.building, []).append(polygon)
    for number, tree in enumerate(content.trees):
        own = [polygon for polygon in drawn.get(number, []) if polygon.lods != ("0",) or tree.cover]
        best = max((lod for polygon in own for lod in polygon.lods), key=rank_lod, default=None)
        tree.polygons = [polygon for polygon in own if best in polygon.lods]
    for reason, names in plants.skipped.items():
        content.skipped.setdefault(f"of vegetation: {reason}", []).extend(names)
    plants.polygons, plants.prototypes = [], {}


def collect_json_tree(one, name, shapes, line):
    """Append one tree to the content of its file, and its polygons to the file's plants.

    Parameters
    ----------
    one : dict
        The city object.
    name : str
    shapes : Shapes
        Of the file.
    line : int

    Raises
    ------
    InputError
        A number of the tree cannot be used.
    """
    content, cover = shapes.content, one["type"] == "PlantCover"
    tree = Tree(clean_name(name), content.path, line, cover)
    attributes = one.get("attributes")
    attributes = attributes if isinstance(attributes, dict) else {}
    given = {}
    for word, found in attributes.items():
        measure = found if isinstance(found, dict) else {"value": found}
        unit = measure.get("uom")
        given[word] = measure.get("value"), unit if isinstance(unit, str) else None
    set_attributes(tree, given)
    geometries = one.get("geometry")
    geometries = [part for part in geometries if isinstance(part, dict)] if isinstance(geometries, list) else []
    for part in geometries:  # the first point of a MultiPoint, or the reference point of an instance
        places = part.get("boundaries")
        first = places[0] if part.get("type") in (POINTS, INSTANCE) and isinstance(places, list) and places else None
        if tree.place is None and type(first) is int and 0 <= first < len(shapes.vertices):
            tree.place = np.array(shapes.vertices[first], float)
    content.plants.buildings.append(tree.name)
    owner = Owner(tree.name, len(content.trees), 0, "", line)
    solid = [part for part in geometries if part.get("type") != POINTS]
    collect_shapes({"geometry": solid}, owner, replace(shapes, content=content.plants))
    content.trees.append(tree)
