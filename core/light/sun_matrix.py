"""Matrices of surfaces × suns, in memory if small, else memory-mapped files; and means of patches
over surfaces.
"""

import os
import tempfile
import weakref
from pathlib import Path

import numpy as np
from scipy import sparse

LIMIT = 1 << 28  # bytes: largest matrix kept in memory
ZEROS = 1 << 24  # bytes written at a time where the system cannot preallocate files


def keep_matrix(shape, folder=None):
    """A matrix of zeros that is filled by columns and read by rows.

    A large one is a memory-mapped file, stored sun by sun: columns are written, and rows of
    neighbouring surfaces read, without touching the rest. The file is deleted with the last view of
    it, at the latest at the end of the process.

    Parameters
    ----------
    shape : (int, int)
        Number of surfaces and of suns.
    folder : path-like, optional
        Folder for the file of a large one; by default the system's temporary folder.

    Returns
    -------
    numpy.ndarray or numpy.memmap, float32

    Raises
    ------
    OSError
        The disk is full.
    """
    count = 4 * shape[0] * shape[1]
    if count <= LIMIT:
        return np.zeros(shape, np.float32)
    handle, path = tempfile.mkstemp(prefix=".citypv-", suffix=".matrix", dir=folder)
    try:
        with os.fdopen(handle, "wb") as file:
            # A full disk raises an error now and not a signal later.
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(handle, 0, count)
            else:
                for start in range(0, count, ZEROS):
                    file.write(bytes(min(ZEROS, count - start)))
        matrix = np.memmap(path, np.float32, "r+", shape=shape[::-1])
    except BaseException:
        Path(path).unlink()
        raise
    if os.name == "nt":
        # Windows cannot delete open files
        weakref.finalize(matrix._mmap, Path(path).unlink, missing_ok=True)
    else:
        Path(path).unlink()
    return matrix.T


def is_on_disk(matrix):
    """Whether a matrix is memory-mapped."""
    return isinstance(matrix, np.memmap)


def row_blocks(matrix):
    """A matrix in blocks of rows that fit into memory.

    Yields
    ------
    rows : slice
    values : (n, s) float32
    """
    step = max(1, LIMIT // 16 // max(4 * matrix.shape[1], 1))
    for first in range(0, len(matrix), step):
        rows = slice(first, min(first + step, len(matrix)))
        yield rows, np.ascontiguousarray(matrix[rows])


def keep_columns(matrix, count):
    """The first columns of a matrix of `keep_matrix`, in memory if these are small enough."""
    kept = matrix[:, :count]
    return np.array(kept) if is_on_disk(matrix) and kept.nbytes <= LIMIT else kept


def area_means(triangle_surface, area, count):
    """Matrix that averages patches over their surface: (count, p) sparse float64; 0 for patches
    without area.
    """
    own = np.flatnonzero((triangle_surface >= 0) & (area > 0))
    surface = triangle_surface[own]
    whole = np.bincount(surface, weights=area[own], minlength=count)
    return sparse.csr_matrix((area[own] / whole[surface], (surface, own)), shape=(count, len(area)))


def cover_of_surfaces(patch_to_surface, covered_share, *, cover_steps=512):
    """Covered share of surfaces, to a 512th.

    Parameters
    ----------
    patch_to_surface : (n, p) sparse float64
        Of `area_means`.
    covered_share : (p,) float
        Of patches.

    Returns
    -------
    (n,) float64
    """
    # What lies halfway between two steps is rounded down, whatever the rounding of areas adds to
    # it.
    # `cover_steps`: finer than cover is known: walls that are covered by exactly one half are told
    # from larger ones.
    return np.floor(cover_steps * (patch_to_surface @ covered_share) + 0.5 - 1e-4) / cover_steps
