"""The matrix F of form factors as hits: which elements of patches the rays of each patch meet.

The light of a patch is resolved by 1, 4 or 16 elements, congruent parts of its triangle. F is stored as the hits: each
with the element of the patch that was hit, and the element and the replicate of its ray's start. So uneven light on a
patch is re-emitted from the element where it arrived, and differences between replicates can be followed through F.
"""

from dataclasses import dataclass, field

import numpy as np
from numba import njit
from scipy import sparse

from ..rays.hemisphere_rays import cell_at
from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..settings.errors import InputError, check_array

REPLICATE_BITS = HEMISPHERE_REPLICATES.bit_length() - 1  # the last ones of a key
LARGEST_KEY = 2**31 - 1
ENTRIES = 1 << 19  # of a part of `join_rows`
FEWEST_RAYS = 4  # mean number per cell needed to resolve its light


@dataclass
class Rows:
    """Hits of the rays of c patches."""

    chosen: np.ndarray  # (c,) int, patches
    start: np.ndarray  # (c + 1,) int64, where the entries of each begin
    key: np.ndarray  # (e,) int32, of `make_keys`, ascending within a patch
    rays: int  # of each replicate of each patch


@dataclass
class FormFactors:
    """Hits of the rays of p patches; the rays of patches without rows hit nothing."""

    rows: list  # of Rows
    count: int  # p
    cells: int  # of each patch: 1, 4 or 16
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

    def append(self, rows):
        """Add the hits of further rays of some patches that have rows."""
        replaced = np.zeros(self.count, bool)
        replaced[rows.chosen] = True
        for one in self.rows:
            taken = replaced[one.chosen]
            if taken.any():
                known = leave_rows(one, taken)
                place = np.searchsorted(rows.chosen, known.chosen)
                self.put(merge_rows(known, rows, place))

    @property
    def start_bits(self):
        """Number of last bits of a key that hold replicate and start."""
        return REPLICATE_BITS + self.starts.bit_length() - 1

    def as_matrix(self):
        """Share of the rays of each replicate that hit each patch: (p · HEMISPHERE_REPLICATES, p) sparse float32."""
        parts = [np.zeros((3, 0))]
        for rows in self.rows:
            patch = np.repeat(rows.chosen, np.diff(rows.start))
            column, replicate = np.divmod(rows.key, HEMISPHERE_REPLICATES)
            place = patch * HEMISPHERE_REPLICATES + replicate
            parts.append(np.stack([place, column // (self.cells * self.starts), np.full(len(patch), 1 / rows.rays)]))
        row, column, share = np.concatenate(parts, axis=1)
        shape = (self.count * HEMISPHERE_REPLICATES, self.count)
        return sparse.csr_matrix((share.astype(np.float32), (row.astype(int), column.astype(int))), shape=shape)


def leave_rows(rows, kept):
    """Some rows, (c,) bool: Rows."""
    if kept.all():
        return rows
    entries, counts = np.repeat(kept, np.diff(rows.start)), np.diff(rows.start)[kept]
    start = np.concatenate([[0], np.cumsum(counts)])
    return Rows(rows.chosen[kept], start, rows.key[entries], rows.rays)


def merge_rows(one, other, place):
    """Hits of both, of the patches of the first, whose rows in the other are `place`, (c,) int: Rows."""
    counts = np.diff(one.start) + np.diff(other.start)[place]
    start = np.concatenate([[0], np.cumsum(counts)])
    key = np.empty(start[-1], np.int32)
    merge_keys((one.start, one.key), (other.start, other.key), place, start, key)
    return Rows(one.chosen, start, key, one.rays + other.rays)


@njit(nogil=True, cache=True)
def merge_keys(one, other, place, start, key):
    """Write the keys of two rows each, both ascending, into one that is."""
    (first, mine), (second, theirs) = one, other
    for row in range(len(place)):
        a, b = first[row], second[place[row]]
        end_a, end_b = first[row + 1], second[place[row] + 1]
        for entry in range(start[row], start[row + 1]):
            if b == end_b or (a < end_a and mine[a] <= theirs[b]):
                key[entry] = mine[a]
                a += 1
            else:
                key[entry] = theirs[b]
                b += 1


def join_rows(parts):
    """Rows with the same number of rays in few large parts, as loops over each begin anew: list of Rows."""
    found, some, entries = [], [], 0
    for place, part in enumerate(parts):
        some.append(part)
        entries += len(part.key)
        if entries >= ENTRIES or place == len(parts) - 1:
            starts = np.cumsum([0, *(rows.start[-1] for rows in some)])
            start = np.concatenate([[0], *(rows.start[1:] + first for rows, first in zip(some, starts, strict=False))])
            chosen, key = (np.concatenate([getattr(rows, name) for rows in some]) for name in ("chosen", "key"))
            found.append(Rows(chosen, start, key, part.rays))
            some, entries = [], 0
    return found


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
        check_array("key of form_factors", rows.key, (len(rows.key),), kind="i", least=0, most=last, row="entry")


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
    return Rows(chosen, start, keys[keys >= 0], rays // HEMISPHERE_REPLICATES)


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
