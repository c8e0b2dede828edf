"""Points of a patch from which shadow rays start, and which of them represents which part of it."""

import functools
from typing import NamedTuple

import numpy as np
from numba import njit

from ..patches.cover_cells import enclosed_cells, unpack_cells
from ..rays import sample_points
from ..rays.hemisphere_rays import CELL_DIVISIONS, fraction
from ..rays.random_numbers import mix, uniform
from ..rays.sample_points import DIGITS
from ..settings.threads import map_in_order

HALF = np.float32(0.5)
WORD = 16  # points, one bit each


class KnownPoints(NamedTuple):
    """What is known of the points of p patches: the same for all suns."""

    open_points: np.ndarray  # (p, m) bool, False where the point lies deep inside something
    # (p, elements) uint, the point that stands for each element of `count_elements`
    representative_points: np.ndarray
    counted: np.ndarray  # (p, words) uint16, bit k of word w: light at point WORD · w + k counts

    def find_dark(self, rows):
        """Points of some patches, (r,) int, at which light does not count: (r, m) bool."""
        octets = np.ascontiguousarray(self.counted[rows], "<u2").view(np.uint8)
        points = self.open_points.shape[1]
        return np.unpackbits(octets, axis=1, bitorder="little")[:, :points] == 0


def points_above(count):
    """The smallest power of two not below `count`: the number of points of a digital net."""
    return 1 << (count - 1).bit_length()


def count_elements(point_count):
    """Number of cells by which the light of a patch is resolved: 1, 4 or 16, at most one
    per point.
    """
    # A patch has 16 cells at most: one bit each in the mask of those that see a sun. Points are as
    # many as the next power of two.
    return next(cells for cells in (16, 4, 1) if cells <= points_above(point_count))


def shadow_points(patches, chosen, point_count):
    """Evenly distributed points on some patches: (c, point_count, 3) float32 [m].

    They are the first points of Sobol's sequence, with a random digital shift for each patch. So
    they are also even within all bands parallel to its edges, along which shadows often run.
    """
    start = patches.corner[chosen] + patches.offset[chosen, None] * patches.normal[chosen]
    b1, b2 = _places_of_points(patches.key[chosen], patches.points_before[chosen], point_count)[
        ..., None
    ]
    edges = patches.edges[chosen, :, None]
    return start[:, None] + b1 * edges[:, 0] + b2 * edges[:, 1]


