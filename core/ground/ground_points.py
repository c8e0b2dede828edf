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
    nearest : array, (p,) int64
        The foot nearest to each.
    """
    tree = cKDTree(foot_places)
    size = _root_size(high - low, patch_size)
    columns, rows = (int(n) for n in np.ceil((high - low) / size))
    x, y = np.meshgrid(low[0] + size * (np.arange(columns) + 0.5), low[1] + size * (np.arange(rows) + 0.5))
    cells, done, feet = np.column_stack([x.ravel(), y.ravel()]), [], []
    while len(cells):
        away, nearest = tree.query(cells)
        distance = np.maximum(away - 0.7 * size, 0)
        fine = size <= patch_size * 1.0001 + GROWTH * distance
        kept = fine & (away > KEEP_AWAY * patch_size)
        done.append(cells[kept])
        feet.append(nearest[kept])
        quarters = 0.25 * size * np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]])
        cells = (cells[~fine, None] + quarters).reshape(-1, 2)
        size /= 2
    centres, feet = np.concatenate(done), np.concatenate(feet)
    outside = (centres > low).all(axis=1) & (centres < high).all(axis=1)
    outside[outside] = _outside(centres[outside], footprints)
    rim = _rim(low, high)
    return np.concatenate([centres[outside], rim]), np.concatenate([feet[outside], tree.query(rim)[1]])


def _root_size(extent, patch_size):
    """Size of the root cells: patch_size doubled until four of them span the ground."""
    doublings = max(int(np.log2(max(extent.max() / (4 * patch_size), 1.0))), 0)
    return patch_size * 2.0**doublings


def _outside(centres, footprints):
    outside = np.ones(len(centres), bool)
    outside[find_inside(footprints, centres)[0]] = False
    return outside


def _rim(low, high):
    share = np.arange(8) / 8
    corners = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    following = np.roll(corners, -1, axis=0)
    return (corners[:, None] + share[:, None] * (following - corners)[:, None]).reshape(-1, 2)
