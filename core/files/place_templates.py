"""CityJSON geometry-templates, instanced at many places (GeometryInstance)."""

from dataclasses import replace

import numpy as np

from ..settings.errors import InputError
from .collect_shapes import INSTANCE, Shapes, draw_geometry, find_fault
from .limits import LARGEST_COORDINATE
from .place_shapes import Anchor
from .read_vertices import read_numbers, read_vertices

MOST_PLACED = 500_000  # instanced polygons of one file; a template instanced a million times fills any memory
NOT_HELD = "instance of a template that is not in the file"
NO_PLACE = "instance with a missing reference point or an invalid matrix"


class Templates:
    """Templates of one header, each read on first use."""

    def __init__(self, path, line, value):
        members = value if isinstance(value, dict) else {}
        shapes = members.get("templates")
        self._path, self._shapes = path, shapes if isinstance(shapes, list) else []
        name = "vertices-templates"
        self._vertices, _ = read_vertices(path, line, members.get(name), name=name)
        self._drawn, self._count = {}, 0

    def place_instance(self, geometry, owner, shapes):
        """Polygons of one instance.

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
        number, anchor = geometry.get("template"), _read_anchor(geometry, shapes.vertices)
        if type(number) is not int or not 0 <= number < len(self._shapes):
            shapes.content.skip(NOT_HELD, owner.name)
            return []
        if anchor is None:
            shapes.content.skip(NO_PLACE, owner.name)
            return []
        if number not in self._drawn:
            self._drawn[number] = self._draw(number, owner, shapes)
        drawn = self._drawn[number]
        if isinstance(drawn, str):
            shapes.content.skip(f"instance of a template that cannot be used ({drawn})", owner.name)
            return []
        self._count += len(drawn)
        if self._count > MOST_PLACED:
            problem = f"its template instances have more than {MOST_PLACED:,} polygons"
            raise InputError(self._path, problem, "split the file into tiles")
        place = {"building": owner.building, "part": owner.part, "line": owner.line}
        own = [replace(one, thematic=one.thematic or owner.thematic, surface_id="", **place) for one in drawn]
        placed = anchor.place(own)
        if any(np.abs(ring).max(initial=0) > LARGEST_COORDINATE for one in placed for ring in one.rings):
            shapes.content.skip(NO_PLACE, owner.name)
            return []
        return placed

    def _draw(self, number, owner, shapes):
        """Polygons of one template in local coordinates, or why there are none."""
        geometry = self._shapes[number]
        fault = find_fault(geometry)
        if not fault and geometry["type"] == INSTANCE:
            fault = "it is an instance itself"
        if fault:
            return fault
        name = owner._replace(name=f"template {number}", thematic="")
        local = Shapes(shapes.content, self._vertices, None, shapes.remarks)
        return draw_geometry(geometry, name, "surface", local) or "it has no surfaces"


def _read_anchor(geometry, vertices):
    """Position, rotation and scale of an instance, or None."""
    boundaries, values = geometry.get("boundaries"), geometry.get("transformationMatrix")
    if not isinstance(boundaries, list) or len(boundaries) != 1 or type(boundaries[0]) is not int:
        return None
    matrix = np.eye(4).ravel() if values is None else read_numbers(values, 16)
    if matrix is None or not 0 <= boundaries[0] < len(vertices) or (matrix[12:] != [0, 0, 0, 1]).any():
        return None
    return Anchor(matrix.reshape(4, 4), vertices[boundaries[0]])