def find_points(
    patches, covered, counts, wanted, threads=1, *, left_out=None, patches_per_task=1 << 12
):
    """Which points of patches lie in the open, and which of them stand for which element.

    Parameters
    ----------
    patches : Patches
    covered : (p, cells) bool
        Cells that lie inside or under something.
    counts : tuple of two int
        Points of each patch, and elements, at most as many.
    wanted : (p,) bool
        Patches that look at suns.
    threads : int
    left_out : (p,) uint64, optional
        As of `RayCity`.

    Returns
    -------
    KnownPoints
    """
    # By default all points lie in the open; the middle of each element tells which point stands for
    # it.
    count, (point_count, elements) = len(patches), counts
    is_open = np.ones((count, point_count), bool)
    representative_points = np.zeros((count, elements), np.min_scalar_type(point_count - 1))
    middles = sample_points.Cells(round(np.sqrt(elements))).corners().mean(axis=1)
    divisions = round(np.sqrt(covered.shape[1]))
    counted = np.full((count, -(-point_count // WORD)), (1 << WORD) - 1, np.uint16)

    def find(rows):
        """Write to the arrays above what is known of the points of some patches, (r,) int."""
        # Points in covered cells; open are all but those whose cell has only covered neighbours.
        # Elements, parts of a patch whose light is kept apart, that are covered as a whole.
        places = _places_of_points(patches.key[rows], patches.points_before[rows], point_count)
        in_covered, all_covered = (
            np.zeros((len(rows), point_count), bool),
            np.zeros((len(rows), elements), bool),
        )
        partly = np.flatnonzero(covered[rows].any(axis=1))
        cells = covered[rows[partly]]
        cell = sample_points.Cells(divisions).of_point(*places[:, partly]).astype(np.intp)
        in_covered[partly] = np.take_along_axis(cells, cell, axis=1)
        is_open[rows[partly]] = ~np.take_along_axis(enclosed_cells(cells), cell, axis=1)
        # An element is covered as a whole where all its cells are; cells may be known too coarsely
        # to tell.
        if covered.shape[1] >= elements:
            inside = sample_points.Cells(divisions).inside(round(np.sqrt(elements)))
            members = np.argsort(inside, kind="stable").reshape(elements, -1)
            all_covered[partly] = cells[:, members].all(axis=2)
        # The point nearest to the middle of an element stands for it. It lies in no covered cell
        # unless the element is covered as a whole and must be dark.
        chosen = np.empty((len(rows), elements), representative_points.dtype)
        _choose_representatives(places, (in_covered, all_covered), middles, chosen)
        representative_points[rows] = chosen
        # Points in cells without room for modules are not counted.
        some = np.flatnonzero(0 if left_out is None else left_out[rows])
        if len(some):
            cell = sample_points.Cells(CELL_DIVISIONS).of_point(*places[:, some]).astype(np.intp)
            lit = np.ones((len(some), WORD * counted.shape[1]), bool)
            lit[:, :point_count] = ~np.take_along_axis(
                unpack_cells(left_out[rows[some]]), cell, axis=1
            )
            counted[rows[some]] = np.packbits(lit, axis=1, bitorder="little").view("<u2")

    rows = np.flatnonzero(wanted)
    for _ in map_in_order(
        find, np.split(rows, range(patches_per_task, len(rows), patches_per_task)), threads
    ):
        pass
    return KnownPoints(is_open, representative_points, counted)


def _places_of_points(keys, before, point_count):
    """Barycentric weights of the shadow points of patches: (2, c, m) float32.

    Parameters
    ----------
    keys : (c,) uint64
    before : (c,) int
        Points of the sequence that each patch took before: a multiple of `point_count`.
    point_count : int
        A power of two.
    """
    places = np.empty((2, len(keys), point_count), np.float32)
    place_points(
        shift_points(keys, before),
        (points_of_grid(point_count), grid_of(point_count)),
        places,
    )
    return places


def shift_points(keys, before):
    """Digital shifts (XOR masks) of the shadow points of patches: (c, 2) uint32. Parameters as
    above.
    """
    shift = (uniform(mix(keys ^ np.uint64(0x5EED)), 2) * (1 << DIGITS)).astype(np.uint32)
    return shift ^ sample_points.sobol_points(before)[:, :2]


def grid_of(count):
    """Rows and columns of the unit square divided into `count` rectangles, a power of two:
    two int.
    """
    power = count.bit_length() - 1
    return 1 << power // 2, 1 << (power - power // 2)


@functools.cache
def points_of_grid(count):
    """First `count` two-dimensional Sobol points: one in each rectangle of `grid_of`, in the order
    of the rectangles.

    Parameters
    ----------
    count : int
        A power of two.

    Returns
    -------
    (count, 2) uint32
        Coordinates along columns and rows, multiples of 2^-DIGITS.
    """
    digits = sample_points.sobol_digits(count)[:, :2]
    rows, columns = grid_of(count)
    along, across = digits.astype(np.int64).T  # 2^DIGITS times a side overflows 32 bits
    rectangle = (across * rows >> DIGITS) * columns + (along * columns >> DIGITS)
    return digits[np.argsort(rectangle)]


@njit(nogil=True, cache=True)
def place_points(shift, net, places):
    """Barycentric weights of points, one for each rectangle of the unit square, in the order of the
    rectangles.

    Parameters
    ----------
    shift : (c, 2) uint32
        Digital shift: the bits to flip.
    net : tuple of (m, 2) uint32 and tuple of int
        Of `points_of_grid` and `grid_of`.
    places : (2, c, m) float32
        Written.
    """
    digits, (rows, columns) = net
    for patch in range(len(shift)):
        turn = shift[patch]
        # The shift of the leading digits gives the rectangle of the unshifted point that lands in
        # the wanted one.
        column_turn, row_turn = (turn[0] * columns) >> DIGITS, (turn[1] * rows) >> DIGITS
        for point in range(len(digits)):
            row, column = point // columns ^ row_turn, point % columns ^ column_turn
            digit = digits[row * columns + column]
            u, v = fraction(digit[0] ^ turn[0]), fraction(digit[1] ^ turn[1])
            places[0, patch, point] = u * HALF if v > u else u - v * HALF
            places[1, patch, point] = v - u * HALF if v > u else v * HALF


@njit(nogil=True, cache=True)
def _choose_representatives(places, excluded, middles, representative_points):
    """The point nearest to the middle of each cell, but no point that lies inside or under
    something.

    Except in cells that are fully covered: they are seen only from inside, and must be dark there.

    Parameters
    ----------
    places : (2, c, m) float32
    excluded : tuple of (c, m) and (c, cells) bool
        Points, and entire cells, that lie inside or under something.
    middles : (cells, 2) float32
        Barycentric weights.
    representative_points : (c, cells) uint
        Written.
    """
    in_covered, all_covered = excluded
    for patch in range(len(in_covered)):
        for cell in range(len(middles)):
            nearest, chosen = np.float32(np.inf), 0
            for point in range(in_covered.shape[1]):
                x, y = (
                    places[0, patch, point] - middles[cell, 0],
                    places[1, patch, point] - middles[cell, 1],
                )
                away = x * x + x * y + y * y  # squared, on a triangle of equal sides
                if away < nearest and (all_covered[patch, cell] or not in_covered[patch, point]):
                    nearest, chosen = away, point
            representative_points[patch, cell] = chosen
