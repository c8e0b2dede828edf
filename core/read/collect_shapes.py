"""Collect the polygons of one CityJSON object from its geometries, and report those that cannot be
used.
"""

import re
from collections import Counter
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..city.city import Polygon
from ..settings.errors import InputError
from .collect_polygons import place_prototype
from .open_input import LARGEST_COORDINATE, clean_name
from .walk_boundaries import CLASSES, DEPTHS, INTERIOR, read_numbers, read_vertices, walk_boundaries

INSTANCE = "GeometryInstance"
# instanced polygons of one file; a template instanced a million times fills any memory
MOST_PLACED = 500_000
NO_PLACE = "instance with a missing reference point or an invalid matrix"


class Owner(NamedTuple):
    """The city object whose geometries are read."""

    name: str  # of the city object
    building: int  # into FileContent.buildings
    part: int
    thematic: str  # default for surfaces without a class of their own
    line: int  # first line of the object's JSON text
    installation: bool = False


@dataclass
class Shapes:
    """What geometries refer to, and remarks collected while reading."""

    content: object  # FileContent, polygons are appended
    vertices: np.ndarray  # (n, 3) float64, in the file's units
    templates: object  # Templates
    remarks: dict  # remark -> list of the names of objects


def collect_shapes(one, owner, shapes):
    """Append the polygons of one city object to the content of its file.

    Several geometries of an object in one LoD (a Solid and a MultiSurface) are distinguished by
    their ``source``: those with semantics are preferred to those without, solids to surfaces.

    Parameters
    ----------
    one : dict
        The city object.
    owner : Owner
    shapes : Shapes
    """
    geometries = one.get("geometry")
    if geometries is not None and not isinstance(geometries, list):
        shapes.content.skip("geometry is not a list", owner.name)
        return
    drawn = []
    for geometry in geometries or []:
        problem = find_fault(geometry)
        if problem:
            shapes.content.skip(problem, owner.name)
        elif geometry["type"] == INSTANCE:
            shapes.content.polygons += shapes.templates.place_instance(geometry, owner, shapes)
        else:
            drawn.append((read_lod(geometry), geometry))
    # Geometries with semantics come before others, solids before surfaces.
    ranks = [
        (not isinstance(one.get("semantics"), dict), DEPTHS[one["type"]] == 0) for _, one in drawn
    ]
    for (lod, geometry), rank in zip(drawn, ranks, strict=True):
        rivals = sorted(
            {other for (other_lod, _), other in zip(drawn, ranks, strict=True) if other_lod == lod}
        )
        # Between geometries of the same level of detail surfaces come before solids.
        source = ("surface", "solid", "multisurface")[min(rivals.index(rank), 2)]
        shapes.content.polygons += _draw_geometry(geometry, owner, source, shapes)


def find_fault(geometry):
    """Why a geometry has no usable surfaces, or None."""
    if not isinstance(geometry, dict):
        return "geometry is not a JSON object"
    kind = geometry.get("type")
    if not isinstance(kind, str) or (kind not in DEPTHS and kind != INSTANCE):
        return (
            f"{clean_name(kind)[:20]}: no surfaces"
            if isinstance(kind, str)
            else "geometry without a type"
        )
    if {"boundaries", "semantics", "lod"}.intersection(getattr(geometry, "names", ())):
        return "geometry with boundaries, semantics or level of detail given twice"
    return "invalid level of detail" if kind != INSTANCE and read_lod(geometry) is None else None


def read_lod(geometry):
    """LoD as text, "" if missing, None if invalid."""
    lod = geometry.get("lod")
    if lod is None:
        return ""
    text = f"{lod:g}" if type(lod) in (int, float) and abs(lod) < 10 else lod
    return text if isinstance(text, str) and re.fullmatch(r"[0-4](\.\d)?", text) else None


def _draw_geometry(geometry, owner, source, shapes):
    """Polygons of one geometry given in world coordinates.

    Parameters
    ----------
    geometry : dict
        A valid one (see `find_fault`), not an instance.
    owner : Owner
    source : str
    shapes : Shapes

    Returns
    -------
    list of Polygon
    """
    content, lod = shapes.content, read_lod(geometry)
    # Rings of the geometry with what its semantics say of each; one whose lists are not nested as
    # its type asks is left out and told.
    try:
        surfaces, matching = walk_boundaries(geometry)
    except ValueError as error:
        content.skip(str(error), owner.name)
        return []
    # Semantics that do not match, and no level of detail, are only remarked.
    if not matching:
        unsound = (
            "geometries have semantics that do not match their boundaries; the classes that "
            "could be assigned were kept"
        )
        shapes.remarks[unsound].append(owner.name)
    if not lod:
        no_lod = (
            "geometries give no level of detail; they are used only for buildings without any other"
        )
        shapes.remarks[no_lod].append(owner.name)
    # An id counts only if one surface alone has it.
    ids = [surface.semantics.get("id") for surface in surfaces]
    ids = [clean_name(one) if isinstance(one, str) else "" for one in ids]
    polygons, uses = [], Counter(ids)
    # Cavities, interiors and broken rings are left out, and told.
    for number, (surface, name) in enumerate(zip(surfaces, ids, strict=True)):
        thematic = surface.semantics.get("type")
        thematic = thematic if isinstance(thematic, str) and thematic in CLASSES else ""
        rings, problem = read_rings(surface.rings, shapes.vertices)
        if surface.inner:
            problem = "inner shell of a solid: cavities receive no light"
        elif thematic in INTERIOR:
            problem = "interior surface"
        if problem:
            content.skip(problem, f"{owner.name}, LoD {lod or 'unknown'}, surface {number + 1}")
            continue
        place = owner.building, owner.part, thematic or owner.thematic, (lod,), source
        known = name if uses[name] == 1 else ""
        polygons.append(Polygon(known, *place, rings, owner.line, installation=owner.installation))
    return polygons


