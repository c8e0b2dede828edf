"""What `--racks` asks for: rows of modules on flat roofs."""

import math
from dataclasses import dataclass

from ..settings.errors import InputError

OPTION = "--racks"
PAIRS = "east-west"
RANGES = {  # key -> smallest and largest value, unit
    "tilt": (0.0, 60.0, "°"),
    "azimuth": (0.0, 360.0, "°"),
    "spacing": (0.1, 100.0, "m"),
    "gcr": (0.01, 1.0, ""),
    "depth": (0.2, 10.0, "m"),
    "rim": (0.0, 20.0, "m"),
    "height": (0.05, 5.0, "m"),
    "area": (0.0, 1e6, "m²"),
    "back-albedo": (0.0, 1.0, ""),
}


@dataclass(frozen=True)
class Racks:
    """How modules stand on flat roofs."""

    east_west: bool = False  # pairs of rows back to back
    tilt: float = 10.0  # [°] against the roof's plane
    azimuth: float | None = None  # [°] the rows face, or the first of each pair; None: the equator, pairs the east
    spacing: float | None = None  # [m] from row to row, or pair to pair
    gcr: float | None = None  # ground coverage ratio: depth of the modules over spacing
    depth: float = 1.0  # [m] of a row along its slope
    rim: float = 0.5  # [m] kept free along edges, holes and whatever rises
    height: float = 0.1  # [m] of the lower edges above the roof
    area: float = 20.0  # [m²] of the smallest roof that carries racks
    back_albedo: float = 0.0  # of undersides and edges


def parse_racks(text):
    """Racks from the words of `--racks`.

    Parameters
    ----------
    text : str or None
        Parts joined by commas: ``east-west``, and KEY=VALUE with a key of `RANGES`.

    Returns
    -------
    Racks or None
        None where none are asked for.

    Raises
    ------
    InputError
        A key is unknown or given twice, a value is no number or out of its range, or both spacing and gcr are given.
    """
    if not text or text == "none":
        return None
    given = {}
    for part in text.split(","):
        key, mark, value = (piece.strip() for piece in part.partition("="))
        name = "east_west" if not mark and key == PAIRS else key.replace("-", "_")
        if name in given:
            raise InputError(OPTION, f"{key} is given twice", "give it once")
        given[name] = True if name == "east_west" else parse_value(key, mark, value)
    if "spacing" in given and "gcr" in given:
        raise InputError(OPTION, "spacing and gcr are both given", "each follows from the other, give one")
    return Racks(**given)


def parse_value(key, mark, value):
    """The number of one part of the words, within its range."""
    if key not in RANGES or not mark:
        problem = f"{key!r} is not known" if key not in RANGES else f"{key} has no value"
        raise InputError(OPTION, problem, f"give {PAIRS}, or KEY=VALUE with {', '.join(RANGES)}")
    least, most, unit = RANGES[key]
    cure = f"give a number from {least:g} to {most:g}{f' [{unit}]' if unit else ''}"
    try:
        number = float(value)
    except ValueError:
        raise InputError(OPTION, f"{key}={value} is no number", cure) from None
    if not (math.isfinite(number) and least <= number <= most):
        raise InputError(OPTION, f"{key}={value} is out of range", cure)
    return number
