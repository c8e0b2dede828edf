"""Loops over the rows of the matrix of form factors (compiled by numba).

Rays of one patch that hit the same place are merged before they are multiplied, except for a single light source, where
that would cost more than it saves. Each loop takes `rows`, the arrays of `Rows`; `scale`, the bit shifts from a key to
the patch and to the cell that was hit, and the weight of one ray; and `product`, to which it writes.
"""

import numpy as np
from numba import njit

from ..sampling.sample_points import HEMISPHERE_REPLICATES
from .form_factors import REPLICATE_BITS

NONE = np.float32(0)


@njit(nogil=True, cache=True)
def merge_row(row, rows, shift, met, weight):
    """Count the rays of one patch that hit the same place; a place is a key without its last bits.

    Parameters
    ----------
    row : int
    rows : tuple of (c + 1,) int64, (e,) int32 and (e,) int
        Start, key and count, as of `Rows`.
    shift : int
        Number of bits to drop.
    met : (m,) int32
        Written: the places, followed by three zeros, so that they can be processed in fours.
    weight : (m,) float32
        Written: number of rays that hit each.

    Returns
    -------
    int
        Number of places.
    """
    start, key, count = rows
    found, entry, last = 0, start[row], start[row + 1]
    while entry < last:
        place, rays = key[entry] >> shift, 0
        while entry < last and key[entry] >> shift == place:
            rays += count[entry]
            entry += 1
        met[found], weight[found] = place, rays
        found += 1
    met[found : found + 3], weight[found : found + 3] = 0, 0
    return found


@njit(nogil=True, cache=True)
def room_for_rows(start):
    """Scratch arrays for the merged places of the longest row."""
    longest = 0
    for row in range(len(start) - 1):
        longest = max(longest, start[row + 1] - start[row])
    return np.empty(longest + 3, np.int32), np.empty(longest + 3, np.float32)


@njit(nogil=True, cache=True)
def add_single(rows, scale, product, factor, light):
    """Radiosity of cells, a factor (p · cells,) times light (p,), times the share of rays that hit them."""
    (chosen, start, key, count), (to_patch, to_cell, share) = rows, scale
    for row in range(len(chosen)):
        total = 0.0
        for entry in range(start[row], start[row + 1]):
            total += count[entry] * factor[key[entry] >> to_cell] * light[key[entry] >> to_patch]
        product[chosen[row], 0] = share * total


@njit(nogil=True, cache=True, inline="always")
def radiosity_met(key, scale, factor, light):
    """Radiosity of the place of a key, a factor (p,) times light (p, cells) or (p, 1)."""
    to_patch, to_cell, share = scale
    patch = key >> to_patch
    cell = 0 if light.shape[1] == 1 else (key >> to_cell) - (patch << (to_patch - to_cell))
    return share * factor[patch] * light[patch, cell]


@njit(nogil=True, cache=True)
def add_starts(rows, scale, product, factor, light):
    """Radiosity of cells times the share of rays that hit them, by the cells in which the rays start."""
    chosen, start, key, count = rows
    for row in range(len(chosen)):
        total = product[chosen[row]]
        total[:] = 0
        for entry in range(start[row], start[row + 1]):
            begun = (key[entry] >> REPLICATE_BITS) & (len(total) - 1)
            total[begun] += np.float32(count[entry]) * radiosity_met(key[entry], scale, factor, light)


@njit(nogil=True, cache=True)
def weigh_row(row, rows, scale, factor, places):
    """Like `merge_row` for whole patches, with each ray weighted by the factor, (p · cells,), of the cell that it hits.

    Parameters
    ----------
    places : tuple of (m,) int32 and (m,) float32
        Written.
    """
    (start, key, count), (to_patch, to_cell, share), (met, weight) = rows, scale, places
    found, entry, last = 0, start[row], start[row + 1]
    while entry < last:
        patch, total = key[entry] >> to_patch, np.float32(0)
        while entry < last and key[entry] >> to_patch == patch:
            total += np.float32(count[entry]) * factor[key[entry] >> to_cell]
            entry += 1
        met[found], weight[found] = patch, share * total
        found += 1
    met[found : found + 3], weight[found : found + 3] = 0, 0
    return found


