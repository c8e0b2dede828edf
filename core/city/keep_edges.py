"""Which edges stay Delaunay where more places are added: found without triangulating all of them.

    ·  ·          An edge is Delaunay if a circle through its ends is empty. The centres of these circles lie on
 ·        ·       its bisector; each place leaves those on one side of a point of it, where the circle meets the
a──────────b      place. The two triangles at an edge bound them; of the new places, the nearest to the centre of
 ·        ·       the smallest circle left is asked for again and again, until it lies outside or none is left.
    ·  ·
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .places_in_plan import pair_keys
from .triangulate_plan import TIE


@dataclass
class Circles:
    """The circles through both ends of each edge whose centres lie between two points of its bisector."""

    middle: np.ndarray  # (e, 2) float64 [m]
    normal: np.ndarray  # (e, 2) float64, unit vectors
    square: np.ndarray  # (e,) float64 [m²] of half the edge's length
    low: np.ndarray  # (e,) float64 [m] from the middle along the normal
    high: np.ndarray  # (e,) float64 [m]


def find_cut_edges(places, mesh, edges, added):
    """Edges that are not in the Delaunay triangulation of all places: (e,) bool.

    Parameters
    ----------
    places : array, (p, 2) float64 [m]
    mesh : tuple of (t, 3) int64 and Sides
        Delaunay triangles of these, and their sides.
    edges : array, (e, 2) int64
        The smaller number first.
    added : array, (k, 2) float64 [m]
        More places, none of them within half an edge of its middle.
    """
    triangles, sides = mesh
    key, wanted = np.append(sides.key, [-1, -1]), pair_keys(edges)
    apex = triangles[:, [2, 0, 1]].ravel()  # of each side
    first = np.searchsorted(sides.key, wanted)
    cut = key[first] != wanted
    kept = np.flatnonzero(~cut)
    circles = draw_circles(places[edges[kept, 0]], places[edges[kept, 1]])
    leave(circles, np.arange(len(kept)), places[apex[sides.side[first[kept]]]])
    two = np.flatnonzero(key[first[kept] + 1] == wanted[kept])
    leave(circles, two, places[apex[sides.side[first[kept[two]] + 1]]])
    cut[kept] = meet_all(circles, added)
    return cut


def draw_circles(start, end):
    """All circles through the ends of each edge, (e, 2) float64 [m]."""
    along = end - start
    half = 0.5 * np.hypot(*along.T)
    normal = np.column_stack([-along[:, 1], along[:, 0]]) / (2 * half)[:, None]
    endless = np.full(len(along), np.inf)
    return Circles(0.5 * (start + end), normal, half**2, -endless, endless)


def leave(circles, rows, places):
    """Leave those circles of some edges that do not hold a place each, (k, 2)."""
    away = places - circles.middle[rows]
    side, square = (away * circles.normal[rows]).sum(axis=1), (away**2).sum(axis=1) - circles.square[rows]
    for beyond, bound, nearer in ((side > 0, circles.high, np.minimum), (side < 0, circles.low, np.maximum)):
        some = rows[beyond]
        bound[some] = nearer(bound[some], square[beyond] / (2 * side[beyond]))


def meet_all(circles, places):
    """Edges all of whose circles that are left hold one of some places: (e,) bool.

    The smallest circle of an edge, around its middle, is taken to be empty of them.
    """
    tree, left = cKDTree(places), np.flatnonzero((circles.low > 0) | (circles.high < 0))
    while len(left):
        shift = np.clip(0, circles.low[left], circles.high[left])
        centre = circles.middle[left] + shift[:, None] * circles.normal[left]
        distance, nearest = tree.query(centre)
        inside = distance**2 < (circles.square[left] + shift**2) * (1 - TIE)
        left = left[inside]
        leave(circles, left, places[nearest[inside]])
        left = left[circles.low[left] <= circles.high[left]]
    return circles.low > circles.high
