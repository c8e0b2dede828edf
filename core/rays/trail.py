"""Trails of rays: through which parts of a city the rays of each patch pass.

┌───┬───┬───┬───┐ layer 3     The city is divided into squares of the plan and layers of height. What the rays of a
├───┼───┼───┼───┤ layer 2     patch meet, and so what of it is covered, an edit can change only where one of them
├───┼───┼─↗─┼───┤ layer 1     passed a part of the city that is edited.
└─p─┴─╱─┴───┴───┘ layer 0
"""

from dataclasses import dataclass, replace
from threading import Lock

import numpy as np
from numba import njit

SQUARES = 16  # along each side: one bit each
LAYERS = np.array([1 / 4, 1.0])  # of the city's height, where they end; the last one has no end
AROUND = 1.0  # [m] around each patch in which it looks for faces that touch it, or leave it no room
SIDE, MOST_BOXES = 10.0, 1 << 10  # [m] of the squares by which boxes of edits are told apart, and their number
ROUNDING = 0.01  # [m] around what is edited
_writing = Lock()  # held while bits are set: rays of one surface come from several threads


@dataclass
class Trail:
    """Parts of a city that the rays of p patches pass, or of p surfaces."""

    edges: np.ndarray  # (2, SQUARES + 1) float64 [m], of the squares along x and y, ascending
    ends: np.ndarray  # (2,) float64 [m], of the layers
    seen: np.ndarray  # (p, SQUARES, 3) uint16: of each row of squares and layer a bit for each square

    def note(self, shapes, owner, rays, places):
        """Add rays of some patches.

        Parameters
        ----------
        shapes : tuple of (t, 3) float32 and (t, 2, 3) float32 [m]
            First corner and edges of the triangles that they meet.
        owner : (m,) int
            The patch that sends each.
        rays : tuple of two (m, 3) float32 [m]
            Origins and unit directions.
        places : HitPlaces
            m, where they end.
        """
        rays = tuple(np.ascontiguousarray(part.T, np.float32) for part in rays)
        places = tuple(np.ascontiguousarray(part) for part in places)
        with _writing:
            pass_squares((owner, *rays), (*shapes, *places), tuple(vars(self).values()))

    def passing(self, boxes):
        """Patches with rays that pass any of some boxes, (b, 2, 3) [m]: (p,) bool."""
        boxes = boxes + np.array([[-ROUNDING], [ROUNDING]])
        if not ((boxes[..., :2] >= self.edges[:, 0]) & (boxes[..., :2] <= self.edges[:, -1])).all():
            return np.ones(len(self.seen), bool)
        edited = np.bitwise_or.reduce(self._mark(boxes), axis=0)
        return (self.seen & edited).any(axis=(1, 2))

    def of_others(self, boxes, place=None):
        """The same of other patches in boxes, (q, 2, 3) [m], with what those passed that they are the same as: Trail.

        `place`, (q,) int, has the number of that patch, or -1.
        """
        boxes = boxes + np.array([[-AROUND], [AROUND]])
        boxes[..., 2] = [-np.inf, np.inf]
        seen = self._mark(boxes)
        if place is not None:
            seen[place >= 0] |= self.seen[place[place >= 0]]
        return replace(self, seen=seen)

    def _mark(self, boxes):
        """The parts that boxes touch, (b, SQUARES, 3) uint16; those beyond the squares touch the outer ones."""
        found = [np.searchsorted(edges[1:-1], boxes[..., axis]) for axis, edges in enumerate(self.edges)]
        first, last = np.stack(found, axis=2).swapaxes(0, 1)
        lowest, highest = np.searchsorted(self.ends, boxes[..., 2]).T
        squares, layers = np.arange(SQUARES), np.arange(len(self.ends) + 1)
        rows = (squares >= first[:, :1]) & (squares <= last[:, :1])
        some = rows[:, :, None] & ((layers >= lowest[:, None]) & (layers <= highest[:, None]))[:, None]
        bits = ((2 << last[:, 1]) - (1 << first[:, 1])).astype(np.uint16)
        return np.where(some, bits[:, None, None], np.uint16(0))


