"""Refuse arrays that cannot be traced, before any ray: each error names the array, the place in it and the cure."""

import numpy as np

from ..errors import InputError

LARGEST = 1e9  # [m] Embree works in float32; beyond this nothing of a city is left in it
UNIT = 1e-3  # by how much the length of a unit vector may be off
BELOW_HORIZON = -1e-6  # sine of the elevation that rounding may leave to a sun on the horizon
KINDS = {"f": ("fiu", "numbers"), "i": ("iu", "integers"), "b": ("b", "booleans")}


def check_array(name, values, shape, *, kind="f", least=-LARGEST, most=LARGEST, row="row"):
    """Refuse an array of the wrong shape or type, or with a value that is not finite or out of bounds.

    Parameters
    ----------
    name : str
        Of the array, for the message.
    values : array_like
    shape : tuple of int or str
        A letter stands for any length.
    kind : {'f', 'i', 'b'}
        Numbers, integers or booleans.
    least, most : float
        Bounds, inclusive.
    row : str
        What a row is called in the message.

    Returns
    -------
    numpy.ndarray

    Raises
    ------
    InputError
    """
    values = np.asarray(values)
    words = f"({', '.join(map(str, shape))}{',' if len(shape) == 1 else ''})"
    fits = values.ndim == len(shape) and all(
        isinstance(wanted, str) or wanted == found for wanted, found in zip(shape, values.shape, strict=True)
    )
    if not fits:
        raise InputError(name, f"shape {values.shape}", f"give an array of shape {words}")
    kinds, noun = KINDS[kind]
    if values.dtype.kind not in kinds:
        raise InputError(name, f"values of type {values.dtype}", f"give {noun}")
    # The bounds are compared so that a NaN, which lies in no bounds, fails too.
    if kind != "b" and values.size and not (values.min() >= least and values.max() <= most):
        inside = ((values >= least) & (values <= most)).reshape(len(values), -1).all(axis=1)
        first = int(np.flatnonzero(~inside)[0])
        raise InputError(name, f"{row} {first} is {values[first]}", f"give finite {noun} from {least:g} to {most:g}")
    return values


def check_triangles(vertices, triangles):
    """Refuse vertices and triangles that Embree must not see.

    Parameters
    ----------
    vertices : (v, 3) float [m]
    triangles : (t, 3) int

    Returns
    -------
    vertices, triangles : numpy.ndarray
    """
    vertices = check_array("vertices", vertices, ("v", 3), row="vertex")
    triangles = check_array("triangles", triangles, ("t", 3), kind="i", most=np.inf, least=-np.inf)
    if len(triangles) and not (triangles.min() >= 0 and triangles.max() < len(vertices)):
        outside = ((triangles < 0) | (triangles >= len(vertices))).any(axis=1)
        first = int(np.flatnonzero(outside)[0])
        problem = f"triangle {first} is {triangles[first]}, a vertex beyond the {len(vertices)} given"
        raise InputError("triangles", problem, "check the indices")
    return vertices, triangles


def check_scene(scene):
    """Refuse a scene that cannot be traced.

    Parameters
    ----------
    scene : Scene

    Raises
    ------
    InputError
    """
    check_triangles(scene.vertices, scene.triangles)
    count, own = len(scene.triangles), len(scene.surfaces)
    check_array("triangle_surface", scene.triangle_surface, (count,), kind="i", least=-1, most=own - 1)
    check_array("footprint", scene.footprint, (count,), kind="b")
    check_array("closure", scene.closure, (count,), kind="b")


def check_suns(suns):
    """Refuse suns without a direction, without a weight or below the horizon.

    Parameters
    ----------
    suns : Suns

    Raises
    ------
    InputError
    """
    direction = check_array("direction of the suns", suns.direction, ("s", 3), least=-1 - UNIT, most=1 + UNIT)
    check_array("weight of the suns", suns.weight, (len(direction),), least=0, most=1 + UNIT)
    wrong = np.abs(np.linalg.norm(direction, axis=1) - 1) > UNIT
    if wrong.any():
        first = int(np.flatnonzero(wrong)[0])
        raise InputError("direction of the suns", f"row {first} is {direction[first]}", "give unit vectors")
    low = direction[:, 2] < BELOW_HORIZON
    if low.any():
        first = int(np.flatnonzero(low)[0])
        problem = f"row {first} is {direction[first]}, below the horizon"
        raise InputError("direction of the suns", problem, "leave out suns that have set")
