"""Collect trees from SolitaryVegetationObjects and PlantCovers, of CityGML and of CityJSON."""

from dataclasses import replace

import numpy as np

from ..city.choose_levels import rank_lod
from ..city.city import Tree
from .collect_polygons import collect_polygons, read_numbers, resolve_references
from .collect_shapes import INSTANCE, Owner, collect_shapes
from .open_input import clean_name

PLANTS = ("SolitaryVegetationObject", "PlantCover")
METRES = dict.fromkeys(("", "m", "metre", "meter", "metres", "meters"), 1.0)  # unit -> [m]
METRES |= {"cm": 0.01, "mm": 0.001, "dm": 0.1, "in": 0.0254, "[in_i]": 0.0254} | dict.fromkeys(
    ("ft", "foot", "feet", "[ft_i]"), 0.3048
)
# [m] above all known trees
LARGEST = {
    "height": 130.0,
    "crown_diameter": 80.0,
    "trunk_diameter": 20.0,
}
DENSITY = "leafAreaDensity"
FIELDS = {"height": "height", "crownDiameter": "crown_diameter", "trunkDiameter": "trunk_diameter"}
FIELDS |= {"averageHeight": "height", DENSITY: "area_density"}  # a cover has the former
POINTS = "MultiPoint"


def collect_tree(element, content):
    """Append one tree to the content of its file, and its polygons to the file's plants.

    Parameters
    ----------
    element : lxml element
        A SolitaryVegetationObject or a PlantCover.
    content : FileContent
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
    _set_attributes(tree, given)
    places = ("{*}referencePoint//{*}pos", "{*}Point/{*}pos")
    points = [read_numbers([found]) for path in places for found in element.iterfind(f".//{path}")]
    known = (
        point
        for point in points
        if point is not None and len(point) == 3 and np.isfinite(point).all()
    )
    tree.place = next(known, None)
    content.trees.append(tree)


def _set_attributes(tree, given):
    """Set lengths, density and class of a tree; what is wrong with its size becomes its `fault`.

    Parameters
    ----------
    tree : Tree
        Changed in place.
    given : dict of str to tuple
        Word of the file -> value, and its unit or None.
    """
    for word, field in FIELDS.items():
        text, unit = given.get(word, (None, None))
        if text is None or not str(text).strip() or (word == "averageHeight" and not tree.cover):
            continue
        value, fault = _read_size(
            text, None if word == DENSITY else unit or "", LARGEST.get(field, np.inf)
        )
        if fault and field in ("height", "crown_diameter"):
            tree.fault = tree.fault or f"{word} {fault}"
        elif not fault or (word == DENSITY and value == 0):
            setattr(tree, field, value)
    kind = str(given.get("class", ("",))[0] or "").lower()
    # In the standard's list the class 1060 is coniferous trees.
    tree.evergreen = any(word in kind for word in ("1060", "conifer", "evergreen"))


def _read_size(text, unit, largest):
    """A size of a tree in metres, and why it cannot be used, or "". Densities have no unit."""
    try:
        value = np.nan if isinstance(text, bool) else float(text)
    except (ValueError, TypeError):
        value = np.nan
    if unit is not None:
        scale = METRES.get(unit.rpartition("#")[2].rpartition(":")[2].lower())
        if scale is None:
            return value, "in a unit that is not known: give metres"
        value *= scale
    if not np.isfinite(value) or value <= 0:
        return value, "is no number above 0"
    return (
        value,
        f"of more than {largest:g} m is not believed: check its unit" if value > largest else "",
    )


def finish_trees(content):
    """Give each tree the polygons of its best level of detail; leave out those without shape and
    without usable size.

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
        if tree.fault:
            content.skip(
                f"size of a tree that has a shape: {tree.fault}" if own else f"tree: {tree.fault}",
                tree.name,
            )
    content.trees = [tree for tree in content.trees if tree.polygons or not tree.fault]
    for reason, names in plants.skipped.items():
        content.skipped.setdefault(f"of vegetation: {reason}", []).extend(names)
    plants.polygons, plants.prototypes = [], {}


def collect_json_tree(city_object, name, shapes, line):
    """Append one tree to the content of its file, and its polygons to the file's plants.

    Parameters
    ----------
    city_object : dict
    name : str
    shapes : Shapes
        Of the file.
    line : int
    """
    # A tree or a wood, with its measures: plain numbers, or numbers with a unit.
    content, cover = shapes.content, city_object["type"] == "PlantCover"
    tree = Tree(clean_name(name), content.path, line, cover)
    attributes = city_object.get("attributes")
    attributes = attributes if isinstance(attributes, dict) else {}
    given = {}
    for word, found in attributes.items():
        measure = found if isinstance(found, dict) else {"value": found}
        unit = measure.get("uom")
        given[word] = measure.get("value"), unit if isinstance(unit, str) else None
    _set_attributes(tree, given)
    # Where it stands: the first point of its geometries.
    geometries = city_object.get("geometry")
    geometries = (
        [part for part in geometries if isinstance(part, dict)]
        if isinstance(geometries, list)
        else []
    )
    for (
        part
    ) in geometries:  # the first point of a MultiPoint, or the reference point of an instance
        places = part.get("boundaries")
        first = (
            places[0]
            if part.get("type") in (POINTS, INSTANCE) and isinstance(places, list) and places
            else None
        )
        if tree.place is None and type(first) is int and 0 <= first < len(shapes.vertices):
            tree.place = np.array(shapes.vertices[first], float)
    # Its shapes are read like a building's, but kept apart.
    content.plants.buildings.append(tree.name)
    owner = Owner(tree.name, len(content.trees), 0, "", line)
    solid = [part for part in geometries if part.get("type") != POINTS]
    collect_shapes({"geometry": solid}, owner, replace(shapes, content=content.plants))
    content.trees.append(tree)
