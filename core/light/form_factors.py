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
from .sample_points import REPLICATES

REPLICATE_BITS = REPLICATES.bit_length() - 1  # the last ones of a key
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
