"""Sample points of the open ground: dense near the buildings, sparser with distance.

They are the middles of squares of patch size × 2ᵏ that lie at the same places whatever is built on them: counted from
zero of the grid of the files, as far as whole squares reach.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..rays.random_numbers import mix, uniform
from .locate_site import bring_to_origin
from .places_in_plan import find_inside, pair_keys
from .scene import Site

GROWTH = 0.35  # [m/m] how much a patch may grow per metre of distance from the nearest foot
KEEP_AWAY = 0.5  # [patch sizes] no points closer to a foot than this
SHIFT = 1e-2  # [squares] by which points are moved at random, so that no four lie on one circle

MILLIMETRE = 3  # decimals of a metre
PERIOD = 1 << 11  # [half patches] after which these random numbers repeat


class Lattice(NamedTuple):
    """Squares of the ground on the grid of the files."""

    low: np.ndarray  # (2,) float64 [m] least easting and northing, whole multiples of the step
    high: np.ndarray  # (2,) float64 [m]
    step: float  # [m] of the largest squares along the rim, patch_size × 2ᵏ
    patch_size: float  # [m] of the smallest squares
    site: Site  # whose frame the points are in

    def place(self, eastings_northings):
        """Points of the grid, (k, 2) float64 [m], in the scene's frame: (k, 2) float64 [m]."""
        return bring_to_origin(np.pad(eastings_northings, ((0, 0), (0, 1))), self.site)[:, :2]

    def draw_rim(self):
        """Points on the rim, one step apart, the corners among them: (r, 2) float64 [m] in the scene's frame."""
        x, y = (np.arange(low, high, self.step) for low, high in zip(self.low, self.high, strict=True))
        sides = [(x, self.low[1]), (self.high[0], y), (x + self.step, self.high[1]), (self.low[0], y + self.step)]
        return self.place(np.concatenate([np.stack(np.broadcast_arrays(*side), axis=1) for side in sides]))


def lay_lattice(low, high, reach, patch_size, site):
    """Lattice that reaches at least so far [m] beyond a rectangle of the grid of the files, two (2,) float64 [m]."""
    step = patch_size * 2.0 ** max(np.floor(np.log2(reach / patch_size)), 0)
    first, last = np.floor((low[:2] - reach) / step), np.ceil((high[:2] + reach) / step)
    return Lattice(first * step, last * step, step, patch_size, site)


def spread_points(foot_places, footprints, lattice):
    """Middles of squares outside the footprints, and points on the rim.

    A square is split as long as it is larger than patch_size + GROWTH * (distance to the nearest foot).

    Parameters
    ----------
    foot_places : array, (k, 2) float64 [m]
    footprints : array of shapely polygons
    lattice : Lattice

    Returns
    -------
    array, (p, 2) float64 [m]
        Those on the rim come last.
    """
    tree, patch_size, (low, high) = cKDTree(foot_places), lattice.patch_size, lattice[:2]
    # So large that none of the first is small enough: the others do not depend on where the ground ends.
    size = patch_size * 2.0 ** (3 + np.ceil(np.log2(max((high - low).max() / patch_size, 1))))
    x, y = (np.arange(np.floor(a / size), np.ceil(b / size)) for a, b in zip(low, high, strict=True))
    cells = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)  # column and row, from zero
    done = []
    while len(cells):
        cells = cells[((cells + 1) * size > low).all(axis=1) & (cells * size < high).all(axis=1)]
        middles = size * (cells + 0.5 + SHIFT * (draw_shifts(cells, size / patch_size) - 0.5))
        places = lattice.place(middles.round(MILLIMETRE))
        away, _ = tree.query(places)
        fine = size <= patch_size * 1.0001 + GROWTH * np.maximum(away - 0.7 * size, 0)
        fine &= (size <= lattice.step) | ((cells * size >= low) & ((cells + 1) * size <= high)).all(axis=1)
        done.append(places[fine & (away > KEEP_AWAY * patch_size)])
        cells = (2 * cells[~fine, None] + np.array([[0, 0], [1, 0], [0, 1], [1, 1]])).reshape(-1, 2)
        size /= 2
    places = np.concatenate(done)
    outside = np.ones(len(places), bool)
    outside[find_inside(footprints, places)[0]] = False
    return np.concatenate([places[outside], lattice.draw_rim()])


def draw_shifts(cells, size):
    """Random numbers in [0, 1) of squares, (k, 2) whole numbers, that are so many patches large: (k, 2) float32."""
    middle = ((2 * cells + 1) * size).astype(np.int64) % PERIOD  # of squares near each other no two have the same
    return uniform(mix(pair_keys(middle).view(np.uint64)), 2)
