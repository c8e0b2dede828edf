"""Vertices of a CityJSON file: integers and the transform to real coordinates."""

from dataclasses import dataclass
from itertools import chain

import numpy as np

from ..settings.errors import InputError
from .limits import LARGEST_COORDINATE

LARGEST_NUMBER = 1e8  # of a scale or an element of a matrix


@dataclass
class Transform:
    """Coordinates are scale times vertex, plus translate."""

    scale: np.ndarray  # (3,) float64
    translate: np.ndarray  # (3,) float64


def read_transform(path, line, value):
    """Transform of a CityJSON object, or None if it has none.

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
        problem = f"line {line}: the transform needs three numbers each for scale (none 0) and translate"
        raise InputError(path, problem, "correct it, or export the file again")
    return Transform(scale, translate)


def read_numbers(value, count, largest=LARGEST_NUMBER):
    """A list of numbers as an array, or None if it is anything else or a number is too large."""
    if not isinstance(value, list) or len(value) != count or not {int, float}.issuperset(map(type, value)):
        return None
    return np.array(value, float) if all(abs(number) <= largest for number in value) else None


def read_vertices(path, line, value, transform=None, name="vertices"):
    """Coordinates of vertices.

    Parameters
    ----------
    path : path-like
    line : int
        First line of the JSON text of the vertices.
    value : object
        As in the file; None means no vertices.
    transform : Transform, optional
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
    if value is None:
        return np.empty((0, 3)), True
    if not isinstance(value, list):
        raise InputError(path, f"line {line}: {name} is not a list", "give a list of three numbers for each vertex")
    numbers = _to_array(value)
    if numbers is None:
        first = next(k for k, vertex in enumerate(value) if _to_array([vertex]) is None)
        raise InputError(path, f"line {line}: vertex {first} of {name} is not three numbers", "correct or remove it")
    with np.errstate(over="ignore", invalid="ignore"):
        points = numbers if transform is None else numbers * transform.scale + transform.translate
    wrong = ~(np.abs(points) <= LARGEST_COORDINATE).all(axis=1)  # also true for NaN
    if wrong.any():
        problem = f"vertex {wrong.argmax()} of {name} is not finite or beyond {LARGEST_COORDINATE:g}"
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
        return np.array([[_to_float(number) for number in row] for row in value])


def _to_float(number):
    try:
        return float(number)
    except OverflowError:
        return np.inf
