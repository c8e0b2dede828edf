"""Collect trees from SolitaryVegetationObject and PlantCover objects of CityJSON."""

from dataclasses import replace

import numpy as np

from ..city.tree import Tree
from .collect_shapes import INSTANCE, Owner, collect_shapes
from .collect_trees import DENSITY, NUMBERS, is_evergreen, set_number
from .limits import clean_name

POINTS = "MultiPoint"


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
    known = {**NUMBERS, **({"averageHeight": "height"} if cover else {}), DENSITY: "area_density"}
    for word, field in known.items():
        value, unit = attributes.get(word), None
        if isinstance(value, dict):
            value, unit = value.get("value"), value.get("uom")
        set_number(tree, field, word, value, unit if isinstance(unit, str) else None)
    tree.evergreen = is_evergreen(attributes.get("class"))
    geometries = [part for part in one.get("geometry") or [] if isinstance(part, dict)]
    tree.place = find_place(geometries, shapes.vertices)
    content.plants.buildings.append(tree.name)
    owner = Owner(tree.name, len(content.trees), 0, "", line)
    solid = [part for part in geometries if part.get("type") != POINTS]
    collect_shapes({"geometry": solid}, owner, replace(shapes, content=content.plants))
    content.trees.append(tree)


def find_place(geometries, vertices):
    """First point of a MultiPoint, or the reference point of an instance: (3,) float64, or None."""
    for geometry in geometries:
        boundaries = geometry.get("boundaries")
        if geometry.get("type") in (POINTS, INSTANCE) and isinstance(boundaries, list) and boundaries:
            first = boundaries[0]
            if type(first) is int and 0 <= first < len(vertices):
                return np.array(vertices[first], float)
    return None
