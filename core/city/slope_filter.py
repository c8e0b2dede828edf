"""Which feet stand on the ground: a slope filter, as for LiDAR. A foot hangs if it is too far above
another nearby.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..settings.tolerances import GEOMETRY
from .plan_geometry import find_in_boxes, merge_places, pair_keys, plant_tree


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
    # Both ends of each edge against the feet nearest to them.
    ends, step, slope = np.concatenate([start, end]), np.tile(step, 2), np.tile(slope, 2)
    hangs = _hangs_above_feet(ends, step, slope, start)
    # Likewise beside whole edges, up to 10 m away: a bay above the middle of a long wall stands on
    # nothing.
    some = np.flatnonzero(~hangs)
    ends, step, slope = ends[some], step[some], slope[some]
    for point, _, foot, distance in _pass_edges(ends, start, end, 10.0):
        rise = ends[point, 2] - foot[:, 2]
        hangs[some[point[rise > step[point] + slope[point] * distance + GEOMETRY.accuracy]]] = True
    return ~hangs.reshape(2, -1).any(axis=0)


def _hangs_above_feet(points, step, slope, others, *, at_once=50_000):
    """Points (p, 3) for which z - z' <= step + slope * distance does not hold for all nearest feet:
    (p,) bool.
    """
    # of several feet at one position only the lowest matters
    lowest = others[merge_places(others)[0]]
    tree, hangs = cKDTree(lowest[:, :2]), np.zeros(len(points), bool)
    # Rise above each of the 32 nearest feet, against the step and the slope times the distance.
    for first in range(0, len(points), at_once):
        some = slice(first, first + at_once)
        distance, index = tree.query(points[some, :2], k=np.arange(1, min(32, len(lowest)) + 1))
        #         ● hangs
        #       ╱   slope
        #     ╱
        #     ┆ step
        #   ──●── foot
        rise = points[some, 2, None] - lowest[index, 2]
        hangs[some] = (rise > step[some, None] + slope[some, None] * distance).any(axis=1)
    return hangs


def _pass_edges(points, start, end, within, *, at_once=1_000):
    """Pairs of a point and an edge that is within a distance [m] of it in plan, of some edges at a
    time.

    Yields
    ------
    point, edge : (k,) int64
    foot : (k, 3) float64 [m]
        The edge's nearest place in plan, at its height.
    distance : (k,) float64 [m]
        To it, in plan.
    """
    tree, span = plant_tree(points), end - start
    boxes = [np.minimum(start, end)[:, :2] - within, np.maximum(start, end)[:, :2] + within]
    boxes, squared = (
        np.concatenate(boxes, axis=1),
        np.maximum((span[:, :2] ** 2).sum(axis=1), 1e-12),
    )
    # Points in the box around each edge, then the nearest place on it: share  of the way from start
    # to end.
    for first in range(0, len(start), at_once):
        point, edge = find_in_boxes(tree, boxes[first : first + at_once])
        edge += first
        away = points[point, :2] - start[edge, :2]
        share = (away * span[edge, :2]).sum(axis=1) / squared[edge]
        foot = start[edge] + np.clip(share, 0, 1)[:, None] * span[edge]
        distance = np.hypot(*(points[point, :2] - foot[:, :2]).T)
        near = distance <= within
        yield point[near], edge[near], foot[near], distance[near]


@dataclass
class _FootLines:
    """Distinct edges of the feet."""

    start: np.ndarray  # (e, 3) float64 [m]
    end: np.ndarray  # (e, 3) float64 [m]
    # (e,) float64 [m] largest height above a neighbouring foot, of all that are the same
    step: np.ndarray


def draw_lines(feet):
    """The edges of Feet, walls and footprints that share one drawn once: FootLines."""
    start, end = feet.start, feet.end
    # Ends at the same place and height are the same point; edges between the same two points are
    # one.
    ends = np.concatenate([start, end])
    _, place = np.unique(ends[:, 0] + 1j * ends[:, 1], return_inverse=True)
    _, point = np.unique(place + 1j * ends[:, 2], return_inverse=True)
    pairs = np.sort(point.reshape(2, -1), axis=0).T
    _, first, line = np.unique(pair_keys(pairs), return_index=True, return_inverse=True)
    step = np.zeros(len(first))
    np.maximum.at(step, line, feet.step)
    return _FootLines(start[first], end[first], step)


def highest_foot(lines, places):
    """Height [m] of the highest foot edge at each place, (k, 3), leaving out edges too far above
    it: (k,) float64.
    """
    highest = places[:, 2].copy()
    # Feet closer together than 0.25 m get the height of the higher one.
    for place, edge, foot, _ in _pass_edges(places, lines.start, lines.end, 0.25):
        low = foot[:, 2] <= places[place, 2] + lines.step[edge]
        np.maximum.at(highest, place[low], foot[low, 2])
    return highest
