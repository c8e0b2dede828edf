"""CityGML ImplicitGeometry: prototypes in local coordinates, instanced at many places."""

from dataclasses import dataclass, replace

import numpy as np

from ..city.polygon import Polygon

NOT_HELD = "implicit geometry whose prototype is not in the file"


@dataclass
class Anchor:
    """Position, rotation and scale of one instance."""

    matrix: np.ndarray  # (4, 4) float64
    point: np.ndarray  # (3,) float64, in the units of the file

    def place(self, polygons):
        """Polygons of a prototype transformed to this instance: list of Polygon."""
        return [replace(one, rings=[self._move(ring) for ring in one.rings], implicit=True) for one in polygons]

    def _move(self, ring):
        return ring @ self.matrix[:3, :3].T + self.matrix[:3, 3] + self.point


def read_anchor(element):
    """Reference point and transformation matrix of an ImplicitGeometry.

    Parameters
    ----------
    element : lxml element

    Returns
    -------
    Anchor or None
        None if the point or the matrix is missing or invalid.
    """
    point = _numbers(next(element.iterfind("{*}referencePoint//{*}pos"), None), 3)
    matrix = element.find("{*}transformationMatrix")
    matrix = np.eye(4).ravel() if matrix is None else _numbers(matrix, 16)
    if point is None or matrix is None:
        return None
    return Anchor(matrix.reshape(4, 4), point)


def _numbers(element, count):
    try:
        numbers = np.array([float(word) for word in element.text.split()]) if element is not None else np.empty(0)
    except (ValueError, AttributeError):
        return None
    return numbers if len(numbers) == count and np.isfinite(numbers).all() else None


def place_shapes(content):
    """Instance the prototypes that are given by reference.

    Parameters
    ----------
    content : FileContent
        The polygons of its instances are appended.
    """
    for target, anchor, place, name in content.instances:
        shape = content.prototypes.get(target)
        if shape is None:
            content.skip(NOT_HELD, name)
            continue
        own = [
            Polygon(one.surface_id, place.building, place.part, place.thematic or one.thematic, place.lod, one.source,
                    one.rings, one.line, one.flipped)
            for one in shape
        ]  # fmt: skip
        content.polygons += anchor.place(own)
