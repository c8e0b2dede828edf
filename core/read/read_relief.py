"""TIN reliefs: triangles of terrain from CityGML and CityJSON, in a file of buildings or in one of
their own.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..city.axis_order import PlaceHints, order_axes
from ..city.city import Relief
from ..city.name_crs import choose_crs
from ..city.polygons import triangulate
from ..city.terrain import Layer, Terrain
from ..city.transform_crs import UNITS, plane_of
from ..settings.errors import InputError
from .collect_polygons import read_numbers
from .collect_shapes import find_fault, read_lod, read_rings
from .open_input import LARGEST_COORDINATE, clean_name
from .parse_xml import iterate_elements
from .walk_boundaries import DEPTHS, walk_boundaries

BAD_TRIANGLE = "terrain surface that is not a triangle with heights"
INSIDE = ("Building", "Bridge", "Tunnel")  # their triangles are no terrain


@dataclass
class GmlRelief:
    """Collects the terrain triangles of a CityGML file while it is streamed."""

    relief: Relief  # grows
    above: object = ""  # the TINRelief of the last triangle: an element of lxml, or None
    lod: str = ""  # its level of detail

    def add(self, element):
        """Add a triangle; what is wrong with it, or None."""
        above = next(element.iterancestors("{*}TINRelief"), None)
        if above is not self.above:
            lod = above.findtext("{*}lod", default="").strip() if above is not None else ""
            self.above, self.lod = above, lod if lod in ("0", "1", "2", "3", "4") else ""
            for one in (*element.iter("*"), *element.iterancestors()):
                if one.get("srsName"):
                    self.relief.srs_names.setdefault(one.get("srsName"), one.sourceline)
        numbers = read_numbers(element.iter("{*}posList", "{*}pos", "{*}coordinates"))
        if numbers is None:
            return "coordinates that are not numeric"
        if len(numbers) not in (9, 12):
            return f"a triangle with {len(numbers)} numbers"
        if not np.abs(numbers).max() <= LARGEST_COORDINATE:  # also true for NaN
            return f"a coordinate is not finite or beyond {LARGEST_COORDINATE:g}"
        self.relief.corners[self.lod].extend(numbers[:9])
        return None


def collect_json_relief(city_object, name, vertices, content):
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
    geometries, name = city_object.get("geometry"), clean_name(name)
    for geometry in geometries if isinstance(geometries, list) else []:
        problem = find_fault(geometry)
        if problem or DEPTHS.get(geometry["type"]) != 0:
            content.skip(problem or "terrain geometry without surfaces", name)
            continue
        try:
            surfaces, _ = walk_boundaries(geometry)
        except ValueError as error:
            content.skip(str(error), name)
            continue
        rings_of = []
        for number, surface in enumerate(surfaces):
            rings, problem = read_rings(surface.rings, vertices)
            if problem or min(map(len, rings)) < 4:  # each ring ends where it begins
                content.skip(problem or BAD_TRIANGLE, f"{name}, surface {number + 1}")
            else:
                rings_of.append([ring[:-1] for ring in rings])
        if rings_of:
            flat = [ring for rings in rings_of for ring in rings]
            starts, points = np.cumsum([0, *map(len, rings_of)]), np.concatenate(flat)
            triangles, _ = triangulate(points, np.cumsum([0, *map(len, flat)]), starts)
            content.relief.corners[read_lod(geometry)].extend(points[triangles].ravel())


def _relief_layers(relief):
    """Layers of a relief by their level of detail, the finest first.

    Parameters
    ----------
    relief : Relief

    Returns
    -------
    dict of str to Layer
        Each place once, in the order and the units of the file.
    """
    layers = {}
    for lod in sorted(lod for lod, numbers in relief.corners.items() if numbers)[::-1]:
        corners = np.frombuffer(relief.corners[lod], float).reshape(-1, 3)
        points, index = np.unique(corners, axis=0, return_inverse=True)
        layers[lod] = Layer(points, index.reshape(-1, 3))
    return layers


def read_relief(path):
    """Triangles of all TIN reliefs in a file of CityGML.

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
    relief, no_terrain = Relief(), [f"{{*}}{name}" for name in INSIDE]
    reliefs = GmlRelief(relief)
    for element in iterate_elements(path, ("Envelope", "Triangle", *INSIDE)):
        name = element.tag.rpartition("}")[2]
        if name == "Envelope" and element.get("srsName"):
            relief.srs_names.setdefault(element.get("srsName"), element.sourceline)
        elif name == "Triangle" and next(element.iterancestors(*no_terrain), None) is None:
            problem = reliefs.add(element)
            if problem:
                raise InputError(
                    path, f"line {element.sourceline}: {problem}", "correct or remove this triangle"
                )
    if not relief.count():
        raise InputError(
            path, "contains no TINRelief", "give terrain as triangles, a GeoTIFF or an ASC grid"
        )
    return list(_relief_layers(relief).values()), _crs_of_relief(relief, path)


def place_relief(contents, city, unit):
    """Terrain of a city from the reliefs of its files, tiles of one level of detail joined.

    A relief stands in the system that it names, else in its file's, else in the other files'.

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
            crs = _crs_of_relief(content.relief, content.path) or content.crs or common
            for lod, layer in _relief_layers(content.relief).items():
                placed = place_layer(layer, (crs, content.axes), city, UNITS[unit], content.path)
                of_lod.setdefault(lod, []).append(placed)
        except InputError as error:  # the city can do without
            city.report.notes.append(f"Terrain of {error.source} left out: {error.problem}.")
    joined = []
    for _, layers in sorted(of_lod.items(), reverse=True):
        starts = np.cumsum([0, *(len(layer.points) for layer in layers)])
        triangles = [
            layer.triangles + start for layer, start in zip(layers, starts[:-1], strict=True)
        ]
        joined.append(
            Layer(np.concatenate([layer.points for layer in layers]), np.concatenate(triangles))
        )
    return Terrain(", ".join(sources), joined) if joined else None


def _crs_of_relief(relief, path):
    """The one system that a relief itself names, or None.

    Raises
    ------
    InputError
        It names two.
    """
    easting = next((numbers[0] for numbers in relief.corners.values() if numbers), None)
    return choose_crs(relief.srs_names, easting, path)[0]


def place_layer(layer, system, city, unit, path):
    """A layer whose points stand as in the file, brought to the plane of the city.

    Parameters
    ----------
    layer : Layer
    system : tuple
        Coordinate reference system, None for the city's, and the order of coordinates where nothing
        decides it.
    city : City
    unit : float
        [m] The unit of points without a system.
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
    crs, axes = system
    own = city.grid
    if own.crs is None or crs is None:
        # A city in the plane of its files has metres; the unit tells how long the terrain's are.
        points = layer.points * unit if own.plane is None else own.to_plane(layer.points)
        return Layer(points, layer.triangles)
    order = order_axes(
        np.median(layer.points, axis=0)[:2] if len(layer.points) else None, crs, PlaceHints()
    )
    axes = order.axes if order.reason else axes
    points = replace(own, crs=crs, axes=axes, plane=own.plane or own.crs).to_plane(layer.points)
    if not np.isfinite(points).all():
        name = plane_of(own.plane or own.crs)[0].name
        raise InputError(
            path, f"does not lie where {name} is defined", "give terrain that covers the city"
        )
    return Layer(points, layer.triangles)
