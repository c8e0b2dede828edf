"""Sample points of the open ground: dense near the buildings, sparser with distance."""

import numpy as np
from scipy.spatial import cKDTree

from .in_polygons import find_inside

GROWTH = 0.35  # [m/m] how much a patch may grow per metre of distance from the nearest foot
KEEP_AWAY = 0.5  # [patch sizes] no points closer to a foot than this


def spread_points(foot_places, footprints, low, high, patch_size):
    """Centres of quadtree cells outside the footprints.

    A cell is split as long as it is larger than patch_size + GROWTH * (distance to the nearest foot).

    Parameters
    ----------
    foot_places : array, (k, 2) float64 [m]
    footprints : array of shapely polygons
    low, high : array, (2,) float64 [m]
        Corners of the ground.
    patch_size : float [m]

    Returns
    -------
    places : array, (p, 2) float64 [m]
        Includes the corners of the ground and points on its rim.
    """
    tree = cKDTree(foot_places)
    size = _root_size(high - low, patch_size)
    columns, rows = (int(n) for n in np.ceil((high - low) / size))
    x, y = np.meshgrid(low[0] + size * (np.arange(columns) + 0.5), low[1] + size * (np.arange(rows) + 0.5))
    cells, done = np.column_stack([x.ravel(), y.ravel()]), []
    while len(cells):
        nearest = tree.query(cells)[0]
        distance = np.maximum(nearest - 0.7 * size, 0)
        fine = size <= patch_size * 1.0001 + GROWTH * distance
        done.append(cells[fine & (nearest > KEEP_AWAY * patch_size)])
        quarters = 0.25 * size * np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]])
        cells = (cells[~fine, None] + quarters).reshape(-1, 2)
        size /= 2
    centres = np.concatenate(done)
    centres = centres[(centres > low).all(axis=1) & (centres < high).all(axis=1)]
    return np.concatenate([_outside(centres, footprints), _rim(low, high)])


def _root_size(extent, patch_size):
    """Size of the root cells: patch_size doubled until four of them span the ground."""
    doublings = max(int(np.log2(max(extent.max() / (4 * patch_size), 1.0))), 0)
    return patch_size * 2.0**doublings


def _outside(centres, footprints):
    if not len(footprints):
        return centres
    outside = np.ones(len(centres), bool)
    outside[find_inside(footprints, centres)[0]] = False
    return centres[outside]


def _rim(low, high):
    share = np.arange(8) / 8
    corners = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    following = np.roll(corners, -1, axis=0)
    return (corners[:, None] + share[:, None] * (following - corners)[:, None]).reshape(-1, 2)
