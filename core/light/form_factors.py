"""The matrix F of form factors as hits: which elements of patches the rays of each patch meet.

The light of a patch is resolved by 1, 4 or 16 elements, congruent parts of its triangle. F is
stored as the hits: each with the element of the patch that was hit, and the element and the
replicate of its ray's start. So uneven light on a patch is re-emitted from the element where it
arrived, and differences between replicates can be followed through F.
"""

from dataclasses import dataclass, field

import numpy as np
from numba import njit
from scipy import sparse

from ..rays.hemisphere_rays import cell_at
from ..rays.sample_points import HEMISPHERE_REPLICATES

REPLICATE_BITS = HEMISPHERE_REPLICATES.bit_length() - 1  # the last ones of a key
LARGEST_KEY = 2**31 - 1
FEWEST_RAYS = 4  # mean number per cell needed to resolve its light


@dataclass
class Rows:
    """Hits of the rays of c patches."""

    chosen: np.ndarray  # (c,) int, patches
    start: np.ndarray  # (c + 1,) int64, where the entries of each begin
    key: np.ndarray  # (e,) int32, of `_make_keys`, ascending within a patch
    rays: int  # of each replicate of each patch


@dataclass
class FormFactors:
    """Hits of the rays of p patches; the rays of patches without rows hit nothing."""

    rounds: (
        list  # of lists of Rows: in each a patch has at most one row; its rays in all of them count
    )
    count: int  # p
    elements: int  # of each patch: 1, 4 or 16
    rays: np.ndarray  # (p,) int32, of each replicate of each patch
    # elements by which the starts of rays are resolved: as many as `elements`, or 1
    start_elements: int = 1
    # last factor, and its links of `multiply`
    links: tuple | None = field(default=None, repr=False, compare=False)

    def put(self, rows):
        """Add the rows of some patches that have none in the last round."""
        self.rounds[-1].append(rows)
        self.rays[rows.chosen] += rows.rays
        self.links = None

    @property
    def rows(self):
        """Rows of all rounds: list."""
        return [rows for some in self.rounds for rows in some]

    @property
    def share(self):
        """Share of each ray in all of its patch: (p,) float32."""
        return (1 / np.maximum(HEMISPHERE_REPLICATES * self.rays, 1)).astype(np.float32)

    @property
    def start_bits(self):
        """Number of last bits of a key that hold replicate and start."""
        return REPLICATE_BITS + self.start_elements.bit_length() - 1

    def as_matrix(self):
        """Share of the rays of each replicate that hit each patch: (p · HEMISPHERE_REPLICATES, p)
        sparse float32.
        """
        patches = [np.repeat(rows.chosen, np.diff(rows.start)) for rows in self.rows]
        patch, key = (
            np.concatenate([np.zeros(0, int), *some])
            for some in (patches, [rows.key for rows in self.rows])
        )
        column, replicate = np.divmod(key, HEMISPHERE_REPLICATES)
        place = (
            patch * HEMISPHERE_REPLICATES + replicate,
            column // (self.elements * self.start_elements),
        )
        shape = (self.count * HEMISPHERE_REPLICATES, self.count)
        return sparse.csr_matrix((HEMISPHERE_REPLICATES * self.share[patch], place), shape=shape)


def leave_rows(rows, kept):
    """Some rows, (c,) bool: Rows."""
    if kept.all():
        return rows
    entries, counts = np.repeat(kept, np.diff(rows.start)), np.diff(rows.start)[kept]
    start = np.concatenate([[0], np.cumsum(counts)])
    return Rows(rows.chosen[kept], start, rows.key[entries], rows.rays)


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
        The finest cell in which each ray starts, the larger cell that contains each of these, and
        their number.

    Returns
    -------
    Rows
    """
    rays = hits[0].shape[1]
    starts = (np.zeros(hits[0].shape, np.uint8), np.zeros(1, int), 1) if starts is None else starts
    keys = np.empty(hits[0].shape, np.int32)
    start = np.zeros(len(keys) + 1, np.int64)
    places = tuple(weights.reshape(keys.shape) for weights in places)
    _make_keys(hits, (*places, round(np.sqrt(cells))), starts, keys, start)
    keys.sort(axis=1)
    return Rows(chosen, start, keys[keys >= 0], rays // HEMISPHERE_REPLICATES)


@njit(nogil=True, cache=True)
def _make_keys(hits, places, starts, keys, start):
    """Write the keys of hits, -1 for those that do not count, and into `start` where the hits of
    each patch begin.

    A key is ((patch hit · cells + cell) · starts + start cell of the ray) · HEMISPHERE_REPLICATES +
    replicate.
    """
    (hit, counts), (b1, b2, divisions), (start_cells, cell_of, start_count) = hits, places, starts
    per_replicate = hit.shape[1] // HEMISPHERE_REPLICATES
    for patch in range(len(hit)):
        count = 0
        for replicate in range(HEMISPHERE_REPLICATES):
            for ray in range(replicate * per_replicate, (replicate + 1) * per_replicate):
                key = -1
                if counts[patch, ray]:
                    cell = cell_at(b1[patch, ray], b2[patch, ray], divisions)
                    place = hit[patch, ray] * divisions**2 + cell
                    key = (
                        place * start_count + cell_of[start_cells[patch, ray]]
                    ) * HEMISPHERE_REPLICATES + replicate
                    count += 1
                keys[patch, ray] = key
        start[patch + 1] = start[patch] + count