@njit(nogil=True, cache=True, fastmath={"reassoc"})
def add_patches(rows, scale, product, radiosity, sums):
    """Radiosity of cells, a factor (p · cells,) times light (p, s), times the share of rays that hit them.

    `sums` is a tuple of (s,) and (p,) float32 as in `propagate`, and whether to add to the product or overwrite it.
    """
    (chosen, start, key, count), (weights, arrived, add), (factor, light) = rows, sums, radiosity
    met, weight = room_for_rows(start)
    total = np.empty(light.shape[1], np.float32)
    for row in range(len(chosen)):
        found = weigh_row(row, (start, key, count), scale, factor, (met, weight))
        total[:] = 0
        # Four at a time, so that the sums need not be loaded and stored for each.
        for four in range(0, found, 4):
            first, second = light[met[four]], light[met[four + 1]]
            third, fourth = light[met[four + 2]], light[met[four + 3]]
            a, b, c, d = weight[four], weight[four + 1], weight[four + 2], weight[four + 3]
            for column in range(len(total)):
                pair = a * first[column] + b * second[column]
                total[column] += pair + (c * third[column] + d * fourth[column])
        to, weighted = product[chosen[row]], np.float32(0)
        for column in range(len(total)):
            to[column] = to[column] + total[column] if add else total[column]
            weighted += total[column] * weights[column]
        arrived[chosen[row]] = weighted


@njit(nogil=True, cache=True)
def add_elements(rows, scale, product, factor, light):
    """Radiosity of cells times the share of rays that hit them, by replicate."""
    chosen, start, key, count = rows
    for row in range(len(chosen)):
        total = product[chosen[row]]
        total[:] = 0
        for entry in range(start[row], start[row + 1]):
            met = np.float32(count[entry]) * radiosity_met(key[entry], scale, factor, light)
            total[key[entry] & (HEMISPHERE_REPLICATES - 1)] += met


@njit(nogil=True, cache=True)
def add_columns(rows, scale, product, factor, places):
    """Factor (p,) times k kinds of light of cells, (p · cells, k), times the share of rays that hit them."""
    (chosen, start, key, count), (to_patch, to_cell, share) = rows, scale
    for row in range(len(chosen)):
        total = product[chosen[row]]
        total[:] = 0
        for entry in range(start[row], start[row + 1]):
            weight = share * np.float32(count[entry]) * factor[key[entry] >> to_patch]
            met = places[key[entry] >> to_cell]
            for column in range(len(total)):
                total[column] += weight * np.float32(met[column])


@njit(nogil=True, cache=True)
def add_visible(rows, scale, product, patches, suns):
    """Radiosity of cells under each sun, times the share of rays that hit them.

    Computing the cosine of incidence from normals and suns is no slower than loading it from a matrix.
    """
    (chosen, start, key, count), (to_patch, to_cell, share), (albedo, normal) = rows, scale, patches
    (directions, visible), entries = suns, (start, key, count)
    east, north, up = directions[0], directions[1], directions[2]
    bits = to_patch - to_cell
    met, weight = room_for_rows(start)
    mask, towards = np.empty(len(met), np.uint16), np.empty((len(met), 3), np.float32)
    for row in range(len(chosen)):
        found = merge_row(row, entries, to_cell, met, weight)
        for place in range(found + 3):
            mask[place] = 1 << (met[place] & ((1 << bits) - 1))
            met[place] >>= bits
            for axis in range(3):
                towards[place, axis] = share * albedo[met[place]] * weight[place] * normal[met[place], axis]
        total = product[chosen[row]]
        total[:] = 0
        for place in range(0, found, 2):
            first, second = visible[met[place]], visible[met[place + 1]]
            a, b = mask[place], mask[place + 1]
            c, d, e = towards[place, 0], towards[place, 1], towards[place, 2]
            f, g, h = towards[place + 1, 0], towards[place + 1, 1], towards[place + 1, 2]
            for sun in range(len(total)):
                x, y, z = east[sun], north[sun], up[sun]
                one, other = c * x + d * y + e * z, f * x + g * y + h * z
                total[sun] += (one if first[sun] & a else NONE) + (other if second[sun] & b else NONE)
