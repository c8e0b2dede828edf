"""Footprints: the surfaces under buildings, on the ground."""

import numpy as np

from ..city.city import number_names
from ..city.polygons import polygon_bounds

LEVEL = 0.5  # [m] a downward surface within this height of its building's lowest point lies on the ground


def find_footprints(surfaces, city, points):
    """Surfaces under buildings: GroundSurfaces, and for buildings without any, downward ones at the lowest height.

    Parameters
    ----------
    surfaces : Surfaces
    city : City
    points : array, (m, 3) float64 [m]
        Points of the city, in any frame with z up.

    Returns
    -------
    footprint : array, (n,) bool
    """
    named = np.array(surfaces.thematic) == "GroundSurface"
    building = number_names(surfaces.building_id)
    has_ground = np.bincount(building, weights=named) > 0
    low, high = polygon_bounds(points[:, 2], city.ring_start, city.polygon_start)
    lowest = np.full(building.max(initial=-1) + 1, np.inf)
    np.minimum.at(lowest, building, low)
    at_bottom = (surfaces.kind == "downward") & (high <= lowest[building] + LEVEL)
    return named | (at_bottom & ~has_ground[building])
