"""Products of the matrix of form factors with light.

Rays of one patch that meet the same place are taken together before they are multiplied; for a single light source that
would cost more than it saves.
"""

import numpy as np
from numba import njit

from .form_factors import REPLICATE_BITS
from .ray_scene import map_in_order
from .sample_points import REPLICATES

NONE = np.float32(0)


def multiply(form_factors, factor, light, threads=1):
    """F · (factor ∘ light), the mean over the replicates.

    Parameters
    ----------
    form_factors : FormFactors
    factor : (p, cells) float32
        From irradiance of a patch to radiosity of its cells.
    light : (p, s) float32
        Irradiance of the patches by s light sources.
    threads : int

    Returns
    -------
    (p, s) float32
    """
    weight, arrived = np.zeros(light.shape[1], np.float32), np.empty(len(light), np.float32)
    return hand_on(form_factors, factor, light, (weight, arrived), threads)


def hand_on(form_factors, factor, light, sums, threads=1, *, out=None, total=None):
    """F · (factor ∘ light) as of `multiply`, with sums taken on the way, while a row still lies near the processor.

    Parameters
    ----------
    sums : tuple of (s,) and (p,) float32
        Weight of each light source; and written, the weighted sum of each row.
    out : (p, s) float32, optional
        Array to write to, other than `light`.
    total : (p, s) float32, optional
        The product is added to it, and is not kept otherwise. It may not be `light`.

    Returns
    -------
    (p, s) float32
        The product; `total` where that is given.
    """
    weight, arrived = sums
    if light.shape[1] == 1:
        product = run_rows(
            form_factors, empty_product(form_factors, 1), threads, add_single, factor.ravel(), light[:, 0]
        )
        np.multiply(product[:, 0], weight[0], out=arrived)
        return product if total is None else np.add(total, product, out=total)
    arrived[:] = 0
    if total is None:
        out = empty_product(form_factors, light.shape[1]) if out is None else out
        return run_rows(form_factors, out, threads, add_patches, (factor.ravel(), light), (weight, arrived, False))
    given = (factor.ravel(), light), (weight, arrived, True)
    return run_rows(form_factors, total, threads, add_patches, *given, fresh=False)


def multiply_cells(form_factors, factor, light, threads=1):
    """F · (factor ∘ light) with light, or its reflection, that differs over the cells of a patch.

    Parameters
    ----------
    factor : (p,) float32
    light : (p, cells) or (p, 1) float32
        Of cells or of whole patches. Factor and light together are the radiosity.

    Returns
    -------
    (p, REPLICATES) float32
        Each replicate by itself.
    """
    product = empty_product(form_factors, REPLICATES)
    return run_rows(form_factors, product, threads, add_cells, factor, light) * np.float32(REPLICATES)


def multiply_starts(form_factors, factor, light, threads=1):
    """F · (factor ∘ light) by the cells that rays start in.

    Parameters
    ----------
    factor, light
        As of `multiply_cells`.

    Returns
    -------
    (p, starts) float32
        The sum is the light of the patch.
    """
    product = empty_product(form_factors, form_factors.starts)
    return run_rows(form_factors, product, threads, add_starts, factor, light)


def multiply_seen(form_factors, albedo, normal, suns, threads=1):
    """F · (albedo ∘ visible share · cos(aoi)), where the visible share of a cell is that of its own point.

    Parameters
    ----------
    albedo : (p,) float32
    normal : (p, 3) float32
    suns : tuple of (s, 3) float32 and (p, s) uint16
        Directions; and bit c is set where the sun is visible from the point of cell c, so none of a sun behind.
    threads : int

    Returns
    -------
    (p, s) float32
    """
    directions, seen = suns
    product = empty_product(form_factors, seen.shape[1])
    suns = np.ascontiguousarray(directions.T), seen
    return run_rows(form_factors, product, threads, add_seen, (albedo, normal), suns)


def empty_product(form_factors, columns):
    """Array for a product, not written to yet: (p, columns) float32."""
    return np.empty((form_factors.count, columns), np.float32)


def run_rows(form_factors, product, threads, loop, *arrays, fresh=True):
    """Products of all rows, written into `product`, (p, columns) float32, and returned; added to it if not fresh."""
    if fresh:
        without = np.ones(len(product), bool)
        for rows in form_factors.rows:
            without[rows.chosen] = False
        product[without] = 0
    share = np.float32(1 / (REPLICATES * form_factors.rays))
    to_cell = np.int32(form_factors.start_bits)  # takes a key to the cell that was met
    to_patch = np.int32(to_cell + form_factors.cells.bit_length() - 1)

    def work(rows):
        loop((rows.chosen, rows.start, rows.key, rows.count), (to_patch, to_cell, share), product, *arrays)

    for _ in map_in_order(work, form_factors.rows, threads):
        pass
    return product


