"""Measured terrain: triangulated layers, the finest first, and its height at any position."""

from dataclasses import dataclass, field

import numpy as np
import shapely
from scipy.spatial import cKDTree

from ..settings.errors import check_array
from .city import number_names
from .plan_geometry import draw_triangles, find_inside
from .polygons import drop_unused, polygon_bounds
from .triangulate_feet import heights_on

# [m] feet this close to the edge of the terrain take its height: TINs are often cut out at
# buildings
NEAR = 5.0
HORIZON = 5000.0  # [m] terrain further than this beyond the city's edge is left out


@dataclass
class Layer:
    """Triangles of one resolution; gaps have no triangles."""

    points: np.ndarray  # (v, 3) float64 [m], x east, y north, z up
    triangles: np.ndarray  # (t, 3) int64

    def take(self, kept):
        """The triangles of a mask, (t,) bool, with the points that they use: Layer."""
        return Layer(*drop_unused(self.points, self.triangles[kept]))


@dataclass
class Terrain:
    """Terrain read from a file, in the coordinate reference system of the city."""

    source: str
    layers: list = field(default_factory=list)  # of Layer, the finest first
    notes: list = field(default_factory=list)  # sentences for the report

    def ground_heights(self):
        """Heights of a terrain, close beside its edge too, as outlines are extruded on it: a
        function of places, (k, 2) float64 [m].
        """

        def measure(places):
            heights = measure_heights(self, places)
            return np.where(np.isfinite(heights), heights, nearest_heights(self, places, NEAR))

        return measure


def measure_heights(terrain, places):
    """Height of a terrain; the highest triangle wins where several overlap.

    Parameters
    ----------
    terrain : Terrain
    places : array, (k, 2) float64 [m]

    Returns
    -------
    heights : array, (k,) float64 [m]
        NaN in gaps and beyond the edge.
    """
    places = check_array("places", places, ("k", 2))
    heights = np.full(len(places), np.nan)
    for layer in terrain.layers:
        # The finest layer first; further ones where it has gaps.
        missing = np.flatnonzero(np.isnan(heights))
        corners = _corners_near(layer, places[missing], 0.0) if len(missing) else []
        if len(corners):
            place, triangle = find_inside(draw_triangles(corners), places[missing])
            np.fmax.at(
                heights, missing[place], heights_on(corners[triangle], places[missing[place]])
            )
    return heights


def nearest_heights(terrain, places, reach):
    """Height of a terrain at its point nearest to each place.

    Parameters
    ----------
    terrain : Terrain
    places : array, (k, 2) float64 [m]
    reach : float [m]

    Returns
    -------
    heights : array, (k,) float64 [m]
        NaN where none is within reach.
    """
    heights = np.full(len(places), np.nan)
    for layer in terrain.layers:
        missing = np.flatnonzero(np.isnan(heights))
        corners = _corners_near(layer, places[missing], reach) if len(missing) else []
        if not len(corners):
            continue
        shapes, points = shapely.polygons(corners[..., :2]), shapely.points(places[missing])
        place, triangle = shapely.STRtree(shapes).query_nearest(points, max_distance=reach)
        # The nearest place on the nearest triangle; of several the highest.
        lines = shapely.shortest_line(shapes[triangle], points[place])
        on = shapely.get_coordinates(shapely.get_point(lines, 0))
        height_of_place = np.full(len(missing), -np.inf)
        np.maximum.at(height_of_place, place, heights_on(corners[triangle], on))
        heights[missing] = np.where(np.isinf(height_of_place), np.nan, height_of_place)
    return heights


def ground_of_feet(city):
    """Heights of the ground of a city as its buildings stand on it: of places, (k, 2) float64 [m],
    the foot of the building whose corner is nearest.
    """
    low, _ = polygon_bounds(city.points[:, 2], city.ring_start, city.polygon_start)
    building = number_names(city.building_id)
    feet = np.full(building.max() + 1, np.inf)
    np.minimum.at(feet, building, low)
    corner = np.repeat(feet[building], np.diff(city.ring_start[city.polygon_start]))
    tree = cKDTree(city.points[:, :2])
    return lambda places: corner[tree.query(places)[1]]


def _corners_near(layer, places, reach):
    """Corners (t, 3, 3) of the triangles near some places that have an area seen from above."""
    corners = layer.points[layer.triangles]  # (t, 3, 3)
    low, high = corners[..., :2].min(axis=1) - reach, corners[..., :2].max(axis=1) + reach
    corners = corners[((low <= places.max(axis=0)) & (high >= places.min(axis=0))).all(axis=1)]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    doubled = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    return corners[np.abs(doubled) > 1e-9 * np.maximum((u**2).sum(axis=1), (v**2).sum(axis=1))]
