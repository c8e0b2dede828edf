"""Cosine-distributed rays from random points of patches, and values at two halves of their nets of
points as one.
"""

from pathlib import Path

import numpy as np
from numba import njit

from .random_numbers import uniform
from .sample_points import DIGITS, HEMISPHERE_REPLICATES, sobol_points

# each patch is divided into 64 cells, tested for being inside or under something
CELL_DIVISIONS = 8
HALF, ONE, TURN, UNIT = (
    np.float32(0.5),
    np.float32(1),
    np.float32(2 * np.pi),
    np.float32(2.0**-DIGITS),
)


def hemisphere_rays(patches, chosen, sequence):
    """Origins, directions and cells of the hemisphere rays of patches.

    Position and direction come from one four-dimensional Sobol sequence with a random digital shift
    for each patch and replicate; pairs from two-dimensional sequences would be correlated. Patches
    that sent rays before go on from there.

    Parameters
    ----------
    patches : Patches
    chosen : (c,) int
    sequence : (rays / HEMISPHERE_REPLICATES, 4) uint32
        Of `sobol_digits`.

    Returns
    -------
    origins, directions : (c, rays, 3) float32
        In memory all x come first, then all y, then all z.
    cells : (c, rays) uint8
        Index of the patch cell, of CELL_DIVISIONS², in which each ray starts.
    """
    count, rays = len(chosen), len(sequence) * HEMISPHERE_REPLICATES
    shift = shift_replicates(patches.key[chosen], patches.rays_before[chosen])
    origins, directions = np.empty((2, 3, count, rays), np.float32)
    cells = np.empty((count, rays), np.uint8)
    made = origins, directions, cells
    frames = np.concatenate([patches.tangents[chosen], patches.normal[chosen, None]], axis=1)
    start = patches.corner[chosen] + patches.offset[chosen, None] * patches.normal[chosen]
    digits = np.ascontiguousarray(sequence.T)
    _make_rays((start, patches.edges[chosen], frames), shift, digits, made)
    return np.moveaxis(origins, 0, -1), np.moveaxis(directions, 0, -1), cells


def shift_replicates(keys, before):
    """Digital shifts (XOR masks) of the rays of patches.

    Parameters
    ----------
    keys : (c,) uint64
    before : (c,) int
        Points of the sequence that each replicate took before: a multiple of the smallest power of
        two not below the number to take now.

    Returns
    -------
    (c, HEMISPHERE_REPLICATES, 4) uint32
    """
    shift = (uniform(keys, 4 * HEMISPHERE_REPLICATES) * (1 << DIGITS)).astype(np.uint32)
    return shift.reshape(len(keys), HEMISPHERE_REPLICATES, 4) ^ sobol_points(before)[:, None]


@njit(nogil=True, cache=True)
def _make_rays(places, shift, sequence, made):
    """Generate the rays of c patches.

    Parameters
    ----------
    places : tuple of (c, 3), (c, 2, 3) and (c, 3, 3) float32
        Corner, edges and local frame of each patch.
    shift : (c, HEMISPHERE_REPLICATES, 4) uint32
        Digital shifts (XOR masks).
    sequence : (4, rays / HEMISPHERE_REPLICATES) uint32
    made : tuple of (3, c, rays), (3, c, rays) float32 and (c, rays) uint8
        Output: origins, directions, cells.
    """
    (start, edges, frames), (origins, directions, cells) = places, made
    samples = sequence.shape[1]
    cosine, sine, last = _table_of_angles(samples)
    b1, b2 = np.empty(samples, np.float32), np.empty(samples, np.float32)
    along, across = np.empty(samples, np.float32), np.empty(samples, np.float32)
    height = np.empty(samples, np.float32)
    for patch in range(len(start)):
        for replicate in range(shift.shape[1]):
            first = replicate * samples
            mask = (
                shift[patch, replicate, 0],
                shift[patch, replicate, 1],
                shift[patch, replicate, 2],
                shift[patch, replicate, 3],
            )
            # Where each ray starts: the unit square becomes the triangle, areas keep their shares.
            for sample in range(samples):
                s, t = (
                    fraction(sequence[0, sample] ^ mask[0]),
                    fraction(sequence[1, sample] ^ mask[1]),
                )
                b1[sample] = s * HALF if t > s else s - t * HALF
                b2[sample] = t - s * HALF if t > s else t * HALF
            # The leading digits of the angle select an entry of the table; the others rotate all
            # entries alike.
            rest = TURN * fraction(mask[3] & ((1 << last) - 1))
            cosine_rest, sine_rest = np.cos(rest), np.sin(rest)
            # Direction by the cosine law: radius √u on the disc below, height √(1 - u); its angle
            # by the sum formulas of cosine and sine.
            for sample in range(samples):
                u, entry = (
                    fraction(sequence[2, sample] ^ mask[2]),
                    (sequence[3, sample] ^ mask[3]) >> last,
                )
                radius = np.sqrt(u)
                along[sample] = radius * (cosine[entry] * cosine_rest - sine[entry] * sine_rest)
                across[sample] = radius * (sine[entry] * cosine_rest + cosine[entry] * sine_rest)
                height[sample] = np.sqrt(ONE - u)
            # From the frame of the triangle to the world.
            for axis in range(3):
                corner, first_edge, second_edge = (
                    start[patch, axis],
                    edges[patch, 0, axis],
                    edges[patch, 1, axis],
                )
                one, other, up = (
                    frames[patch, 0, axis],
                    frames[patch, 1, axis],
                    frames[patch, 2, axis],
                )
                for sample in range(samples):
                    origins[axis, patch, first + sample] = (
                        corner + b1[sample] * first_edge + b2[sample] * second_edge
                    )
                    directions[axis, patch, first + sample] = (
                        along[sample] * one + across[sample] * other + height[sample] * up
                    )
            # The cell of the patch in which each ray starts.
            for sample in range(samples):
                cells[patch, first + sample] = cell_at(
                    b1[sample], b2[sample], np.int64(CELL_DIVISIONS)
                )


@njit(nogil=True, cache=True, inline="always")
def _table_of_angles(count):
    """Cosine and sine of the angles given by the leading digits of `count` points, and number of
    other digits.
    """
    leading = 0
    while (1 << leading) < count:
        leading += 1
    entries = 1 << leading
    cosine, sine = np.empty(entries, np.float32), np.empty(entries, np.float32)
    for entry in range(entries):
        angle = TURN * np.float32(entry) / np.float32(entries)
        cosine[entry], sine[entry] = np.cos(angle), np.sin(angle)
    return cosine, sine, DIGITS - leading


@njit(nogil=True, cache=True, inline="always")
def fraction(digits):
    """Number in [0, 1) from its binary digits."""
    return np.float32(digits) * UNIT


@njit(nogil=True, cache=True)
def cell_at(b1, b2, divisions):
    """Which of the `divisions`² congruent sub-triangles contains a point: `Cells.of_point` for one
    point.
    """
    row = int(min(b2 * np.float32(divisions), np.float32(divisions - 1)))
    along = int(min(b1 * np.float32(divisions), np.float32(divisions - 1)))
    inverted = (b1 + b2) * np.float32(divisions) - np.float32(row) - np.float32(along) >= ONE
    return row * (2 * divisions - row) + min(2 * along + int(inverted), 2 * (divisions - 1 - row))


def is_compiled():
    """Whether the compiled loops of an earlier run are kept on this machine."""
    cache = Path(_make_rays._cache.cache_path)  # numba has no public name for it
    return any(cache.glob("*make_rays*.nbi"))
