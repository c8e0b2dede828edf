"""A raster of heights: where its cells lie, and their values, averaged where fewer are wanted."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..city.transform_crs import plane_of

LOWEST, HIGHEST = -500.0, 12_000.0  # [m] all land lies between; values beyond mark gaps, or the floor of the sea
WORDS = {  # in which rasters name the unit of their heights [m]
    0.3048: ("ft", "foot", "feet", "international foot"),
    1200 / 3937: ("us survey foot", "us survey feet", "us-ft", "ftus", "foot_us"),
    0.001: ("mm", "millimetre", "millimetres", "millimeter", "millimeters"),
    0.01: ("cm", "centimetre", "centimetres", "centimeter", "centimeters"),
    0.1: ("dm", "decimetre", "decimetres", "decimeter", "decimeters"),
    1.0: ("m", "metre", "metres", "meter", "meters"),
    1000.0: ("km", "kilometre", "kilometres", "kilometer", "kilometers"),
}
UNIT_WORDS = {word: factor for factor, words in WORDS.items() for word in words}
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


def window_between(raster, corners):
    """First column, first row, columns and rows of the raster inside a rectangle of its system, or None."""
    (west, south), (east, north) = corners
    corners = np.array([(west, south), (west, north), (east, south), (east, north)])
    places = np.linalg.solve(raster.matrix[:, :2], corners.T - raster.matrix[:, 2:]).T
    first = np.maximum(np.floor(places.min(axis=0)).astype(np.int64) - 1, 0)
    last = np.minimum(np.ceil(places.max(axis=0)).astype(np.int64) + 1, (raster.width, raster.height))
    return (*first, *(last - first)) if (last - first > 1).all() else None


def height_factor(raster, unit=1.0):
    """Metres per unit of the heights: as given by the band, else by the coordinate reference system."""
    word = raster.unit.strip().lower()
    if word in UNIT_WORDS:
        return UNIT_WORDS[word]
    return unit if raster.crs is None else plane_of(raster.crs)[1]
