"""Which feet stand on the ground: a slope filter, as for LiDAR. A foot hangs if it is too far above another nearby.

Most feet are no higher than a step above the lowest one around; that is found out for all of them together. The others
are compared one by one.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .places_in_plan import COINCIDENT, find_in_boxes, group, lay_grid, list_runs, merge_places, pair_keys

NEIGHBOURS = 32
NEAR = 10.0  # [m] within which feet are compared with whole edges, further away with their ends
FAR = 100.0  # [m] within which the lowest foot is looked up, to leave out feet that cannot hang
ROUNDING = 1e-6  # [m]
EDGES_AT_ONCE = 10_000  # edges at once: each may have some hundred feet nearby


def find_standing(start, end, step, slope):
    """Edges neither of whose ends rises above another foot by more than a step and the slope to it.

    Parameters
    ----------
    start, end : array, (e, 3) float64 [m]
    step : array, (e,) float64 [m]
    slope : array, (e,) float64 [m/m]
        Of few different values.

    Returns
    -------
    (e,) bool
    """
    if not len(start):
        return np.zeros(0, bool)
    ends, step, slope = np.concatenate([start, end]), np.tile(step, 2), np.tile(slope, 2)
    near, hangs = lowest_around(ends, start, end, NEAR), np.zeros(len(ends), bool)
    lowest = np.minimum(near, start[:, 2].min() + slope * NEAR)
    some = np.flatnonzero(ends[:, 2] > step + lowest - ROUNDING)  # no other can hang
    far = lowest_around(ends[some], start, end, FAR) + slope[some] * NEAR
    lowest = np.minimum(near[some], np.minimum(far, start[:, 2].min() + slope[some] * FAR))
    some = some[ends[some, 2] > step[some] + lowest - ROUNDING]
    hangs[some] = hangs_above_feet(ends[some], step[some], slope[some], start)
    some = np.flatnonzero((ends[:, 2] > step + near) & ~hangs)
    hangs[some] = hangs_above_edges(ends[some], step[some], slope[some], (start, end))
    return ~hangs.reshape(2, -1).any(axis=0)


def hangs_above_feet(points, step, slope, others):
    """Points (p, 3) for which z - z' <= step + slope * distance does not hold for all nearest feet: (p,) bool."""
    if not len(points):
        return np.zeros(0, bool)
    lowest = others[merge_places(others)[0]]  # of several feet at one position only the lowest matters
    places, place = np.unique(points[:, 0] + 1j * points[:, 1], return_inverse=True)
    count = min(NEIGHBOURS, len(lowest))
    distance, index = cKDTree(lowest[:, :2]).query(np.column_stack([places.real, places.imag]), k=count)
    distance, height = distance.reshape(-1, count), lowest[index.reshape(-1, count), 2]
    slopes, kind = np.unique(slope, return_inverse=True)
    most = np.stack([(height + one * distance).min(axis=1) for one in slopes])
    hangs = points[:, 2] > step + most[kind, place] - ROUNDING
    rest = np.flatnonzero(hangs)
    rise, away = points[rest, 2, None] - height[place[rest]], distance[place[rest]]
    hangs[rest] = (rise > step[rest, None] + slope[rest, None] * away).any(axis=1)
    return hangs


def hangs_above_edges(points, step, slope, edges):
    """The same beside whole edges: a bay above the middle of a long wall stands on nothing."""
    start, end = edges
    hangs = np.zeros(len(points), bool)
    if not len(points):
        return hangs
    boxes = draw_boxes(start, end, NEAR)
    grid = lay_grid(points[:, :2], boxes)
    for part in range(0, len(start), EDGES_AT_ONCE):
        point, edge = find_in_boxes(grid, boxes[part : part + EDGES_AT_ONCE])
        edge += part
        foot, distance = foot_on_edge(points[point], start[edge], end[edge])
        rise = points[point, 2] - foot[:, 2]
        hangs[point[(distance <= NEAR) & (rise > step[point] + slope[point] * distance + COINCIDENT)]] = True
    return hangs


def lowest_around(points, start, end, within):
    """No edge within a distance [m] of a point is lower there than this: (p,) float64 [m].

    Pieces of edges, up to that distance long, have both ends within twice of it from a point that they come near to.
    """
    parts = np.maximum(np.ceil(np.linalg.norm((end - start)[:, :2], axis=1) / within), 1).astype(np.int64)
    edge, number = list_runs(np.zeros(len(start), np.int64), parts + 1)
    ends = start[edge] + (number / parts[edge])[:, None] * (end - start)[edge]
    key = pair_keys(np.floor(ends[:, :2] / (2 * within)).astype(np.int64))
    order, first = group(key)
    cells, low = key[order[first]], np.minimum.reduceat(ends[order, 2], first)
    own, place = np.unique(pair_keys(np.floor(points[:, :2] / (2 * within)).astype(np.int64)), return_inverse=True)
    lowest = np.full(len(own), np.inf)
    for east, north in np.ndindex(3, 3):
        beside = own + ((east - 1) << 32) + north - 1
        found = np.minimum(np.searchsorted(cells, beside), len(cells) - 1)
        lowest = np.where(cells[found] == beside, np.minimum(lowest, low[found]), lowest)
    return lowest[place]


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
