"""Collect the polygons of one CityJSON object from its geometries, and say what of them cannot be used."""

import re
from collections import Counter
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..city.polygon import Polygon
from .limits import clean_name
from .walk_boundaries import DEPTHS, INTERIOR, read_class, walk_boundaries

LOD = re.compile(r"[0-4](\.\d)?")
SOURCES = ("surface", "solid", "multisurface")  # the order in which one drawing of a building beats another
INSTANCE = "GeometryInstance"
CAVITY = "inner shell of a solid: a cavity never sees the sky"
INSIDE = "interior surface"
BAD_LOD = "no level of detail that means anything"
UNSOUND = "geometries have semantics that do not fit their boundaries; what could be told of their classes was kept"
NO_LOD = "geometries name no level of detail; they are read where a building has no other"


class Owner(NamedTuple):
    """Whose shapes are read."""

    name: str  # of the city object
    building: int  # into FileContent.buildings
    part: int
    thematic: str  # of surfaces that name no class of their own
    line: int  # where the JSON text of the object begins


@dataclass
class Shapes:
    """What geometries refer to, and what was met on the way."""

    content: object  # FileContent, which grows
    vertices: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))  # (n, 3) float64, in the file's units
    templates: object = None  # Templates
    remarks: dict = field(default_factory=dict)  # what is worth a note -> names of objects

    def remark(self, words, name):
        """Remember that something was met in an object."""
        self.remarks.setdefault(words, []).append(name)


def collect_shapes(one, owner, shapes):
    """Add the polygons of one city object to the content of its file.

    Several drawings of an object in one LoD (a Solid beside a MultiSurface) are told apart by their ``source``: those
    with semantics come before those without, solids before surfaces.

    Parameters
    ----------
    one : dict
        The city object.
    owner : Owner
    shapes : Shapes
    """
    geometries = one.get("geometry")
    if geometries is not None and not isinstance(geometries, list):
        shapes.content.skip("geometry that is no list", owner.name)
        return
    drawn = []
    for geometry in geometries or []:
        problem = find_fault(geometry)
        if problem:
            shapes.content.skip(problem, owner.name)
        elif geometry["type"] == INSTANCE:
            shapes.content.polygons += shapes.templates.set_down(geometry, owner, shapes)
        else:
            drawn.append((read_lod(geometry), geometry))
    for lod, geometry in drawn:
        rivals = sorted({_standing(other) for other_lod, other in drawn if other_lod == lod})
        source = SOURCES[min(rivals.index(_standing(geometry)), 2)]
        shapes.content.polygons += draw_geometry(geometry, owner, source, shapes)


def find_fault(geometry):
    """Why a geometry has no surfaces to offer, or None."""
    if not isinstance(geometry, dict):
        return "geometry that is no JSON object"
    kind = geometry.get("type")
    if kind in ("MultiPoint", "MultiLineString"):
        return f"{kind}: no surfaces"
    if not isinstance(kind, str) or (kind not in DEPTHS and kind != INSTANCE):
        return "geometry of an unknown type"
    if {"boundaries", "semantics", "lod"}.intersection(getattr(geometry, "names", ())):
        return "geometry that gives its boundaries, semantics or level of detail twice"
    return BAD_LOD if kind != INSTANCE and read_lod(geometry) is None else None


def read_lod(geometry):
    """LoD as text, "" where there is none, None where it makes no sense."""
    lod = geometry.get("lod")
    if lod is None:
        return ""
    text = f"{lod:g}" if type(lod) in (int, float) and abs(lod) < 10 else lod
    return text if isinstance(text, str) and LOD.fullmatch(text) else None


def draw_geometry(geometry, owner, source, shapes):
    """Polygons of one geometry that is drawn in place.

    Parameters
    ----------
    geometry : dict
        One without a fault, no instance.
    owner : Owner
    source : str
    shapes : Shapes

    Returns
    -------
    list of Polygon
    """
    content, lod = shapes.content, read_lod(geometry)
    try:
        surfaces, matching = walk_boundaries(geometry)
    except ValueError as error:
        content.skip(str(error), owner.name)
        return []
    if not matching:
        shapes.remark(UNSOUND, owner.name)
    if not lod:
        shapes.remark(NO_LOD, owner.name)
    polygons, uses = [], Counter(_own_name(surface.semantics) for surface in surfaces)
    for number, surface in enumerate(surfaces):
        thematic = read_class(surface.semantics)
        rings, problem = read_rings(surface.rings, shapes.vertices)
        if surface.inner or thematic in INTERIOR:
            problem = CAVITY if surface.inner else INSIDE
        if problem:
            content.skip(problem, f"{owner.name}, LoD {lod or 'unknown'}, surface {number + 1}")
            continue
        name = _own_name(surface.semantics)
        place = owner.building, owner.part, thematic or owner.thematic, lod, source
        polygons.append(Polygon(name if uses[name] == 1 else "", *place, rings, owner.line))
    return polygons


def read_rings(rings, vertices):
    """Rings of one surface as coordinates, and what is wrong with them or None.

    Parameters
    ----------
    rings : object
        As in the file: lists of numbers of vertices, the outline first.
    vertices : array, (n, 3) float64

    Returns
    -------
    list of (k, 3) float64 or None, str or None
        Each ring ends where it begins.
    """
    if not isinstance(rings, list) or not rings or set(map(type, rings)) != {list}:
        return None, "surface without an outline" if rings == [] else "surface that is no list of rings"
    found = []
    for ring in rings:
        if not {int}.issuperset(map(type, ring)):
            return None, "corner that is no number of a vertex"
        if ring and (min(ring) < 0 or max(ring) >= len(vertices)):
            return None, "corner that is no vertex of the file"
        closed = ring if len(ring) > 1 and ring[0] == ring[-1] else ring + ring[:1]
        found.append(vertices[np.array(closed, np.intp)])
    return found, None


def _standing(geometry):
    """Smaller for the drawing to be kept: with semantics before without, solids before surfaces."""
    return not isinstance(geometry.get("semantics"), dict), DEPTHS[geometry["type"]] == 0


def _own_name(semantics):
    name = semantics.get("id")
    return clean_name(name) if isinstance(name, str) else ""
