"""Read an ASC grid (Esri ASCII grid)."""

import re
import warnings
from pathlib import Path

import numpy as np
import pyproj

from .open_input import open_text
from .raster import Raster

HEAD = re.compile(r"\s*([a-z_]+)\s+(\S+)", re.IGNORECASE)
MARKS = ("ncols", "nrows", "xllcorner", "xllcenter", "yllcorner", "yllcenter", "cellsize", "dx", "dy", "nodata_value")


def read_ascii_grid(path):
    """Read an ASC grid; its reference system is that of the `.prj` beside it.

    Returns
    -------
    Raster

    Raises
    ------
    ValueError, KeyError
        Not a grid, or a damaged one.
    """
    with open_text(path) as stream:
        head, first = read_head(stream)
        columns, rows = int(head["ncols"]), int(head["nrows"])
        if columns < 1 or rows < 1:
            raise ValueError(f"its header announces {columns} x {rows} heights")
        body = first + stream.read()
    if 2 * columns * rows > len(body) + 1:
        raise ValueError(f"its header announces {columns:,} x {rows:,} heights, but the file is too short")
    numbers = read_numbers(body)
    if len(numbers) != columns * rows:
        raise ValueError(f"has {len(numbers):,} heights, but its header announces {columns:,} x {rows:,}")
    heights = numbers.reshape(rows, columns)
    gap = float(head.get("nodata_value", "nan"))
    heights[heights == gap] = np.nan

    def read_cells(top, bottom, left, right):
        return heights[top:bottom, left:right].copy()

    return Raster(path, columns, rows, matrix_of_head(head, rows), read_system(Path(path)), "", 0, 1, read_cells)


def read_numbers(text):
    """Numbers between white space: (n,) float64."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            return np.fromstring(text, dtype=float, sep=" ")
        except DeprecationWarning as error:
            raise ValueError("holds something that is no number") from error


def read_head(stream):
    """Header as a dict of lower-case words, and the line behind it."""
    head = {}
    while True:
        line = stream.readline(1000)
        match = HEAD.match(line)
        if match is None or match[1].lower() not in MARKS:
            return head, line
        head[match[1].lower()] = match[2]


def matrix_of_head(head, rows):
    """Transformation from (column, row, 1) of cell corners: (2, 3) float64."""
    wide, high = (float(head[name] if name in head else head["cellsize"]) for name in ("dx", "dy"))
    west = float(head["xllcorner"]) if "xllcorner" in head else float(head["xllcenter"]) - wide / 2
    south = float(head["yllcorner"]) if "yllcorner" in head else float(head["yllcenter"]) - high / 2
    if not (wide > 0 and high > 0 and np.isfinite([wide, high, west, south]).all()):
        raise ValueError("has cells without size or place")
    return np.array([[wide, 0.0, west], [0.0, -high, south + rows * high]])


def read_system(path):
    """Coordinate reference system of the `.prj` file beside a grid as WKT; None if there is none."""
    plain = path.with_suffix("") if path.suffix.lower() == ".gz" else path
    beside = next((file for file in map(plain.with_suffix, (".prj", ".PRJ")) if file.is_file()), None)
    return None if beside is None else pyproj.CRS.from_user_input(beside.read_text("utf-8").strip()).to_wkt()