def read_rings(rings, vertices):
    """Rings of one surface as coordinates, and a problem with them or None.

    Parameters
    ----------
    rings : object
        As in the file: lists of vertex indices, the exterior ring first.
    vertices : array, (n, 3) float64

    Returns
    -------
    list of (k, 3) float64 or None, str or None
        Closed: the first point is repeated at the end.
    """
    if not isinstance(rings, list) or not rings or set(map(type, rings)) != {list}:
        return (
            None,
            "surface without an exterior ring" if rings == [] else "surface is not a list of rings",
        )
    coordinates = []
    for ring in rings:
        if not {int}.issuperset(map(type, ring)):
            return None, "vertex index is not an integer"
        if ring and (min(ring) < 0 or max(ring) >= len(vertices)):
            return None, "vertex index out of range"
        indices = ring if len(ring) > 1 and ring[0] == ring[-1] else ring + ring[:1]
        coordinates.append(vertices[np.array(indices, np.intp)])
    return coordinates, None


class Templates:
    """Templates of one header, each read on first use."""

    def __init__(self, path, line, value):
        members, name = value if isinstance(value, dict) else {}, "vertices-templates"
        shapes = members.get("templates")
        self._path, self._shapes = path, shapes if isinstance(shapes, list) else []
        self._vertices, _ = read_vertices(path, line, members.get(name), name=name)
        self._drawn, self._count = {}, 0

    def place_instance(self, geometry, owner, shapes):
        """Polygons of one instance of a template, placed by its matrix; none where that cannot be,
        and the report says why.

        Parameters
        ----------
        geometry : dict
            Of the type GeometryInstance.
        owner : Owner
        shapes : Shapes

        Returns
        -------
        list of Polygon
        """
        # The shape of a template is read when first asked for.
        number, matrix = geometry.get("template"), _read_matrix(geometry, shapes.vertices)
        if type(number) is not int or not 0 <= number < len(self._shapes):
            fault = "instance of a template that is not in the file"
        elif matrix is None:
            fault = NO_PLACE
        else:
            if number not in self._drawn:
                self._drawn[number] = self._draw(number, owner, shapes)
            drawn, fault = self._drawn[number]
        # Polygons of all instances count towards a limit, beyond which the file is refused
        # (InputError). They take the building of their owner, and its class where they have none.
        if not fault:
            self._count += len(drawn)
            if self._count > MOST_PLACED:
                raise InputError(
                    self._path,
                    f"its template instances have more than {MOST_PLACED:,} polygons",
                    "split the file into tiles",
                )
            place = {
                "building": owner.building,
                "part": owner.part,
                "line": owner.line,
                "surface_id": "",
            }
            place["installation"] = owner.installation
            drawn = [
                replace(polygon, thematic=polygon.thematic or owner.thematic, **place)
                for polygon in drawn
            ]
            # Placed by its matrix, unless that takes it out of this world.
            placed = place_prototype(drawn, matrix)
            if all(
                np.abs(ring).max(initial=0) <= LARGEST_COORDINATE
                for polygon in placed
                for ring in polygon.rings
            ):
                return placed
            fault = NO_PLACE
        shapes.content.skip(fault, owner.name)
        return []

    def _draw(self, number, owner, shapes):
        """Polygons of one template in local coordinates, and why there are none."""
        geometry, drawn = self._shapes[number], []
        fault = find_fault(geometry)
        if not fault and geometry["type"] == INSTANCE:
            fault = "it is an instance itself"
        if not fault:
            name = owner._replace(name=f"template {number}", thematic="")
            local = Shapes(shapes.content, self._vertices, None, shapes.remarks)
            drawn = _draw_geometry(geometry, name, "surface", local)
        return (
            drawn,
            ""
            if drawn
            else f"instance of a template that cannot be used ({fault or 'it has no surfaces'})",
        )


def _read_matrix(geometry, vertices):
    """Matrix of an instance, as of `place_prototype`, or None."""
    boundaries, values = geometry.get("boundaries"), geometry.get("transformationMatrix")
    if not isinstance(boundaries, list) or len(boundaries) != 1 or type(boundaries[0]) is not int:
        return None
    matrix = np.eye(4).ravel() if values is None else read_numbers(values, 16)
    if (
        matrix is None
        or not 0 <= boundaries[0] < len(vertices)
        or (matrix[12:] != [0, 0, 0, 1]).any()
    ):
        return None
    matrix = matrix.reshape(4, 4)
    matrix[:3, 3] += vertices[boundaries[0]]
    return matrix
