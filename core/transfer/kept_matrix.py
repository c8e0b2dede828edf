"""Matrices of surfaces × suns: in memory while they are small, on disk where they are not."""

import tempfile
import threading
import weakref

import numpy as np

LIMIT = 1 << 28  # bytes of one matrix that are kept in memory


def keep_matrix(shape, folder=None):
    """A matrix of zeros to be filled by columns and read by rows.

    Parameters
    ----------
    shape : (int, int)
        Surfaces and suns.
    folder : path-like, optional
        Where a large one lies; the system's place for temporary files if not given.

    Returns
    -------
    numpy.ndarray or MatrixOnDisk, float32
    """
    if 4 * shape[0] * shape[1] <= LIMIT:
        return np.zeros(shape, np.float32)
    return MatrixOnDisk(shape, folder)


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
        yield rows, matrix[rows]


def keep_columns(matrix, count):
    """The first columns of a matrix of `keep_matrix`, in memory where these alone have room."""
    if isinstance(matrix, np.ndarray):
        return matrix[:, :count]
    matrix.cut(count)
    return matrix[:] if 4 * matrix.shape[0] * count <= LIMIT else matrix


class MatrixOnDisk:
    """A float32 matrix in a file that goes with it.

    Columns are written in blocks, `matrix[:, block] = values`, each once and in their order; rows are read, in any
    order, once all columns are there. The file has no name: nobody can take it for a result, and it is gone with the
    process.

    Parameters
    ----------
    shape : (int, int)
    folder : path-like, optional

    Raises
    ------
    OSError
        If the disk is full.
    """

    dtype = np.dtype(np.float32)
    ndim = 2

    def __init__(self, shape, folder=None):
        self.shape = shape
        self._file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115, it lives as long as the matrix
        weakref.finalize(self, self._file.close)
        self._reading = threading.Lock()
        self._blocks = []  # slices of columns, in the order of the file

    def __len__(self):
        return self.shape[0]

    @property
    def columns_written(self):
        """Number of columns that are there."""
        return self._blocks[-1].stop if self._blocks else 0

    def cut(self, count):
        """Forget the columns from `count` on, where a block begins or nothing was written yet."""
        if count not in (0, *(block.stop for block in self._blocks)):
            raise IndexError(f"no block ends at column {count}")
        self.shape = (self.shape[0], count)
        self._blocks = [block for block in self._blocks if block.stop <= count]

    def __setitem__(self, place, values):
        rows, block = place
        if rows != slice(None) or block.start != self.columns_written:
            raise IndexError(f"give whole columns from {self.columns_written} on, not {place}")
        self._file.seek(0, 2)
        self._file.write(np.ascontiguousarray(values, np.float32).data)
        self._blocks.append(slice(block.start, block.start + values.shape[1]))

    def __getitem__(self, rows):
        """Some rows, given as an ascending array of int or as a slice: (n, s) float32."""
        if isinstance(rows, slice):
            rows = np.arange(self.shape[0])[rows]
        found = np.zeros((len(rows), self.shape[1]), np.float32)
        if not len(rows):
            return found
        first, last = int(rows.min()), int(rows.max()) + 1
        for block in self._blocks:
            width = block.stop - block.start
            start = 4 * (self.shape[0] * block.start + first * width)
            found[:, block] = self._read(start, (last - first) * width).reshape(-1, width)[rows - first]
        return found

    def _read(self, start, count):
        """Floats from a place in the file: (count,) float32."""
        values = np.empty(count, np.float32)
        with self._reading:
            self._file.seek(start)
            if self._file.readinto(values) != values.nbytes:
                raise OSError("what was traced is no longer on the disk")
        return values

    def __array__(self, dtype=None, copy=None):
        return self[:].astype(dtype or np.float32)
