"""Walk the nested boundaries of a CityJSON geometry together with its semantics, surface by surface."""

from typing import NamedTuple

# Nesting depth of the surfaces of a geometry type, less one.
DEPTHS = {"MultiSurface": 0, "CompositeSurface": 0, "Solid": 1, "MultiSolid": 2, "CompositeSolid": 2}
THEMATIC = {
    "WallSurface", "RoofSurface", "GroundSurface", "ClosureSurface", "OuterCeilingSurface", "OuterFloorSurface",
    "Window", "Door",
}  # fmt: skip
INTERIOR = {"InteriorWallSurface", "CeilingSurface", "FloorSurface"}
NO_NESTING = "boundaries not nested as required by the geometry type"


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
        False if the semantics are not nested like the boundaries; those that can be assigned are kept.

    Raises
    ------
    ValueError
        The boundaries are not nested as the type requires.
    """
    depth, semantics = DEPTHS[geometry["type"]], geometry.get("semantics")
    found = []
    _flatten(geometry.get("boundaries"), depth, False, found)
    if semantics is None:
        return [Surface(rings, {}, inner) for rings, inner in found], True
    if not isinstance(semantics, dict) or not isinstance(semantics.get("surfaces"), list):
        return [Surface(rings, {}, inner) for rings, inner in found], False
    values, matching = [], True
    if semantics.get("values") is not None:
        matching = _align(semantics["values"], geometry["boundaries"], depth, values)
        leaves = [] if matching else _leaves(semantics["values"])
        if len(leaves) == len(found):  # nested differently, but one per surface: their order is clear
            values = leaves
    meanings, sound = _look_up(values + [None] * (len(found) - len(values)), semantics["surfaces"])
    pairs = zip(found, meanings, strict=True)
    return [Surface(rings, meaning, inner) for (rings, inner), meaning in pairs], matching and sound


def read_class(semantics):
    """Thematic class of a surface: one defined by CityJSON, or ""."""
    kind = semantics.get("type")
    return kind if isinstance(kind, str) and kind in THEMATIC | INTERIOR else ""


def _flatten(boundaries, depth, inner, found):
    if not isinstance(boundaries, list):
        raise ValueError(NO_NESTING)
    for k, below in enumerate(boundaries):
        if depth:
            _flatten(below, depth - 1, inner or (depth == 1 and k > 0), found)
        else:
            found.append((below, inner))


def _align(values, boundaries, depth, aligned):
    """Append one value per surface, None if missing; True if values and boundaries are nested alike."""
    matching = values is None or (isinstance(values, list) and len(values) == len(boundaries))
    values = values if isinstance(values, list) else []
    for k, below in enumerate(boundaries):
        value = values[k] if k < len(values) else None
        if depth:
            matching &= _align(value, below, depth - 1, aligned)
        else:
            aligned.append(value)
            matching &= not isinstance(value, list)
    return matching


def _leaves(values):
    """All items that are not lists, in order; without recursion, since a file may be nested to any depth."""
    leaves, stack = [], [values]
    while stack:
        value = stack.pop()
        if isinstance(value, list):
            stack.extend(reversed(value))
        else:
            leaves.append(value)
    return leaves


def _look_up(values, surfaces):
    """Semantic object of each index, an empty one if there is none; and whether all indices were valid."""
    found, sound = [], True
    for value in values:
        known = type(value) is int and 0 <= value < len(surfaces) and isinstance(surfaces[value], dict)
        found.append(surfaces[value] if known else {})
        sound &= known or value is None
    return found, sound
