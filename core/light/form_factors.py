"""What every patch sees of every other: the matrix F of form factors, kept as the hits of its rays.

A hit remembers the cell of the patch that was met and the replicate of its ray. So light that is uneven over a patch
is handed on from where it lies, and the spread of the replicates can be carried through the product.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy import sparse

from ..errors import InputError
from .check_arrays import check_array
from .hemisphere_rays import cell_at
from .ray_scene import map_in_order
from .sample_points import REPLICATES

REPLICATE_BITS = REPLICATES.bit_length() - 1
NONE = np.float32(0)
MOST_LISTED = 4096  # rays of a patch up to which each is an entry of its own; to merge equal ones would save little


@dataclass
class Rows:
    """Hits of the rays of c patches."""

    chosen: np.ndarray  # (c,) int, the patches
    start: np.ndarray  # (c + 1,) int64, where the entries of each begin
    key: np.ndarray  # (e,) int32, (patch met · cells + cell) · REPLICATES + replicate, ascending within a patch
    count: np.ndarray  # (e,) uint32, rays


@dataclass
class FormFactors:
    """Hits of the rays of p patches; patches without rows meet nothing."""

    rows: list  # of Rows
    count: int  # p
    cells: int  # of each patch: 1, 4 or 16
    rays: int  # of each replicate

    @property
    def entries(self):
        """Number of entries."""
        return sum(len(rows.key) for rows in self.rows)

    def as_matrix(self):
        """Share of the rays of each replicate that meet each patch: (p · REPLICATES, p) sparse float32."""
        parts = [np.zeros((3, 0))]
        for rows in self.rows:
            patch = np.repeat(rows.chosen, np.diff(rows.start))
            column, replicate = rows.key // (self.cells * REPLICATES), rows.key % REPLICATES
            parts.append(np.stack([patch * REPLICATES + replicate, column, rows.count / self.rays]))
        row, column, share = np.concatenate(parts, axis=1)
        shape = (self.count * REPLICATES, self.count)
        return sparse.csr_matrix((share.astype(np.float32), (row.astype(int), column.astype(int))), shape=shape)


def check_form_factors(form_factors, count):
    """Refuse form factors that name patches which do not exist: the compiled loops would read beyond the arrays.

    Raises
    ------
    InputError
    """
    if form_factors.count != count:
        raise InputError("form_factors", f"of {form_factors.count} patches", f"give those of {count}")
    last = count * form_factors.cells * REPLICATES - 1
    for rows in form_factors.rows:
        entries = (len(rows.key),)
        check_array("key of form_factors", rows.key, entries, kind="i", least=0, most=last, row="entry")
        check_array(
            "count of form_factors", rows.count, entries, kind="i", least=1, most=form_factors.rays, row="entry"
        )


def count_hits(chosen, hit, b1, b2, cells):
    """Rows of the matrix from lists of hits.

    Parameters
    ----------
    chosen : (c,) int
    hit : (c, rays) int32
        Patch met by each ray, replicate after replicate; -1 for none.
    b1, b2 : (c, rays) float32
        Where on it.
    cells : int
        1, 4 or 16.

    Returns
    -------
    Rows
    """
    keys = np.empty(hit.shape, np.int32)
    make_keys((hit, b1.reshape(hit.shape), b2.reshape(hit.shape)), round(np.sqrt(cells)), keys)
    keys.sort(axis=1)
    start = np.zeros(len(hit) + 1, np.int64)
    if hit.shape[1] <= MOST_LISTED:
        np.cumsum((keys >= 0).sum(axis=1), out=start[1:])
        return Rows(chosen, start, keys[keys >= 0], np.broadcast_to(np.uint32(1), (start[-1],)))
    key, count = np.empty(hit.size, np.int32), np.empty(hit.size, np.uint32)
    merge_keys(keys, start, key, count)
    return Rows(chosen, start, key[: start[-1]].copy(), count[: start[-1]].copy())


@njit(nogil=True, cache=True)
def make_keys(places, divisions, keys):
    """Write the keys of hits, -1 where nothing is met."""
    hit, b1, b2 = places
    rays = hit.shape[1]
    per_replicate = rays // REPLICATES
    for patch in range(len(hit)):
        for ray in range(rays):
            met = hit[patch, ray]
            if met >= 0:
                cell = cell_at(b1[patch, ray], b2[patch, ray], divisions)
                met = (met * divisions**2 + cell) * REPLICATES + ray // per_replicate
            keys[patch, ray] = met


@njit(nogil=True, cache=True)
def merge_keys(keys, start, key, count):
    """Write the last three from the sorted keys of each patch's hits, equal ones counted together."""
    entry = 0
    for patch in range(len(keys)):
        previous = -1
        for found in keys[patch]:
            if found < 0:
                continue
            if found == previous:
                count[entry - 1] += 1
            else:
                key[entry], count[entry] = found, 1
                entry += 1
                previous = found
        start[patch + 1] = entry


