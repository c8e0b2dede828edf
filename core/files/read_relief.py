"""Read the triangles of a CityGML TINRelief."""

from ..city.relief import Relief
from ..settings.errors import InputError
from .collect_relief import note_srs_names, read_relief_lod, read_triangle, relief_above, relief_layers
from .parse_xml import iterate_elements
from .place_relief import crs_of_relief

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
