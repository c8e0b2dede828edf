"""The geometries of CityJSON to polygons: shells, surfaces and rings, with the class that semantics gives them."""

from dataclasses import dataclass

import numpy as np

from .collect_polygons import THEMATIC
from .polygon import Polygon

DEPTHS = {"MultiSurface": 1, "CompositeSurface": 1, "Solid": 2, "MultiSolid": 3, "CompositeSolid": 3}
SOLIDS = {"Solid", "MultiSolid", "CompositeSolid"}
NO_SURFACES = {"MultiPoint", "MultiLineString"}
LONGEST_ID = 200  # characters
INTERIOR = {"InteriorWallSurface", "CeilingSurface", "FloorSurface"}


@dataclass
class Owner:
    """The city object that geometries belong to."""

    name: str
    building: int
    part: int
    thematic: str  # "" or BuildingInstallation, which its surfaces then are
    line: int


def collect_geometry(geometry, vertices, owner, content, *, source="surface", lod=None):
    """Polygons of one geometry.

    Parameters
    ----------
    geometry : dict
        MultiSurface, CompositeSurface, Solid, MultiSolid or CompositeSolid.
    vertices : (v, 3) float64
    owner : Owner
    content : FileContent
        Grows by what had to be skipped.
    source : {'surface', 'multisurface'}
        The second for one that draws again what another geometry of its object draws.
    lod : str

    Returns
    -------
    list of Polygon
    """
    kind = geometry.get("type")
    semantics = geometry.get("semantics")
    semantics = semantics if isinstance(semantics, dict) else {}
    surfaces, values = semantics.get("surfaces"), semantics.get("values")
    surfaces = surfaces if isinstance(surfaces, list) else []
    boundaries = geometry.get("boundaries")
    uses = {}
    polygons = []
    for boundary, value in _surfaces(boundaries, values, DEPTHS[kind], owner, content):
        surface = surfaces[value] if _is_index(value) and value < len(surfaces) else {}
        surface = surface if isinstance(surface, dict) else {}
        thematic = surface.get("type")
        if thematic in INTERIOR:
            continue
        rings = _rings(boundary, vertices)
        if isinstance(rings, str):
            content.skip(rings, owner.name)
            continue
        name = surface.get("id")
        name = name if isinstance(name, str) and name.isprintable() and len(name) <= LONGEST_ID else ""
        uses[name] = uses.get(name, 0) + 1
        thematic = owner.thematic or (thematic if thematic in THEMATIC else "")
        polygons.append(Polygon(name, owner.building, owner.part, thematic, lod, source, rings, owner.line))
    for polygon in polygons:
        if uses[polygon.surface_id] > 1:  # a semantic surface of several polygons names none of them
            polygon.surface_id = ""
    return polygons


def _surfaces(boundaries, values, depth, owner, content):
    """Pairs of a surface (list of rings) and its number among the semantic surfaces or None."""
    if not isinstance(boundaries, list):
        content.skip("boundaries that are no list", owner.name)
        return
    if not isinstance(values, list):
        values = [values] * len(boundaries)  # one value may stand for all below it
    elif len(values) != len(boundaries):
        content.skip("semantics that do not fit the boundaries (the surfaces are kept)", owner.name)
        values = [None] * len(boundaries)
    for k, (boundary, value) in enumerate(zip(boundaries, values, strict=True)):
        if depth == 2 and k > 0:
            content.skip("inner shell of a solid: it never sees the sky", owner.name)
        elif depth == 1:
            yield boundary, value
        else:
            own = 1 if depth == 2 else 2
            yield from _surfaces(boundary, value, own, owner, content)


def _rings(boundary, vertices):
    """Closed rings of a surface, list of (k + 1, 3) float64, or what is wrong with them."""
    if not isinstance(boundary, list) or not boundary or not all(isinstance(ring, list) for ring in boundary):
        return "boundaries that are no lists of rings"
    rings = []
    for ring in boundary:
        if not all(type(index) is int for index in ring):
            return "a ring whose corners are not numbers of vertices"
        if ring and (min(ring) < 0 or max(ring) >= len(vertices)):
            return "a ring that names a vertex the file does not hold"
        # CityJSON never closes a ring; here it ends where it begins, so that none counts as mended.
        rings.append(vertices[ring + ring[:1]] if ring else np.empty((0, 3)))
    return rings


def _is_index(value):
    return type(value) is int and value >= 0