def multiply(form_factors, factor, light, threads=1):
    """F · (factor ∘ light), the mean over the replicates.

    Parameters
    ----------
    form_factors : FormFactors
    factor : (p,) float32
        From irradiance to radiosity.
    light : (p, s) float32
        Irradiance of the patches by s light sources.
    threads : int

    Returns
    -------
    (p, s) float32
    """
    return run_rows(form_factors, light.shape[1], threads, add_patches, factor, light)


def multiply_cells(form_factors, light, threads=1):
    """F · light with light that differs over the cells of a patch.

    Parameters
    ----------
    light : (p, cells) float32
        Radiosity.

    Returns
    -------
    (p, REPLICATES) float32
        Each replicate by itself.
    """
    return run_rows(form_factors, REPLICATES, threads, add_cells, light) * np.float32(REPLICATES)


def multiply_seen(form_factors, albedo, aoi_projection, seen, threads=1):
    """F · (albedo ∘ visible share · cos(aoi)), where the visible share of a cell is that of its own point.

    Parameters
    ----------
    albedo : (p,) float32
    aoi_projection : (p, s) float32
        Cosine of the angle of incidence, 0 for suns behind.
    seen : (p, s) uint16
        Bit c is set where the sun is visible from the point of cell c.

    Returns
    -------
    (p, s) float32
    """
    return run_rows(form_factors, seen.shape[1], threads, add_seen, albedo, (aoi_projection, seen))


def run_rows(form_factors, columns, threads, loop, *arrays):
    """Products of all rows, in float32: (p, columns)."""
    product = np.zeros((form_factors.count, columns), np.float32)
    share = np.float32(1 / (REPLICATES * form_factors.rays))
    shift = np.int32(REPLICATE_BITS + form_factors.cells.bit_length() - 1)  # takes a key to its patch

    def work(rows):
        loop((rows.chosen, rows.start, rows.key, rows.count), (shift, share), product, *arrays)

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
def add_patches(rows, scale, product, factor, light):
    """Radiosity of whole patches, factor (p,) times light (p, s), times the share of rays that meet them."""
    (chosen, start, key, count), (shift, share) = rows, scale
    entries = start, key, count
    met, weight = room_for_rows(start)
    for row in range(len(chosen)):
        found = merge_row(row, entries, shift, met, weight)
        for place in range(found):
            weight[place] *= share * factor[met[place]]
        # Four at a time, so that the sums are not taken to the memory and back for each.
        total = product[chosen[row]]
        for four in range(0, found, 4):
            first, second, third, fourth = met[four], met[four + 1], met[four + 2], met[four + 3]
            a, b, c, d = weight[four], weight[four + 1], weight[four + 2], weight[four + 3]
            for column in range(len(total)):
                pair = a * light[first, column] + b * light[second, column]
                total[column] += pair + (c * light[third, column] + d * light[fourth, column])


@njit(nogil=True, cache=True)
def add_cells(rows, scale, product, light):
    """Radiosity of cells, (p, cells), times the share of rays that meet them, replicate by replicate."""
    (chosen, start, key, count), (shift, share) = rows, scale
    for row in range(len(chosen)):
        total = product[chosen[row]]
        for entry in range(start[row], start[row + 1]):
            place = key[entry] >> REPLICATE_BITS
            patch = key[entry] >> shift
            cell = place - (patch << (shift - REPLICATE_BITS))
            total[key[entry] & (REPLICATES - 1)] += np.float32(count[entry]) * share * light[patch, cell]


@njit(nogil=True, cache=True)
def add_seen(rows, scale, product, albedo, suns):
    """Radiosity of cells under each sun, times the share of rays that meet them."""
    (chosen, start, key, count), (shift, share), (aoi_projection, seen) = rows, scale, suns
    entries = start, key, count
    bits = shift - REPLICATE_BITS
    met, weight = room_for_rows(start)
    mask = np.empty(len(met), np.uint16)
    for row in range(len(chosen)):
        found = merge_row(row, entries, REPLICATE_BITS, met, weight)
        for place in range(found + 3):
            mask[place] = 1 << (met[place] & ((1 << bits) - 1))
            met[place] >>= bits
            weight[place] *= share * albedo[met[place]]
        total = product[chosen[row]]
        for four in range(0, found, 4):
            first, second, third, fourth = met[four], met[four + 1], met[four + 2], met[four + 3]
            a, b, c, d = weight[four], weight[four + 1], weight[four + 2], weight[four + 3]
            e, f, g, h = mask[four], mask[four + 1], mask[four + 2], mask[four + 3]
            for column in range(len(total)):
                pair = aoi_projection[first, column] * (a if seen[first, column] & e else NONE)
                pair += aoi_projection[second, column] * (b if seen[second, column] & f else NONE)
                other = aoi_projection[third, column] * (c if seen[third, column] & g else NONE)
                other += aoi_projection[fourth, column] * (d if seen[fourth, column] & h else NONE)
                total[column] += pair + other