@njit(nogil=True, cache=True)
def merge_row(row, rows, shift, met, weight):
    """Count the rays of one patch that meet the same place, a place being what keys share above their last bits.

    Parameters
    ----------
    row : int
    rows : tuple of (c + 1,) int64, (e,) int32 and (e,) int
        Start, key and count, as of `Rows`.
    shift : int
        Number of last bits.
    met : (m,) int32
        Written: the places, and three times 0 after them, so that they can be taken by fours.
    weight : (m,) float32
        Written: rays that meet each.

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
    """Arrays that hold the merged places of the longest row."""
    longest = 0
    for row in range(len(start) - 1):
        longest = max(longest, start[row + 1] - start[row])
    return np.empty(longest + 3, np.int32), np.empty(longest + 3, np.float32)


@njit(nogil=True, cache=True)
def add_single(rows, scale, product, factor, light):
    """Radiosity of cells, a factor (p · cells,) times light (p,), times the share of rays that meet them."""
    (chosen, start, key, count), (to_patch, to_cell, share) = rows, scale
    for row in range(len(chosen)):
        total = 0.0
        for entry in range(start[row], start[row + 1]):
            total += count[entry] * factor[key[entry] >> to_cell] * light[key[entry] >> to_patch]
        product[chosen[row], 0] = share * total


@njit(nogil=True, cache=True, inline="always")
def radiosity_met(key, scale, factor, light):
    """Radiosity of the place that a key names, a factor (p,) times light (p, cells) or (p, 1)."""
    to_patch, to_cell, share = scale
    patch = key >> to_patch
    cell = 0 if light.shape[1] == 1 else (key >> to_cell) - (patch << (to_patch - to_cell))
    return share * factor[patch] * light[patch, cell]


@njit(nogil=True, cache=True)
def add_starts(rows, scale, product, factor, light):
    """Radiosity of cells times the share of rays that meet them, by the cells where these start."""
    chosen, start, key, count = rows
    for row in range(len(chosen)):
        total = product[chosen[row]]
        total[:] = 0
        for entry in range(start[row], start[row + 1]):
            begun = (key[entry] >> REPLICATE_BITS) & (len(total) - 1)
            total[begun] += np.float32(count[entry]) * radiosity_met(key[entry], scale, factor, light)


@njit(nogil=True, cache=True)
def weigh_row(row, rows, scale, factor, places):
    """As `merge_row` for whole patches, where each ray counts by the factor of the cell that it meets, (p · cells,).

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
    """Radiosity of cells, a factor (p · cells,) times light (p, s), times the share of rays that meet them.

    `sums` is a tuple of (s,) and (p,) float32, as of `hand_on`, and whether to add to the product or to write it.
    """
    (chosen, start, key, count), (weights, arrived, add), (factor, light) = rows, sums, radiosity
    met, weight = room_for_rows(start)
    total = np.empty(light.shape[1], np.float32)
    for row in range(len(chosen)):
        found = weigh_row(row, (start, key, count), scale, factor, (met, weight))
        total[:] = 0
        # Four at a time, so that the sums are not taken to the memory and back for each.
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
def add_cells(rows, scale, product, factor, light):
    """Radiosity of cells times the share of rays that meet them, replicate by replicate."""
    chosen, start, key, count = rows
    for row in range(len(chosen)):
        total = product[chosen[row]]
        total[:] = 0
        for entry in range(start[row], start[row + 1]):
            met = np.float32(count[entry]) * radiosity_met(key[entry], scale, factor, light)
            total[key[entry] & (REPLICATES - 1)] += met


@njit(nogil=True, cache=True)
def add_seen(rows, scale, product, patches, suns):
    """Radiosity of cells under each sun, times the share of rays that meet them.

    To take the cosine of incidence from normals and suns is no slower than to fetch it from a matrix.
    """
    (chosen, start, key, count), (to_patch, to_cell, share), (albedo, normal) = rows, scale, patches
    (directions, seen), entries = suns, (start, key, count)
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
            first, second = seen[met[place]], seen[met[place + 1]]
            a, b = mask[place], mask[place + 1]
            c, d, e = towards[place, 0], towards[place, 1], towards[place, 2]
            f, g, h = towards[place + 1, 0], towards[place + 1, 1], towards[place + 1, 2]
            for sun in range(len(total)):
                x, y, z = east[sun], north[sun], up[sun]
                one, other = c * x + d * y + e * z, f * x + g * y + h * z
                total[sun] += (one if first[sun] & a else NONE) + (other if second[sun] & b else NONE)
