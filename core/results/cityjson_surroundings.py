"""Trees and terrain of a city as objects of CityJSON, so that a city that was written is read again
with its shade.
"""

import numpy as np

from ..city.city import free_name


def list_points(city):
    """Points of all trees, and of the terrain of the files, in the order of `list_objects`: (k, 3)
    float64 [m].
    """
    rings = [ring for tree in city.trees for polygon in tree.polygons for ring in polygon.rings]
    places = [tree.place[None] for tree in city.trees if tree.place is not None]
    layers = [] if city.terrain is None else [layer.points for layer in city.terrain.layers]
    return np.concatenate([np.empty((0, 3)), *rings, *places, *layers])


def list_objects(city, index, taken):
    """City objects of all trees and of the terrain.

    Parameters
    ----------
    city : City
    index : list of int
        Vertex of each point of `list_points`.
    taken : collection of str
        Names of other objects.

    Returns
    -------
    dict of str to dict
        Name -> city object; a name that is taken gets a free number behind it.
    """
    objects, taken, start = {}, dict.fromkeys(taken, 1), 0
    # A tree with the shapes that its file gives; rings without the corner that closes them, and
    # backwards where the polygon had been flipped.
    for tree in city.trees:
        surfaces = []
        for polygon in tree.polygons:
            surface = []
            for ring in polygon.rings:
                corners = index[start : start + len(ring)]
                start += len(ring)
                corners = corners[:-1] if corners[0] == corners[-1] else corners
                surface.append(corners[::-1] if polygon.flipped else corners)
            surfaces.append(surface)
        lod = (tree.polygons[0].lods[0] if tree.polygons else "") or "2"
        shape = [{"type": "MultiSurface", "lod": lod, "boundaries": surfaces}] if surfaces else []
        objects[free_name(tree.name, taken)] = _describe_tree(tree) | {"geometry": shape}
    # Points where trees stand come after all their shapes.
    for tree, item in zip(city.trees, objects.values(), strict=True):
        if tree.place is not None:
            item["geometry"].append(
                {"type": "MultiPoint", "lod": "1", "boundaries": [index[start]]}
            )
            start += 1
    # The terrain's triangles, without those that were rounded to a line.
    layers = [] if city.terrain is None else city.terrain.layers
    for number, layer in enumerate(layers):
        own = np.array(index[start : start + len(layer.points)])
        start += len(layer.points)
        boundaries = [
            [corners] for corners in own[layer.triangles].tolist() if len(set(corners)) == 3
        ]
        # The finest layer comes first, and has the highest level of detail.
        lod = str(len(layers) - number)
        geometry = [{"type": "CompositeSurface", "lod": lod, "boundaries": boundaries}]
        objects[free_name("terrain", taken)] = {"type": "TINRelief", "geometry": geometry}
    return objects


def _describe_tree(tree):
    """Type and attributes of a tree, hedge or group of plants."""
    height = "averageHeight" if tree.cover else "height"
    numbers = {
        height: tree.height,
        "crownDiameter": tree.crown_diameter,
        "trunkDiameter": tree.trunk_diameter,
    }
    numbers |= {"leafAreaDensity": tree.area_density}
    attributes = {name: float(value) for name, value in numbers.items() if value is not None}
    attributes |= {"class": "conifer"} if tree.evergreen else {}
    return {
        "type": "PlantCover" if tree.cover else "SolitaryVegetationObject",
        "attributes": attributes,
    }