def begin_trail(scene, boxes):
    """Trail of patches in boxes, (p, 2, 3) [m], of a scene, that sent no rays yet. Squares are small where there is
    much to see."""
    low, high = np.min(scene.vertices, axis=0), np.max(scene.vertices, axis=0)
    places = scene.vertices[np.unique(scene.triangles[scene.triangle_surface >= 0])]
    edges = np.ascontiguousarray(np.quantile(places[:, :2], np.linspace(0, 1, SQUARES + 1), axis=0).T)
    edges[:, [0, -1]] = np.stack([low, high], axis=1)[:2]
    none = np.zeros((0, SQUARES, len(LAYERS) + 1), np.uint16)
    return Trail(edges, low[2] + LAYERS * (high - low)[2], none).of_others(boxes)


def boxes_of_patches(patches):
    """Box around each patch: (p, 2, 3) float64 [m]."""
    corners = patches.corner[:, None].astype(float) + np.pad(patches.edges, ((0, 0), (1, 0), (0, 0)))
    return np.stack([corners.min(axis=1), corners.max(axis=1)], axis=1)


def boxes_of(corners):
    """Boxes around triangles, (k, 3, 3): the first around all, the others around those in each square of the plan.

    Returns
    -------
    (b, 2, 3) float64 [m]
        None without triangles.
    """
    if not len(corners):
        return np.zeros((0, 2, 3))
    square = np.unique(np.floor(corners.mean(axis=1)[:, :2] / SIDE), axis=0, return_inverse=True)[1].ravel()
    square = square if square.max() < MOST_BOXES else np.zeros_like(square)
    order = np.argsort(square, kind="stable")
    first = np.flatnonzero(np.diff(square[order], prepend=-1))
    low = np.minimum.reduceat(corners.min(axis=1)[order], first)
    high = np.maximum.reduceat(corners.max(axis=1)[order], first)
    parts = np.stack([low, high], axis=1)
    return np.concatenate([[[low.min(axis=0), high.max(axis=0)]], parts])


@njit(nogil=True, cache=True)
def pass_squares(rays, ends, trail):
    """Mark the parts that rays pass.

    Parameters
    ----------
    rays : tuple of (m,) int, (3, m) float32 and (3, m) float32
        Patch that each belongs to, origins [m] and unit directions.
    ends : tuple
        Shapes as of `Trail.note`, and the parts of `HitPlaces`.
    trail : tuple
        Fields of Trail, of which the last one is written.

    References
    ----------
    J. Amanatides and A. Woo (1987), A fast voxel traversal algorithm for ray tracing.
    """
    (owner, origins, directions), (corner, sides, met, b1, b2), (edges, heights, seen) = rays, ends, trail
    square, following = np.empty(2, np.int64), np.empty(2)
    for ray in range(len(owner)):
        own, z, up = seen[owner[ray]], np.float64(origins[2, ray]), np.float64(directions[2, ray])
        length, outside = np.inf, False
        if met[ray] >= 0:
            length = 0.0
            for axis in range(3):
                face = met[ray]
                place = corner[face, axis] + b1[ray] * sides[face, 0, axis] + b2[ray] * sides[face, 1, axis]
                length += (place - origins[axis, ray]) * np.float64(directions[axis, ray])
        for axis in range(2):
            square[axis] = np.searchsorted(edges[axis], origins[axis, ray]) - 1
            outside |= square[axis] < 0 or square[axis] >= SQUARES
        if outside:  # of the squares of the city before an edit
            own[:] = 0xFFFF
            continue
        begun = 0.0
        while True:
            for axis in range(2):
                along = np.float64(directions[axis, ray])
                ahead = edges[axis, square[axis] + (along > 0)] - origins[axis, ray]
                following[axis] = ahead / along if along != 0 else np.inf
            axis = 0 if following[0] < following[1] else 1
            over = min(following[axis], length)
            one, other = z + begun * up, z + over * up if over < np.inf else np.inf * up
            first, last = min(one, other), max(one, other)
            for layer in range(len(heights) + 1):
                if (layer == len(heights) or first <= heights[layer]) and (layer == 0 or last >= heights[layer - 1]):
                    own[square[0], layer] |= np.uint16(1 << square[1])
            if following[axis] >= length:
                break
            begun = following[axis]
            square[axis] += 1 if directions[axis, ray] > 0 else -1
            if square[axis] < 0 or square[axis] >= SQUARES:
                break
