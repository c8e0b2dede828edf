"""Units and the upward axis of files that state neither, by the sizes of buildings."""

import numpy as np

from .transform_crs import UNITS

TALLEST = 1000.0  # [m] no building reaches it; the tallest has 828 m
USUAL = (2.2, 60.0)  # [m] between which half the height of buildings lies in nearly every place
NAMES = {
    "m": "metres",
    "ft": "feet",
    "us-ft": "US survey feet",
    "mm": "millimetres",
    "cm": "centimetres",
    "in": "inches",
}


def judge_unit(contents):
    """The unit of files that name no reference system.

    Half of the buildings are higher than the other half: that height is doubted from 150 on, and no
    number of metres from 1,000 on. Then the unit is taken if it is the only one that leaves a usual
    height.

    Parameters
    ----------
    contents : list of FileContent
        Points in the units of the files.

    Returns
    -------
    unit : str
        Of `transform_crs.UNITS`.
    notes : list of str
        What was taken, or may be meant.
    """
    heights = [high - low for content in contents for low, high in _heights_of(content)]
    # Hardly any place has more than half of its buildings above 150 m.
    if not heights or (middle := float(np.median(heights))) < 150.0:
        return "m", []
    likely = likely_units(middle)
    sizes = f"half of the buildings are over {middle:,.0f} high"
    if middle >= TALLEST and len(likely) == 1:
        return likely[0], [
            f"Coordinates were taken for {NAMES[likely[0]]}, since {sizes}; --unit m takes them "
            "for metres."
        ]
    options = " or ".join(f"--unit {unit}" for unit in likely) or "--unit"
    return "m", [
        f"Coordinates were taken for metres, but {sizes}. If that is not so, give {options}."
    ]


def likely_units(height):
    """Units in which the height of a building, a number, would be a usual one: list of str."""
    return [
        unit for unit in ("ft", "in", "cm", "mm") if USUAL[0] <= height * UNITS[unit] <= USUAL[1]
    ]


def _heights_of(content):
    """Lowest and highest z of each building: list of (float, float)."""
    rings = [polygon.rings[0] for polygon in content.polygons if len(polygon.rings[0])]
    if not rings:
        return []
    building = np.array([polygon.building for polygon in content.polygons if len(polygon.rings[0])])
    starts, z = np.cumsum([0, *map(len, rings[:-1])]), np.concatenate(rings)[:, 2]
    low, high = np.full(building.max() + 1, np.inf), np.full(building.max() + 1, -np.inf)
    np.minimum.at(low, building, np.minimum.reduceat(z, starts))
    np.maximum.at(high, building, np.maximum.reduceat(z, starts))
    return list(zip(low[low <= high], high[low <= high], strict=True))
