"""Feet as lines in plan view, each once, and how high the highest of them is at a place."""

from dataclasses import dataclass

import numpy as np

from .merge_places import pair_keys
from .place_grid import find_in_boxes, lay_grid

ABREAST = 0.25  # [m] feet closer together than this get the height of the higher one
SLICE = 100_000  # feet at once, to limit memory


@dataclass
class FootLines:
    """Distinct edges of the feet, and where to find them."""

    start: np.ndarray  # (e, 3) float64 [m]
    end: np.ndarray  # (e, 3) float64 [m]
    step: np.ndarray  # (e,) float64 [m] largest height above a neighbouring foot, of all that are the same
    boxes: np.ndarray  # (e, 4) float64 [m] around all that is ABREAST of each in plan view: least x and y, largest


def draw_lines(feet):
    """The edges of Feet, walls and footprints that share one drawn once: FootLines."""
    start, end = feet.start, feet.end
    ends = np.concatenate([start, end])
    _, place = np.unique(ends[:, 0] + 1j * ends[:, 1], return_inverse=True)
    _, point = np.unique(place + 1j * ends[:, 2], return_inverse=True)
    pairs = np.sort(point.reshape(2, -1), axis=0).T
    _, first, line = np.unique(pair_keys(pairs), return_index=True, return_inverse=True)
    step = np.zeros(len(first))
    np.maximum.at(step, line, feet.step)
    start, end = start[first], end[first]
    return FootLines(start, end, step, draw_boxes(start, end, ABREAST))


def draw_boxes(start, end, within):
    """Boxes around all that lies within a distance [m] of edges in plan view: (e, 4) float64 [m]."""
    low, high = np.minimum(start[:, :2], end[:, :2]), np.maximum(start[:, :2], end[:, :2])
    return np.column_stack([low - within, high + within])


def highest_foot(lines, places):
    """Height [m] of the highest foot edge at each place, (k, 3), leaving out edges too far above it: (k,) float64."""
    highest, grid = places[:, 2].copy(), lay_grid(places[:, :2], lines.boxes)
    for first in range(0, len(lines.start), SLICE):
        place, edge = find_in_boxes(grid, lines.boxes[first : first + SLICE])
        edge += first
        foot, distance = foot_on_edge(places[place], lines.start[edge], lines.end[edge])
        near = (distance <= ABREAST) & (foot[:, 2] <= places[place, 2] + lines.step[edge])
        np.maximum.at(highest, place[near], foot[near, 2])
    return highest


def foot_on_edge(points, start, end):
    """Point of each edge nearest to a point in plan, at the edge's height, and how far away in plan it is.

    Returns
    -------
    foot : (k, 3) float64 [m]
    distance : (k,) float64 [m]
    """
    along = end - start
    squared = np.maximum(along[:, 0] ** 2 + along[:, 1] ** 2, 1e-12)
    away = points[:, :2] - start[:, :2]
    share = (away[:, 0] * along[:, 0] + away[:, 1] * along[:, 1]) / squared
    foot = start + np.clip(share, 0, 1)[:, None] * along
    return foot, np.hypot(points[:, 0] - foot[:, 0], points[:, 1] - foot[:, 1])
