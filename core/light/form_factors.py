"""The matrix F of form factors between patches, stored as the hits of the hemisphere rays.

A hit stores the cell of the patch that was hit, and the start cell and the replicate of its ray. So uneven light on a
patch is re-emitted from the cell where it arrived, incoming light is resolved by cells, and the differences between
replicates can be propagated through the product.
"""

from dataclasses import dataclass, field

import numpy as np
from numba import njit
from scipy import sparse

from ..check_arrays import check_array
from ..errors import InputError
from ..sampling.hemisphere_rays import cell_at
from ..sampling.sample_points import HEMISPHERE_REPLICATES

REPLICATE_BITS = HEMISPHERE_REPLICATES.bit_length() - 1  # the last ones of a key
LARGEST_KEY = 2**31 - 1
FEWEST_RAYS = 4  # mean number per cell needed to resolve its light
MOST_LISTED = 4096  # rays per patch up to which each is an entry of its own; merging equal ones would save little


@dataclass
class Rows:
    """Hits of the rays of c patches."""

    chosen: np.ndarray  # (c,) int, patches
    start: np.ndarray  # (c + 1,) int64, where the entries of each begin
    key: np.ndarray  # (e,) int32, of `make_keys`, ascending within a patch
    count: np.ndarray  # (e,) uint32, rays
    rays: int | None = None  # of each replicate of each patch; None: as many as FormFactors says


@dataclass
class FormFactors:
    """Hits of the rays of p patches; the rays of patches without rows hit nothing."""

    rows: list  # of Rows
    count: int  # p
    cells: int  # of each patch: 1, 4 or 16
    rays: int  # of each replicate, where the rows do not say
    starts: int = 1  # cells by which the starts of rays are resolved: as many as `cells`, or 1
    links: tuple | None = field(default=None, repr=False, compare=False)  # last factor and lists of `links_of`
    sent: np.ndarray | None = field(default=None, repr=False, compare=False)  # (p,) bool, which patches have rows

    def put(self, rows):
        """Add the rows of some patches, in place of those that they had."""
        if self.sent is None:
            self.sent = np.zeros(self.count, bool)
        if self.sent[rows.chosen].any():
            replaced = np.zeros(self.count, bool)
            replaced[rows.chosen] = True
            self.rows = [leave_rows(one, ~replaced[one.chosen]) for one in self.rows]
        self.sent[rows.chosen] = True
        self.rows.append(rows)
        self.links = None

    @property
    def start_bits(self):
        """Number of last bits of a key that hold replicate and start."""
        return REPLICATE_BITS + self.starts.bit_length() - 1

    @property
    def entries(self):
        """Number of entries."""
        return sum(len(rows.key) for rows in self.rows)

    def as_matrix(self):
        """Share of the rays of each replicate that hit each patch: (p · HEMISPHERE_REPLICATES, p) sparse float32."""
        parts = [np.zeros((3, 0))]
        for rows in self.rows:
            patch = np.repeat(rows.chosen, np.diff(rows.start))
            column = rows.key // (self.cells * self.starts * HEMISPHERE_REPLICATES)
            replicate = rows.key % HEMISPHERE_REPLICATES
            parts.append(
                np.stack([patch * HEMISPHERE_REPLICATES + replicate, column, rows.count / (rows.rays or self.rays)])
            )
        row, column, share = np.concatenate(parts, axis=1)
        shape = (self.count * HEMISPHERE_REPLICATES, self.count)
        return sparse.csr_matrix((share.astype(np.float32), (row.astype(int), column.astype(int))), shape=shape)


def leave_rows(rows, kept):
    """Some rows, (c,) bool: Rows."""
    if kept.all():
        return rows
    entries, counts = np.repeat(kept, np.diff(rows.start)), np.diff(rows.start)[kept]
    start = np.concatenate([[0], np.cumsum(counts)])
    return Rows(rows.chosen[kept], start, rows.key[entries], rows.count[entries], rows.rays)


