"""Collect the triangles of TIN reliefs: of CityGML element by element, of CityJSON object by object."""

import numpy as np

from ..city.terrain import Layer
from ..city.triangulate import triangulate
from .collect_shapes import find_fault, read_lod, read_rings
from .limits import LARGEST_COORDINATE, clean_name
from .walk_boundaries import DEPTHS, walk_boundaries

BAD_TRIANGLE = "terrain surface that is not a triangle with heights"
NO_SURFACES = "terrain geometry without surfaces"


def read_triangle(element):
    """Corners of a triangle of GML.

    Parameters
    ----------
    element : lxml element

    Returns
    -------
    array, (9,) float64, or None
        In the order and the units of the file.
    str or None
        What is wrong with it.
    """
    texts = [part.text or "" for part in element.iter("{*}posList", "{*}pos", "{*}coordinates")]
    try:
        numbers = np.array([float(word) for text in texts for word in text.replace(",", " ").split()])
    except ValueError:
        return None, "coordinates that are not numeric"
    if len(numbers) not in (9, 12):
        return None, f"a triangle with {len(numbers)} numbers"
    if not np.abs(numbers).max() <= LARGEST_COORDINATE:  # also true for NaN
        return None, f"a coordinate is not finite or beyond {LARGEST_COORDINATE:g}"
    return numbers[:9], None


def relief_above(element):
    """The TINRelief that an element lies in, or None."""
    return next(element.iterancestors("{*}TINRelief"), None)


def read_relief_lod(relief):
    """Level of detail of a TINRelief of CityGML, "" where it names none that means anything."""
    lod = relief.findtext("{*}lod", default="").strip() if relief is not None else ""
    return lod if lod in ("0", "1", "2", "3", "4") else ""


def note_srs_names(element, srs_names):
    """Add the reference systems named by a triangle and its ancestors to {spelling: line}."""
    for one in (*element.iter("*"), *element.iterancestors()):
        if one.get("srsName"):
            srs_names.setdefault(one.get("srsName"), one.sourceline)


class GmlRelief:
    """Collects the terrain triangles of a CityGML file while it is streamed."""

    def __init__(self, content):
        self.content = content
        self.met, self.lod = None, ""  # the TINRelief of the last triangle, and its level of detail

    def add(self, element):
        """Add a triangle; invalid ones are skipped and listed."""
        relief = relief_above(element)
        if relief is not self.met:
            self.met, self.lod = relief, read_relief_lod(relief)
            note_srs_names(element, self.content.relief.srs_names)
        numbers, problem = read_triangle(element)
        if problem:
            self.content.skip(f"{BAD_TRIANGLE} ({problem})", f"line {element.sourceline}")
        else:
            self.content.relief.add(self.lod, numbers)


def collect_json_relief(one, name, vertices, content):
    """Add the surfaces of a TINRelief of CityJSON, cut into triangles where they are none.

    Parameters
    ----------
    one : dict
        The city object.
    name : str
    vertices : array, (n, 3) float64
        In the units of the file.
    content : FileContent
        Its relief grows.
    """
    geometries = one.get("geometry")
    for geometry in geometries if isinstance(geometries, list) else []:
        problem = find_fault(geometry)
        if problem or DEPTHS.get(geometry["type"]) != 0:
            content.skip(problem or NO_SURFACES, clean_name(name))
            continue
        try:
            surfaces, _ = walk_boundaries(geometry)
        except ValueError as error:
            content.skip(str(error), clean_name(name))
            continue
        polygons = []
        for number, surface in enumerate(surfaces):
            rings, problem = read_rings(surface.rings, vertices)
            if problem or min(map(len, rings)) < 4:  # each ring ends where it begins
                content.skip(problem or BAD_TRIANGLE, f"{clean_name(name)}, surface {number + 1}")
            else:
                polygons.append([ring[:-1] for ring in rings])
        content.relief.add(read_lod(geometry), _cut(polygons).ravel())


def _cut(polygons):
    """Corners of the triangles of some polygons, (t, 3, 3); a triangle stays one."""
    whole = [rings[0] for rings in polygons if len(rings) == 1 and len(rings[0]) == 3]
    others = [rings for rings in polygons if len(rings) > 1 or len(rings[0]) > 3]
    corners = np.array(whole).reshape(-1, 3, 3)
    if not others:
        return corners
    points = np.concatenate([ring for rings in others for ring in rings])
    ring_start = np.cumsum([0, *(len(ring) for rings in others for ring in rings)])
    triangles, _ = triangulate(points, ring_start, np.cumsum([0, *map(len, others)]))
    return np.concatenate([corners, points[triangles]])


def relief_layers(relief):
    """Layers of a relief, the finest level of detail first.

    Parameters
    ----------
    relief : Relief

    Returns
    -------
    list of Layer
        Each place once, in the order and the units of the file.
    """
    layers = []
    for lod in sorted(relief.corners, reverse=True):
        corners = np.frombuffer(relief.corners[lod], float).reshape(-1, 3)
        points, index = np.unique(corners, axis=0, return_inverse=True)
        layers.append(Layer(points, index.reshape(-1, 3)))
    return [layer for layer in layers if len(layer.triangles)]
