"""Which feet stand on the ground: a slope filter, as for LiDAR. A foot hangs if it is too far above another nearby.

Most feet are no higher than a step above the lowest one around; that is found out for all of them together. The others
are compared one by one.
"""

import numpy as np
from scipy.spatial import cKDTree

from .foot_lines import draw_boxes, foot_on_edge
from .merge_places import COINCIDENT, group, merge_places, pair_keys
from .place_grid import find_in_boxes, lay_grid

NEIGHBOURS = 32
NEAR = 10.0  # [m] within which feet are compared with whole edges, further away with their ends
FAR = 100.0  # [m] within which the lowest foot is looked up, to leave out feet that cannot hang
ROUNDING = 1e-6  # [m]
SLICE = 10_000  # edges at once: each may have some hundred feet nearby


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
    for part in range(0, len(start), SLICE):
        point, edge = find_in_boxes(grid, boxes[part : part + SLICE])
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
    edge = np.repeat(np.arange(len(start)), parts + 1)
    number = np.arange(len(edge)) - np.repeat(np.cumsum(parts + 1) - parts - 1, parts + 1)
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
