"""How dense crowns are, with leaves and without, and in which months they have leaves.

Street trees in leaf let 1 to 5 % of direct sunlight through, bare ones 40 to 52 % (Konarska et al.
2014, doi:10.1007/s00704-013-1000-3). With the defaults, a crown crossed over 6 m lets 5 % through
in leaf and 55 % bare.
"""

import re
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..city.canopy import Canopy
from ..city.scene import Crowns
from ..settings.errors import InputError

NORTHERN, YEAR = (5, 6, 7, 8, 9, 10), tuple(range(1, 13))


@dataclass
class Foliage:
    """Crowns of a scene with the optical depth of their leaves and branches."""

    crowns: Crowns
    months: tuple  # with leaves, 1 to 12
    in_leaf: tuple  # (k,) optical depth per metre [m⁻¹] and (k,) per crossing
    bare: tuple  # the same without leaves; of evergreen trees as in leaf

    @property
    def seasonal(self):
        """Whether the state changes over the year."""
        changes = any(
            (one != other).any() for one, other in zip(self.in_leaf, self.bare, strict=True)
        )
        return changes and 0 < len(self.months) < 12

    @cached_property
    def canopy(self):
        """What attenuates rays, in leaf and bare where that differs: Canopy."""
        if not self.seasonal:
            return Canopy(self.crowns, *(self.in_leaf if self.months else self.bare))
        leaves, left = sum(self.in_leaf), sum(self.bare)
        share = np.divide(left, leaves, out=np.ones(len(leaves)), where=leaves > 0)
        return Canopy(self.crowns, *self.in_leaf, share)


def choose_foliage(crowns, request, latitude):
    """Foliage of crowns by the settings of a run.

    Parameters
    ----------
    crowns : Crowns
    request : Request
    latitude : float or None
        [°]

    Raises
    ------
    InputError
        The months cannot be read.
    """
    months = parse_months(request.leaf_months, latitude)
    nothing, density = np.zeros(len(crowns)), crowns.area_density
    if request.crown_transmittance is not None:
        leaves = np.full(len(crowns), -np.log(max(request.crown_transmittance, 1e-6)))
        bare = leaves * min(request.branch_area_density / max(request.leaf_area_density, 1e-9), 1.0)
    else:
        leaves = request.leaf_extinction * np.where(
            np.isnan(density), request.leaf_area_density, density
        )
        bare = np.minimum(request.leaf_extinction * request.branch_area_density, leaves)
    states = leaves, np.where(crowns.evergreen, leaves, bare)
    whole = request.crown_transmittance is not None  # of a crown, however long the way through it
    return Foliage(
        crowns, months, *((nothing, state) if whole else (state, nothing) for state in states)
    )


def parse_months(text, latitude=None):
    """Months with leaves: tuple of 1 to 12.

    Parameters
    ----------
    text : str
        auto, all, none, or months and ranges such as 4-10, 11-4 or 1,2,12.
    latitude : float, optional
        [°] For auto: May to October in the north, November to April in the south, all year in the
        tropics.

    Raises
    ------
    InputError
    """
    if text == "auto":
        # Between the tropics trees are taken to keep their leaves.
        if latitude is None or abs(latitude) > 23.44:
            return (
                NORTHERN
                if latitude is None or latitude > 0
                else tuple(sorted(set(YEAR) - set(NORTHERN)))
            )
        return YEAR
    if text in ("all", "none"):
        return YEAR if text == "all" else ()
    months = set()
    for word in text.split(","):
        match = re.fullmatch(r"\s*(\d{1,2})(?:-(\d{1,2}))?\s*", word)
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (0, 0)
        if not (1 <= first <= 12 and 1 <= last <= 12):
            raise InputError(
                "--leaf-months",
                f"{word.strip()!r} is not a month or a range of months",
                "give auto, all, none or months such as 4-10 or 11-4",
            )
        months |= {(first - 1 + k) % 12 + 1 for k in range((last - first) % 12 + 1)}
    return tuple(sorted(months))
