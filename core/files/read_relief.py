"""Read the triangles of a CityGML TINRelief."""

import numpy as np

from ..city.name_crs import name_crs
from ..errors import InputError
from ..ground.terrain import Layer
from .limits import LARGEST_COORDINATE
from .parse_xml import CUT, iterate_elements

INSIDE = ("Building", "Bridge", "Tunnel")  # triangles inside these are not terrain


def read_relief(path):
    """Triangles of all TIN reliefs in a file.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    layer : Layer
        Points in the order and the units of the file.
    crs : str or None
        As accepted by pyproj.CRS.from_user_input.

    Raises
    ------
    InputError
        Not XML, no triangles, or coordinates that are not numeric.
    """
    corners, srs_names = [], {}
    for element in iterate_elements(path, ("Envelope", "Triangle", *INSIDE)):
        name = element.tag.rpartition("}")[2]
        if name == "Envelope":
            srs_names.setdefault(element.get("srsName"), element.sourceline)
        elif name == "Triangle" and not any(_local(parent) in INSIDE for parent in element.iterancestors()):
            if not corners:
                _note_srs_names(element, srs_names)
            corners.append(_read_triangle(element, path))
    if not corners:
        raise InputError(path, "contains no TINRelief", "give terrain as triangles, a GeoTIFF or an ASC grid")
    points, index = np.unique(np.concatenate(corners), axis=0, return_inverse=True)
    named = {name_crs(text, points[0, 0]) for text in srs_names if text}
    named.discard(None)
    if len({crs.split("+")[0] for crs in named}) > 1:
        raise InputError(
            path, f"uses two coordinate reference systems: {' and '.join(sorted(named))}", "convert it to one"
        )
    return (Layer(points, index.reshape(-1, 3)), max(named, key=len, default=None))


def _local(element):
    return element.tag.rpartition("}")[2]


def _note_srs_names(element, srs_names):
    for one in (*element.iter("*"), *element.iterancestors()):
        if one.get("srsName"):
            srs_names.setdefault(one.get("srsName"), one.sourceline)


def _read_triangle(element, path):
    """Corners of one triangle, (3, 3)."""
    texts = [part.text or "" for part in element.iter("{*}posList", "{*}pos", "{*}coordinates")]
    line = element.sourceline
    try:
        numbers = np.array([float(word) for text in texts for word in text.replace(",", " ").split()])
    except ValueError:
        raise InputError(path, f"line {line}: coordinates that are not numeric", CUT) from None
    if len(numbers) not in (9, 12):
        raise InputError(
            path, f"line {line}: a triangle with {len(numbers)} numbers", "give three vertices with heights"
        )
    if not np.abs(numbers).max() <= LARGEST_COORDINATE:  # also true for NaN
        problem = f"line {line}: a coordinate is not finite or beyond {LARGEST_COORDINATE:g}"
        raise InputError(path, problem, "correct or remove this triangle")
    return numbers[:9].reshape(3, 3)