def check_form_factors(form_factors, count):
    """Refuse form factors with indices of patches that do not exist: the compiled loops would read out of bounds.

    Raises
    ------
    InputError
    """
    if form_factors.count != count:
        raise InputError("form_factors", f"{form_factors.count} patches instead of {count}", "give those of this scene")
    last = count * form_factors.cells * form_factors.starts * HEMISPHERE_REPLICATES - 1
    for rows in form_factors.rows:
        entries = (len(rows.key),)
        check_array("key of form_factors", rows.key, entries, kind="i", least=0, most=last, row="entry")
        check_array(
            "count of form_factors",
            rows.count,
            entries,
            kind="i",
            least=1,
            most=rows.rays or form_factors.rays,
            row="entry",
        )


def count_starts(count, cells, samples):
    """Number of cells by which the starts of rays are resolved.

    Returns
    -------
    int
        `cells` if the keys of `count` patches have room for the start cell and enough rays start in each; else 1.
    """
    room = count * cells * cells * HEMISPHERE_REPLICATES - 1 <= LARGEST_KEY
    return cells if room and samples >= FEWEST_RAYS * cells else 1


def count_hits(chosen, hits, places, cells, starts=None):
    """Rows of the matrix from lists of hits.

    Parameters
    ----------
    chosen : (c,) int
    hits : tuple of (c, rays) int32 and (c, rays) bool
        Patch hit by each ray, replicate after replicate, and which hits count.
    places : tuple of two (c · rays,) float32
        Barycentric weights of the hit.
    cells : int
        1, 4 or 16.
    starts : tuple of (c, rays) uint8, (m,) int and int, optional
        The finest cell in which each ray starts, the larger cell that contains each of these, and their number.

    Returns
    -------
    Rows
    """
    rays = hits[0].shape[1]
    starts = (np.zeros(hits[0].shape, np.uint8), np.zeros(1, int), 1) if starts is None else starts
    keys = np.empty(hits[0].shape, np.int32)
    start = np.zeros(len(keys) + 1, np.int64)
    places = tuple(weights.reshape(keys.shape) for weights in places)
    make_keys(hits, (*places, round(np.sqrt(cells))), starts, keys, start)
    keys.sort(axis=1)
    if rays <= MOST_LISTED:
        key = np.empty(start[-1], np.int32)
        list_keys(keys, start, key)
        return Rows(chosen, start, key, np.broadcast_to(np.uint32(1), (start[-1],)))
    key, count = np.empty(start[-1], np.int32), np.empty(start[-1], np.uint32)
    merge_keys(keys, start, key, count)
    return Rows(chosen, start, key[: start[-1]].copy(), count[: start[-1]].copy())


@njit(nogil=True, cache=True)
def make_keys(hits, places, starts, keys, start):
    """Write the keys of hits, -1 for those that do not count, and into `start` where the hits of each patch begin.

    A key is ((patch hit · cells + cell) · starts + start cell of the ray) · HEMISPHERE_REPLICATES + replicate.
    """
    (hit, counts), (b1, b2, divisions), (start_cells, cell_of, start_count) = hits, places, starts
    per_replicate = hit.shape[1] // HEMISPHERE_REPLICATES
    for patch in range(len(hit)):
        found = 0
        for replicate in range(HEMISPHERE_REPLICATES):
            for ray in range(replicate * per_replicate, (replicate + 1) * per_replicate):
                key = -1
                if counts[patch, ray]:
                    cell = cell_at(b1[patch, ray], b2[patch, ray], divisions)
                    place = hit[patch, ray] * divisions**2 + cell
                    key = (place * start_count + cell_of[start_cells[patch, ray]]) * HEMISPHERE_REPLICATES + replicate
                    found += 1
                keys[patch, ray] = key
        start[patch + 1] = start[patch] + found


@njit(nogil=True, cache=True)
def list_keys(keys, start, key):
    """Write the hits of all patches into `key`, patch after patch; they come last in the sorted rows of `keys`."""
    rays = keys.shape[1]
    for patch in range(len(keys)):
        before = rays - (start[patch + 1] - start[patch])
        for entry in range(start[patch], start[patch + 1]):
            key[entry] = keys[patch, before + entry - start[patch]]


@njit(nogil=True, cache=True)
def merge_keys(keys, start, key, count):
    """Write `start`, `key` and `count` from the sorted keys of each patch's hits, merging equal ones."""
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
