"""Walk through the nested boundaries of a CityJSON geometry beside its semantics, surface by surface."""

from typing import NamedTuple

# How many lists stand around the surfaces of a geometry, less one.
DEPTHS = {"MultiSurface": 0, "CompositeSurface": 0, "Solid": 1, "MultiSolid": 2, "CompositeSolid": 2}
THEMATIC = {
    "WallSurface", "RoofSurface", "GroundSurface", "ClosureSurface", "OuterCeilingSurface", "OuterFloorSurface",
    "Window", "Door",
}  # fmt: skip
INTERIOR = {"InteriorWallSurface", "CeilingSurface", "FloorSurface"}
NO_NESTING = "boundaries that are not nested as their type asks"


class Surface(NamedTuple):
    """One surface of a geometry."""

    rings: object  # as they stand in the file
    semantics: dict  # its object of semantics, or an empty one
    inner: bool  # in a shell that bounds a cavity


def walk_boundaries(geometry):
    """Surfaces of one geometry with what is said of each.

    Parameters
    ----------
    geometry : dict
        With a type of DEPTHS, ``boundaries`` and perhaps ``semantics``.

    Returns
    -------
    surfaces : list of Surface
    matching : bool
        False where the semantics are not nested as the boundaries; what can be told of them is kept.

    Raises
    ------
    ValueError
        The boundaries are not nested as the type asks.
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
        if len(leaves) == len(found):  # nested otherwise, but one for each: their order is beyond doubt
            values = leaves
    told, sound = _look_up(values + [None] * (len(found) - len(values)), semantics["surfaces"])
    pairs = zip(found, told, strict=True)
    return [Surface(rings, meaning, inner) for (rings, inner), meaning in pairs], matching and sound


def read_class(semantics):
    """Thematic class of a surface: one that CityJSON knows, or ""."""
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
    """Append one value for each surface, None where there is none; True where the two are nested alike."""
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
    """All that is no list, in its order; without recursion, since a file may nest as it likes."""
    leaves, stack = [], [values]
    while stack:
        value = stack.pop()
        if isinstance(value, list):
            stack.extend(reversed(value))
        else:
            leaves.append(value)
    return leaves


def _look_up(values, surfaces):
    """The semantics that each number names, an empty object where it names none; and whether all could be told."""
    told, sound = [], True
    for value in values:
        known = type(value) is int and 0 <= value < len(surfaces) and isinstance(surfaces[value], dict)
        told.append(surfaces[value] if known else {})
        sound &= known or value is None
    return told, sound
