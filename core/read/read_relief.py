"""Collect the triangles of TIN reliefs: of CityGML element by element, of CityJSON object by object."""

import numpy as np

from ..city.city import Relief
from ..city.transform_crs import UNITS, bring_places, east_first, name_crs, plane_of
from ..city.triangulate import triangulate
from ..errors import InputError
from ..ground.terrain import Layer, Terrain
from .collect_shapes import find_fault, read_lod, read_rings
from .open_input import LARGEST_COORDINATE, clean_name
from .parse_xml import iterate_elements
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


INSIDE = ("Building", "Bridge", "Tunnel")  # their triangles are no terrain


def read_relief(path):
    """Triangles of all TIN reliefs in a file.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    layers : list of Layer
        The finest level of detail first; points in the order and the units of the file.
    crs : str or None
        What pyproj.CRS.from_user_input understands.

    Raises
    ------
    InputError
        Not XML, no triangles in it, or coordinates that are not numbers.
    """
    relief, last, lod = Relief(), None, ""
    for element in iterate_elements(path, ("Envelope", "Triangle", *INSIDE)):
        name = element.tag.rpartition("}")[2]
        if name == "Envelope" and element.get("srsName"):
            relief.srs_names.setdefault(element.get("srsName"), element.sourceline)
        elif name == "Triangle" and not any(_local(parent) in INSIDE for parent in element.iterancestors()):
            above = relief_above(element)
            if above is not last or not relief.corners:
                last, lod = above, read_relief_lod(above)
                note_srs_names(element, relief.srs_names)
            relief.add(lod, _refuse_or_read(element, path))
    if not relief.count():
        raise InputError(path, "contains no TINRelief", "give terrain as triangles, a GeoTIFF or an ASC grid")
    return relief_layers(relief), crs_of_relief(relief, path)


def _local(element):
    return element.tag.rpartition("}")[2]


def _refuse_or_read(element, path):
    numbers, problem = read_triangle(element)
    if problem:
        raise InputError(path, f"line {element.sourceline}: {problem}", "correct or remove this triangle")
    return numbers


def place_relief(contents, city, unit):
    """Terrain of a city from the reliefs of its files, tiles of one level of detail joined.

    A relief stands in the system that it names, else in that of its file, else in that of the other files.

    Parameters
    ----------
    contents : list of FileContent
        Each with its system, as `join_contents` leaves them.
    city : City
        What cannot be used goes into its report.
    unit : {'m', 'ft', 'us-ft'}
        Where no file names a coordinate reference system.

    Returns
    -------
    Terrain or None
        In the city's system [m]; None where no file holds a usable triangle.
    """
    common = max((content.crs for content in contents if content.crs), key=len, default=None)
    of_lod, sources = {}, []
    for content in contents:
        if not content.relief.count():
            continue
        sources.append(str(content.path))
        try:
            crs = crs_of_relief(content.relief, content.path) or content.crs or common
            for lod, layer in zip(_lods(content.relief), relief_layers(content.relief), strict=True):
                of_lod.setdefault(lod, []).append(place_layer(layer, crs, city.crs, UNITS[unit], content.path))
        except InputError as error:  # the city can do without
            city.report.notes.append(f"Terrain of {error.source} left out: {error.problem}.")
    layers = [join_layers(of_lod[lod]) for lod in sorted(of_lod, reverse=True)]
    return Terrain(", ".join(sources), layers) if layers else None


def _lods(relief):
    return [lod for lod in sorted(relief.corners, reverse=True) if relief.corners[lod]]


def join_layers(layers):
    """One layer of the triangles of several."""
    starts = np.cumsum([0, *(len(layer.points) for layer in layers)])
    triangles = [layer.triangles + start for layer, start in zip(layers, starts[:-1], strict=True)]
    return Layer(np.concatenate([layer.points for layer in layers]), np.concatenate(triangles))


def crs_of_relief(relief, path):
    """The one system that a relief itself names, or None.

    Raises
    ------
    InputError
        It names two.
    """
    easting = next((numbers[0] for numbers in relief.corners.values() if numbers), None)
    named = {name_crs(text, easting) for text in relief.srs_names} - {None}
    if len({crs.split("+")[0] for crs in named}) > 1:
        raise InputError(
            path, f"uses two coordinate reference systems: {' and '.join(sorted(named))}", "convert it to one"
        )
    return max(named, key=len, default=None)


def place_layer(layer, crs, city_crs, unit, path):
    """A layer whose points stand as in the file, brought to the city's system.

    Parameters
    ----------
    layer : Layer
    crs, city_crs : str or None
        Without one of them the points stand in the city's system already, but for their unit.
    unit : float
        [m] The unit of such points.
    path : path-like
        Named in errors.

    Returns
    -------
    Layer

    Raises
    ------
    InputError
        A place has no counterpart in the city's system.
    """
    if crs is None or city_crs is None:
        return Layer(layer.points * unit, layer.triangles)
    plane, factor = plane_of(crs)
    points, _ = east_first(layer.points, plane)
    places = bring_places(points[:, :2], plane, city_crs, path)
    return Layer(np.column_stack([places, points[:, 2] * factor]), layer.triangles)
