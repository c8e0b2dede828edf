"""Vertices and nested boundaries of a CityJSON geometry, surface by surface with their
semantics.
"""

from itertools import chain
from typing import NamedTuple

import numpy as np

from ..settings.errors import InputError
from .open_input import LARGEST_COORDINATE

# Nesting depth of the surfaces of a geometry type, less one.
DEPTHS = {
    "MultiSurface": 0,
    "CompositeSurface": 0,
    "Solid": 1,
    "MultiSolid": 2,
    "CompositeSolid": 2,
}
INTERIOR = {"InteriorWallSurface", "CeilingSurface", "FloorSurface"}
CLASSES = INTERIOR | {
    "WallSurface",
    "RoofSurface",
    "GroundSurface",
    "ClosureSurface",
    "OuterCeilingSurface",
    "OuterFloorSurface",
    "Window",
    "Door",
}


def read_transform(path, line, value):
    """Transform of a CityJSON object, scale and translate, (3,) float64 each, or None if it has
    none.

    Raises
    ------
    InputError
        It is not three scale factors, none of them 0, and three offsets.
    """
    if value is None:
        return None
    members = value if isinstance(value, dict) else {}
    scale, translate = (read_numbers(members.get(name), 3) for name in ("scale", "translate"))
    if scale is None or translate is None or not scale.all():
        raise InputError(
            path,
            f"line {line}: the transform needs three numbers each for scale (none 0) and translate",
            "correct it, or export the file again",
        )
    return scale, translate


def read_numbers(value, count):
    """A list of numbers as an array, or None if it is anything else or a number is too large."""
    if (
        not isinstance(value, list)
        or len(value) != count
        or not {int, float}.issuperset(map(type, value))
    ):
        return None
    # No scale or element of a matrix is above 1e8.
    return np.array(value, float) if all(abs(number) <= 1e8 for number in value) else None


def read_vertices(path, line, value, transform=None, name="vertices"):
    """Coordinates of vertices.

    Parameters
    ----------
    path : path-like
    line : int
        First line of the JSON text of the vertices.
    value : object
        As in the file; None means no vertices.
    transform : tuple of (3,) float64, optional
        Coordinates are scale times vertex, plus translate.
    name : str
        Of the list, for error messages.

    Returns
    -------
    points : array, (n, 3) float64
        In the units of the file.
    whole : bool
        True if all numbers are integers.

    Raises
    ------
    InputError
        Names the first vertex that is not three finite numbers of plausible size.
    """
    value = [] if value is None else value
    if not isinstance(value, list):
        raise InputError(
            path,
            f"line {line}: {name} is not a list",
            "give a list of three numbers for each vertex",
        )
    numbers = _to_array(value)
    if numbers is None:
        first = next(k for k, vertex in enumerate(value) if _to_array([vertex]) is None)
        raise InputError(
            path,
            f"line {line}: vertex {first} of {name} is not three numbers",
            "correct or remove it",
        )
    with np.errstate(over="ignore", invalid="ignore"):
        points = numbers if transform is None else numbers * transform[0] + transform[1]
    wrong = ~(np.abs(points) <= LARGEST_COORDINATE).all(axis=1)  # also true for NaN
    if wrong.any():
        problem = (
            f"vertex {wrong.argmax()} of {name} is not finite or beyond {LARGEST_COORDINATE:g}"
        )
        raise InputError(path, f"line {line}: {problem}", "correct it, or the transform")
    return points, bool((numbers == np.round(numbers)).all())


def _to_array(value):
    """Rows of three numbers, or None; True and False do not count as numbers."""
    if not value:
        return np.empty((0, 3))
    if set(map(type, value)) != {list} or set(map(len, value)) != {3}:
        return None
    if not {int, float}.issuperset(map(type, chain.from_iterable(value))):
        return None
    try:
        return np.array(value, float)
    except OverflowError:  # an integer too large for a float
        return np.array([[max(min(number, 1e300), -1e300) for number in row] for row in value])


class Surface(NamedTuple):
    """One surface of a geometry."""

    rings: object  # as in the file
    semantics: dict  # its semantic object, or an empty one
    inner: bool  # in a shell that bounds a cavity


def walk_boundaries(geometry):
    """Surfaces of one geometry with their semantics.

    Parameters
    ----------
    geometry : dict
        With a type in DEPTHS, ``boundaries`` and optionally ``semantics``.

    Returns
    -------
    surfaces : list of Surface
    matching : bool
        False if the semantics are not nested like the boundaries; those that can be assigned are
        kept.

    Raises
    ------
    ValueError
        The boundaries are not nested as the type requires.
    """
    semantics = geometry.get("semantics")
    known = (
        semantics
        if isinstance(semantics, dict) and isinstance(semantics.get("surfaces"), list)
        else {}
    )
    kinds, surfaces, matching = known.get("surfaces", []), [], semantics is None or bool(known)
    nested = _walk(geometry.get("boundaries"), known.get("values"), DEPTHS[geometry["type"]])
    for rings, number, inner, alike in nested:
        sound = type(number) is int and 0 <= number < len(kinds) and isinstance(kinds[number], dict)
        surfaces.append(Surface(rings, kinds[number] if sound else {}, inner))
        matching = matching and alike and (sound or number is None)
    return surfaces, matching


def _walk(boundaries, values, depth, inner=False, alike=True):
    """Each surface, the value at its place in lists of values or None, and two flags.

    The first: its shell is an inner one. The second: lists of values are as long as the boundaries'
    lists; null may stand for all of a list.
    """
    if not isinstance(boundaries, list):
        raise ValueError("boundaries not nested as required by the geometry type")
    alike = alike and (
        values is None or (isinstance(values, list) and len(values) == len(boundaries))
    )
    for k, below in enumerate(boundaries):
        value = values[k] if isinstance(values, list) and k < len(values) else None
        if depth:
            yield from _walk(below, value, depth - 1, k > 0, alike)
        else:
            yield below, value, inner, alike
