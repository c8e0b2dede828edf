"""A raster of heights: where its cells lie, and their values, averaged where fewer are wanted."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

PIECE = 2**24  # cells that are unpacked at a time


@dataclass
class Raster:
    """An open raster, read window by window."""

    path: object
    width: int  # columns
    height: int  # rows
    matrix: np.ndarray  # (2, 3) float64, from (column, row, 1) of corners of cells to the raster's system
    crs: str | None  # WKT
    unit: str  # of the heights, "" if not told
    block_bytes: int  # of the largest piece that is unpacked at once
    block_rows: int  # rows that are stored together
    read_cells: Callable  # (first row, last row, first column, last column) -> (r, c) float64, NaN in gaps


def average_window(raster, window, shape):
    """Heights of a window: means over its cells, weighted by the shared area, gaps left out.

    Parameters
    ----------
    raster : Raster
    window : (column, row, width, height)
    shape : (int, int)
        Rows and columns wanted, at most those of the window; if equal, the cells themselves.

    Returns
    -------
    (rows, columns) float64
        As stored; NaN where all cells are gaps.
    """
    column, row, width, height = (int(value) for value in window)
    if shape == (height, width):
        return raster.read_cells(row, row + height, column, column + width)
    across, down = share_cells(width, shape[1]), share_cells(height, shape[0]).tocsc()
    total, weight = np.zeros(shape), np.zeros(shape)
    step = max(raster.block_rows, PIECE // width // raster.block_rows * raster.block_rows)
    first = row
    while first < row + height:
        last = min(first // step * step + step, row + height)
        cells = raster.read_cells(first, last, column, column + width)
        known = np.isfinite(cells)
        rows = down[:, first - row : last - row]
        total += rows @ (across @ np.where(known, cells, 0.0).T).T
        weight += rows @ (across @ known.astype(float).T).T
        first = last
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(weight > 0, total / weight, np.nan)


def share_cells(count, wanted):
    """Overlap of so many cells with so many equal intervals over all of them: (wanted, count) sparse array."""
    edges = np.arange(wanted + 1) * (count / wanted)
    first = np.floor(edges[:-1]).astype(int)
    reach = int(np.ceil(count / wanted)) + 1
    cells = first[:, None] + np.arange(reach)  # (wanted, reach) those that an interval can touch
    overlap = np.minimum(edges[1:, None], cells + 1) - np.maximum(edges[:-1, None], cells)
    touched = (overlap > 1e-9) & (cells < count)
    interval = np.broadcast_to(np.arange(wanted)[:, None], cells.shape)
    return sparse.csr_array((overlap[touched], (interval[touched], cells[touched])), shape=(wanted, count))
