"""Loops over the rows of the matrix of form factors (compiled by numba).

Each loop takes `rows`, the arrays of `Rows`; `scale`, the bit shifts from a key to the patch and to
the cell that was hit, and the share of one ray in all rays of each patch, (p,) float32; and
`product`, to which it adds.
"""

import numpy as np
from numba import njit

from ..rays.sample_points import HEMISPHERE_REPLICATES

NONE, ONE = np.float32(0), np.float32(1)


@njit(nogil=True, cache=True, inline="always")
def _merge_row(row, rows, shift, met, weight):
    """Count the rays of one patch that hit the same place; a place is a key without its last bits.

    Parameters
    ----------
    row : int
    rows : tuple of (c + 1,) int64 and (e,) int32
        Start and key, as of `Rows`.
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
    start, key = rows
    found, last, rays = -1, -1, NONE
    # Without branches: whether a ray hits the same place as the one before cannot be predicted.
    for entry in range(start[row], start[row + 1]):
        place = key[entry] >> shift
        found += place != last
        rays = ONE + (rays if place == last else NONE)
        met[found], weight[found] = place, rays
        last = place
    found += 1
    for spare in range(found, found + 3):
        met[spare], weight[spare] = 0, 0
    return found


@njit(nogil=True, cache=True)
def link_patches(rows, scale, factor):
    """Patches that the rays of each row meet, once each, with their weights: form factor times
    factor (p · cells,).

    Returns
    -------
    start : (c + 1,) int64
        Where the hits of each row begin. Each row has a multiple of four, so that they can be
        processed in fours.
    patch : (l,) int32
    weight : (l,) float32
        0 for those that fill up a four.
    """
    (chosen, first, key), (to_patch, to_cell, share) = rows, scale
    start = np.zeros(len(first), np.int64)
    for row in range(len(chosen)):
        found, last = 0, -1
        for entry in range(first[row], first[row + 1]):
            found += key[entry] >> to_patch != last
            last = key[entry] >> to_patch
        start[row + 1] = start[row] + (found + 3) // 4 * 4
    patch, weight = np.zeros(start[-1], np.int32), np.zeros(start[-1], np.float32)
    for row in range(len(chosen)):
        # what is lost in one reflection grows with their number
        place, last, total = (
            start[row] - 1,
            -1,
            0.0,
        )
        # Without branches, as in `_merge_row`.
        for entry in range(first[row], first[row + 1]):
            met = key[entry] >> to_patch
            place += met != last
            total = (total if met == last else 0.0) + factor[key[entry] >> to_cell]
            patch[place], weight[place] = met, share[chosen[row]] * total
            last = met
    return start, patch, weight


@njit(nogil=True, cache=True, fastmath={"reassoc"})
def add_patches(chosen, links, product, light):
    """Light of patches, (p, s), times the weights of `link_patches`."""
    start, patch, weight = links
    for row in range(len(chosen)):
        total = product[chosen[row]]
        # Four at a time, so that the sums need not be loaded and stored for each.
        for four in range(start[row], start[row + 1], 4):
            first, second = light[patch[four]], light[patch[four + 1]]
            third, fourth = light[patch[four + 2]], light[patch[four + 3]]
            a, b, c, d = weight[four], weight[four + 1], weight[four + 2], weight[four + 3]
            for column in range(len(total)):
                pair = a * first[column] + b * second[column]
                total[column] += pair + (c * third[column] + d * fourth[column])


@njit(nogil=True, cache=True)
def add_elements(rows, scale, product, radiosity, shift):
    """Radiosity of cells, (p · cells,), times the share of rays that hit them, by replicate or
    start: the last bits of a key beyond `shift`."""
    (chosen, start, key), (_, to_cell, share) = rows, scale
    total = np.empty(product.shape[1], np.float32)
    for row in range(len(chosen)):
        total[:] = 0
        for entry in range(start[row], start[row + 1]):
            total[(key[entry] >> shift) & (len(total) - 1)] += radiosity[key[entry] >> to_cell]
        own, one_ray = product[chosen[row]], share[chosen[row]]
        for column in range(len(total)):  # a sum of slices takes numba two seconds to compile
            own[column] += one_ray * total[column]


@njit(nogil=True, cache=True)
def add_steps(rows, scale, product, radiosity):
    """Three kinds of radiosity of cells, (p · cells, 3): two are summed by replicate, the third
    over all.
    """
    (chosen, start, key), (_, to_cell, share) = rows, scale
    total = np.empty(product.shape[1], np.float32)
    for row in range(len(chosen)):
        total[:] = 0
        for entry in range(start[row], start[row + 1]):
            # What the ray met, and the replicate that it belongs to, by the bits of its key.
            met = radiosity[key[entry] >> to_cell]
            replicate = key[entry] & (HEMISPHERE_REPLICATES - 1)
            total[replicate] += met[0]
            total[replicate + HEMISPHERE_REPLICATES] += met[1]
            total[2 * HEMISPHERE_REPLICATES] += met[2]
        own, one_ray = product[chosen[row]], share[chosen[row]]
        for column in range(len(total)):
            own[column] += one_ray * total[column]


@njit(nogil=True, cache=True)
def add_columns(rows, scale, product, factor, places):
    """Factor (p,) times light of cells in each replicate, (p · cells, 4), times the share of rays
    that hit them.
    """
    (chosen, start, key), (to_patch, to_cell, share) = rows, scale
    for row in range(len(chosen)):
        total = product[chosen[row]]
        for entry in range(start[row], start[row + 1]):
            weight, met = (
                share[chosen[row]] * factor[key[entry] >> to_patch],
                places[key[entry] >> to_cell],
            )
            for column in range(HEMISPHERE_REPLICATES):
                total[column] += weight * np.float32(met[column])


@njit(nogil=True, cache=True)
def add_visible(rows, scale, product, patches, suns):
    """Add to `product` (p, s), for each patch of the rows and each sun, the radiosity of the cells
    that its rays met, times the share of rays that hit them.

    Rays of a patch that hit the same cell are merged. Computing the cosine of incidence from
    normals and suns is no slower than loading it from a matrix. What two places need is computed
    where it is used, which is faster than writing it into arrays of the whole row first.
    """
    (chosen, start, key), (to_patch, to_cell, shares), (albedo, normal, points) = (
        rows,
        scale,
        patches,
    )
    (directions, visible), entries = suns, (start, key)
    # A key of a hit holds the patch and, in its lowest bits, the cell.
    east, north, up = directions[0], directions[1], directions[2]
    bits = to_patch - to_cell
    inside = np.int32((1 << bits) - 1)
    longest = 0
    for row in range(len(start) - 1):
        # Room for the longest row, and for one that is odd.
        longest = max(longest, start[row + 1] - start[row])
    met, weight = np.empty(longest + 3, np.int32), np.empty(longest + 3, np.float32)
    # Two cells at a time: the point that stands for each, and the bit that says for every sun
    # whether it sees it. A cell that does not see the sun adds nothing.
    for row in range(len(chosen)):
        count = _merge_row(row, entries, to_cell, met, weight)
        total, share = product[chosen[row]], shares[chosen[row]]
        for place in range(0, count, 2):
            patch, other_patch = met[place] >> bits, met[place + 1] >> bits
            point = np.int64(points[patch, met[place] & inside])
            other_point = np.int64(points[other_patch, met[place + 1] & inside])
            first, second = visible[patch, point >> 4], visible[other_patch, other_point >> 4]
            a, b = np.uint16(1 << (point & 15)), np.uint16(1 << (other_point & 15))
            own_normal, other_normal = normal[patch], normal[other_patch]
            # part  share of the rays · albedo · normal: times the sun's direction it is the light
            # passed on.
            part, other_part = (
                share * albedo[patch] * weight[place],
                share * albedo[other_patch] * weight[place + 1],
            )
            c, d, e = part * own_normal[0], part * own_normal[1], part * own_normal[2]
            f, g, h = (
                other_part * other_normal[0],
                other_part * other_normal[1],
                other_part * other_normal[2],
            )
            for sun in range(len(total)):
                x, y, z = east[sun], north[sun], up[sun]
                one, other = c * x + d * y + e * z, f * x + g * y + h * z
                total[sun] += (one if first[sun] & a else NONE) + (
                    other if second[sun] & b else NONE
                )
