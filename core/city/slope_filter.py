"""Which feet stand on the ground: a slope filter, as for LiDAR. A foot hangs if it is too far above another nearby."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .places_in_plan import COINCIDENT, find_in_boxes, merge_places, pair_keys, plant_tree

NEIGHBOURS = 32
NEAR = 10.0  # [m] within which feet are compared with whole edges, further away with their ends
ENDS_AT_ONCE, EDGES_AT_ONCE = 50_000, 1_000  # to limit memory: edges may have some thousand feet nearby


def find_standing(start, end, step, slope):
    """Edges neither of whose ends rises above another foot by more than a step and the slope to it.

    Parameters
    ----------
    start, end : array, (e, 3) float64 [m]
    step : array, (e,) float64 [m]
    slope : array, (e,) float64 [m/m]

    Returns
    -------
    (e,) bool
    """
    if not len(start):
        return np.zeros(0, bool)
    ends, step, slope = np.concatenate([start, end]), np.tile(step, 2), np.tile(slope, 2)
    hangs = hangs_above_feet(ends, step, slope, start)
    some = np.flatnonzero(~hangs)
    hangs[some] = hangs_above_edges(ends[some], step[some], slope[some], (start, end))
    return ~hangs.reshape(2, -1).any(axis=0)


def hangs_above_feet(points, step, slope, others):
    """Points (p, 3) for which z - z' <= step + slope * distance does not hold for all nearest feet: (p,) bool."""
    lowest = others[merge_places(others)[0]]  # of several feet at one position only the lowest matters
    tree, hangs = cKDTree(lowest[:, :2]), np.zeros(len(points), bool)
    for first in range(0, len(points), ENDS_AT_ONCE):
        some = slice(first, first + ENDS_AT_ONCE)
        distance, index = tree.query(points[some, :2], k=np.arange(1, min(NEIGHBOURS, len(lowest)) + 1))
        rise = points[some, 2, None] - lowest[index, 2]
        hangs[some] = (rise > step[some, None] + slope[some, None] * distance).any(axis=1)
    return hangs


def hangs_above_edges(points, step, slope, edges):
    """The same beside whole edges: a bay above the middle of a long wall stands on nothing."""
    start, end = edges
    hangs = np.zeros(len(points), bool)
    boxes, tree = draw_boxes(start, end, NEAR), plant_tree(points)
    for part in range(0, len(start), EDGES_AT_ONCE):
        point, edge = find_in_boxes(tree, boxes[part : part + EDGES_AT_ONCE])
        edge += part
        foot, distance = foot_on_edge(points[point], start[edge], end[edge])
        rise = points[point, 2] - foot[:, 2]
        hangs[point[(distance <= NEAR) & (rise > step[point] + slope[point] * distance + COINCIDENT)]] = True
    return hangs


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
    highest, tree = places[:, 2].copy(), plant_tree(places)
    for first in range(0, len(lines.start), SLICE):
        place, edge = find_in_boxes(tree, lines.boxes[first : first + SLICE])
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
