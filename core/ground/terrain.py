"""Measured terrain: triangulated layers, the finest first, and its height at any position."""

from dataclasses import dataclass, field

import numpy as np
import shapely

from ..check_arrays import check_array

HORIZON = 5000.0  # [m] terrain further than this beyond the city's edge is left out


@dataclass
class Layer:
    """Triangles of one resolution; gaps have no triangles."""

    points: np.ndarray  # (v, 3) float64 [m], x east, y north, z up
    triangles: np.ndarray  # (t, 3) int64


@dataclass
class Terrain:
    """Terrain read from a file, in the coordinate reference system of the city."""

    source: str
    layers: list = field(default_factory=list)  # of Layer, the finest first
    notes: list = field(default_factory=list)  # sentences for the report

    def moved(self, move):
        """The same terrain with its points transformed by a function (v, 3) -> (v, 3)."""
        return Terrain(self.source, [Layer(move(one.points), one.triangles) for one in self.layers], self.notes)


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
        missing = np.flatnonzero(np.isnan(heights))
        if len(missing):
            heights[missing] = _highest(layer, places[missing])
    return heights


def _highest(layer, places):
    """Height of the highest triangle at each position, NaN if none; only triangles near the positions are tested."""
    corners = layer.points[layer.triangles]  # (t, 3, 3)
    low, high = corners[..., :2].min(axis=1), corners[..., :2].max(axis=1)
    near = ((low <= places.max(axis=0)) & (high >= places.min(axis=0))).all(axis=1)
    corners = corners[near]
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    doubled = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    level = np.abs(doubled) > 1e-9 * np.maximum((u**2).sum(axis=1), (v**2).sum(axis=1))
    a, u, v, doubled, corners = a[level], u[level], v[level], doubled[level], corners[level]
    heights = np.full(len(places), -np.inf)
    if len(corners):
        tree = shapely.STRtree(shapely.polygons(corners[..., :2]))
        place, triangle = tree.query(shapely.points(places), "intersects")
        d, u, v, doubled = places[place] - a[triangle, :2], u[triangle], v[triangle], doubled[triangle]
        along = (d[:, 0] * v[:, 1] - d[:, 1] * v[:, 0]) / doubled
        across = (u[:, 0] * d[:, 1] - u[:, 1] * d[:, 0]) / doubled
        np.maximum.at(heights, place, a[triangle, 2] + along * u[:, 2] + across * v[:, 2])
    return np.where(np.isinf(heights), np.nan, heights)
