"""Cover cells: what the cells of a patch tell on each other, in the midst of their like or between
some that agree.
"""

import functools

import numpy as np
from scipy import sparse

from ..rays.hemisphere_rays import CELL_DIVISIONS
from ..rays.sample_points import Cells

UNKNOWN, FACING, OPEN, TOUCHING, COVERED = np.int8(range(5))  # what a ray from a cell tells on it


@functools.cache
def _cell_contacts(divisions):
    """Which cells share an edge or a vertex: (cells, cells) bool."""
    corners = np.rint(Cells(divisions).corners() * divisions).astype(int)
    names = corners[..., 0] * (divisions + 1) + corners[..., 1]
    return (names[:, None, :, None] == names[None, :, None, :]).any(axis=(2, 3))


def settled_cells(states):
    """The verdicts on cells that all their neighbours share; UNKNOWN for the others.

    Along the edge of the covered part a single ray says little, and where none around reaches the
    sky, fronts may belong to something inside.

    Parameters
    ----------
    states : (c, cells) int8
        Of `first_states`.

    Returns
    -------
    (c, cells) int8
        OPEN, COVERED or UNKNOWN.
    """
    # A verdict needs the cell and all its neighbours: open where they meet sky or fronts and one of
    # them the sky, covered where all meet backs.
    settled = np.full_like(states, UNKNOWN)
    beside_sky = ~enclosed_cells(states != OPEN)
    settled[enclosed_cells((states == OPEN) | (states == FACING)) & beside_sky] = OPEN
    settled[enclosed_cells(states == COVERED)] = COVERED
    return settled


def enclosed_cells(covered):
    """Covered cells whose neighbours are all covered.

    Parameters
    ----------
    covered : (c, cells) bool

    Returns
    -------
    (c, cells) bool
    """
    # Sparse, since a product of full matrices would start BLAS threads that compete with the
    # tracer's.
    contacts = sparse.csr_matrix(_cell_contacts(round(np.sqrt(covered.shape[1]))))
    return covered & ~(contacts @ ~covered.T).T


def pack_cells(cells):
    """Cells as bits of one number: (...) uint64 from (..., CELL_DIVISIONS²) bool."""
    return np.packbits(cells, axis=-1, bitorder="little").view("<u8")[..., 0]


def unpack_cells(bits):
    """Cells from such numbers: (..., CELL_DIVISIONS²) bool."""
    octets = np.ascontiguousarray(bits, "<u8")[..., None].view(np.uint8)
    return np.unpackbits(octets, axis=-1, bitorder="little").astype(bool)


def _leading_cells():
    """Cells that lead, (m,) int, and which of them touch each, itself alone if it leads: (m, cells)
    int8.

    All that share an edge with the patch, since what is covered ends along an edge, and a third of
    the other upright ones: each cell touches two or more.
    """
    row, place = Cells(CELL_DIVISIONS).places()
    upright, last = place % 2 == 0, 2 * (CELL_DIVISIONS - 1 - row)
    edge = (row == 0) | (place == 0) | (place == last)
    leading = np.flatnonzero(upright & (edge | ((row + place) % 3 == 0)))
    touch = _cell_contacts(CELL_DIVISIONS)[leading].astype(np.int8)
    touch[:, leading] = np.eye(len(leading), dtype=np.int8)
    return leading, touch


LEADING, TOUCH = _leading_cells()


def share_verdicts(verdict, states):
    """The verdicts on cells between leading ones that agree; UNKNOWN where these differ or a first
    ray denies it.

    Parameters
    ----------
    verdict : (c, cells) int8
        OPEN, COVERED or UNKNOWN; known of all leading cells.
    states : (c, cells) int8
        Of `first_states`.

    Returns
    -------
    (c, cells) int8
    """
    # Of the leading cells that touch each cell: how many are covered, and whether all or none are.
    leading, touching = (verdict[:, LEADING] == COVERED).astype(np.int8), TOUCH.sum(axis=0)
    covered = leading @ TOUCH  # whole numbers, for which no BLAS threads start
    agreed = np.select([covered == touching, covered == 0], [COVERED, OPEN], UNKNOWN)
    # An agreed verdict counts unless the cell's own ray or a neighbour's speaks against it.
    fitting = np.where(
        agreed == COVERED, enclosed_cells(states != OPEN), enclosed_cells(states < TOUCHING)
    )
    return np.where((verdict == UNKNOWN) & fitting, agreed, verdict)
