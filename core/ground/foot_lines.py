"""Feet as lines in plan view, each once, and how high the highest of them is at a place."""

from dataclasses import dataclass

import numpy as np
import shapely

from .merge_places import pair_keys
from .slope_filter import foot_on_edge

ABREAST = 0.25  # [m] feet closer together than this get the height of the higher one


@dataclass
class FootLines:
    """Distinct edges of the feet, and where to find them."""

    start: np.ndarray  # (e, 3) float64 [m]
    end: np.ndarray  # (e, 3) float64 [m]
    step: np.ndarray  # (e,) float64 [m] largest height above a neighbouring foot, of all that are the same
    tree: shapely.STRtree  # of the edges in plan view


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
    lines = shapely.linestrings(np.stack([start[:, :2], end[:, :2]], axis=1))
    return FootLines(start, end, step, shapely.STRtree(lines))


def highest_foot(lines, places):
    """Height [m] of the highest foot edge at each place, (k, 3), leaving out edges too far above it: (k,) float64."""
    place, edge = lines.tree.query(shapely.points(places[:, :2]), "dwithin", distance=ABREAST)
    height = foot_on_edge(places[place], lines.start[edge], lines.end[edge])[:, 2]
    near = height <= places[place, 2] + lines.step[edge]
    highest = places[:, 2].copy()
    np.maximum.at(highest, place[near], height[near])
    return highest
