"""Matrices of surfaces × suns: in memory if small, else memory-mapped files."""

import os
import tempfile
import weakref
from pathlib import Path

import numpy as np

LIMIT = 1 << 28  # bytes: largest matrix kept in memory
ZEROS = 1 << 24  # bytes written at a time where the system cannot preallocate files


def keep_matrix(shape, folder=None):
    """A matrix of zeros that is filled by columns and read by rows.

    A large one is a memory-mapped file, stored sun by sun: columns are written, and rows of neighbouring surfaces read,
    without touching the rest. The file is deleted with the last view of it, at the latest at the end of the process.

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
            reserve_room(file, count)
        matrix = np.memmap(path, np.float32, "r+", shape=shape[::-1])
    except BaseException:
        Path(path).unlink()
        raise
    if os.name == "nt":
        weakref.finalize(matrix._mmap, Path(path).unlink, missing_ok=True)  # Windows cannot delete open files
    else:
        Path(path).unlink()
    return matrix.T


def reserve_room(file, count):
    """Preallocate so many bytes of a file, so that a full disk raises an error now and not a signal later."""
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(file.fileno(), 0, count)
        return
    zeros = bytes(ZEROS)
    for start in range(0, count, ZEROS):
        file.write(zeros[: count - start])


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
