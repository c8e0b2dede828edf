"""Matrices of surfaces × suns: in memory while they are small, memory-mapped files where they are not."""

import os
import tempfile
import weakref
from pathlib import Path

import numpy as np

LIMIT = 1 << 28  # bytes of one matrix that are kept in memory
ZEROS = 1 << 24  # bytes written at a time where the system cannot reserve room


def keep_matrix(shape, folder=None):
    """A matrix of zeros to be filled by columns and read by rows.

    A large one is a memory-mapped file, which lies sun by sun: columns are written, and rows of neighbouring surfaces
    read, without touching the rest. The file goes when the last view of it does, at the latest with the process.

    Parameters
    ----------
    shape : (int, int)
        Surfaces and suns.
    folder : path-like, optional
        Where a large one lies; the system's place for temporary files if not given.

    Returns
    -------
    numpy.ndarray or numpy.memmap, float32

    Raises
    ------
    OSError
        The disk has no room for it.
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
        weakref.finalize(matrix._mmap, Path(path).unlink, missing_ok=True)  # Windows keeps the names of open files
    else:
        Path(path).unlink()
    return matrix.T


def reserve_room(file, count):
    """Fill a file with so many bytes of zeros, so that a full disk is an error now and no signal later."""
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(file.fileno(), 0, count)
        return
    zeros = bytes(ZEROS)
    for start in range(0, count, ZEROS):
        file.write(zeros[: count - start])


def is_on_disk(matrix):
    """Whether a matrix is too large for the memory."""
    return isinstance(matrix, np.memmap)


def row_blocks(matrix):
    """A matrix in blocks of rows that fit into the memory.

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
    """The first columns of a matrix of `keep_matrix`, in memory where these alone have room."""
    kept = matrix[:, :count]
    return np.array(kept) if is_on_disk(matrix) and kept.nbytes <= LIMIT else kept
