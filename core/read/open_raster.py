"""Open a height raster, plain or gzip-compressed: a GeoTIFF, or an ASC grid (Esri ASCII grid)."""

import importlib.util
import io
import re
import struct
import warnings
import zlib
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyproj

from ..errors import InputError
from .open_geotiff import UnreadError, open_geotiff
from .open_input import open_input, open_text
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
        head, line = {}, stream.readline(1000)
        while (match := HEAD.match(line)) and match[1].lower() in MARKS:
            head[match[1].lower()] = match[2]
            line = stream.readline(1000)
        columns, rows = int(head["ncols"]), int(head["nrows"])
        if columns < 1 or rows < 1:
            raise ValueError(f"its header announces {columns} x {rows} heights")
        body = line + stream.read()
    if 2 * columns * rows > len(body) + 1:
        raise ValueError(f"its header announces {columns:,} x {rows:,} heights, but the file is too short")
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            numbers = np.fromstring(body, dtype=float, sep=" ")
        except DeprecationWarning as error:
            raise ValueError("holds something that is no number") from error
    if len(numbers) != columns * rows:
        raise ValueError(f"has {len(numbers):,} heights, but its header announces {columns:,} x {rows:,}")
    heights = numbers.reshape(rows, columns)
    gap = float(head.get("nodata_value", "nan"))
    heights[heights == gap] = np.nan

    def read_cells(top, bottom, left, right):
        return heights[top:bottom, left:right].copy()

    return Raster(path, columns, rows, matrix_of_head(head, rows), read_system(Path(path)), "", 0, 1, read_cells)


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


TIFF_STARTS = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
DAMAGE = (OSError, ValueError, LookupError, TypeError, AttributeError, ArithmeticError, struct.error, zlib.error)
CURE = "type: gdalwarp -t_srs EPSG:4326 -co COMPRESS=DEFLATE old.tif new.tif (or: pip install rasterio)"
LARGEST_BLOCK = 2**28  # bytes of one unpacked block of the raster


@contextmanager
def open_raster(path):
    """Open a raster.

    Yields
    ------
    Raster

    Raises
    ------
    InputError
        Not a raster, or a damaged one, also while it is read.
    """
    open_input(path).close()
    with ExitStack() as stack:
        raster = tell_damage(path, _open)(path, stack)
        if raster.block_bytes > LARGEST_BLOCK:
            raise InputError(path, "has blocks of more than 256 MiB", "rewrite it as a tiled GeoTIFF")
        yield replace(raster, read_cells=tell_damage(path, raster.read_cells))


def tell_damage(path, function):
    """A function whose errors on damaged bytes are InputErrors."""

    def call(*arguments):
        try:
            return function(*arguments)
        except InputError:
            raise
        except DAMAGE as error:
            words = " ".join(str(error).replace(str(path), "it").split())[:160]
            raise InputError(path, f"is not a readable raster ({words})", "give a GeoTIFF or an ASC grid") from error

    return call


def _open(path, stack):
    with open_input(path) as stream:
        start = stream.read(4)
        if start not in TIFF_STARTS:
            return read_ascii_grid(path)
        with Path(path).open("rb") as plain:
            packed = plain.read(4) != start
        content = io.BytesIO(start + stream.read()) if packed else path
    import tifffile  # imported late: few runs need it

    try:
        return open_geotiff(path, stack.enter_context(tifffile.TiffFile(content)))
    except UnreadError as reason:
        if importlib.util.find_spec("rasterio") is None:
            raise InputError(path, str(reason), CURE) from reason
        return open_with_rasterio(path, content, stack)


def open_with_rasterio(path, content, stack):
    """Open a raster of a rarer kind by GDAL, where rasterio is installed.

    Parameters
    ----------
    path : path-like
    content : path-like or io.BytesIO
    stack : contextlib.ExitStack
        Closes it.

    Returns
    -------
    Raster
    """
    import rasterio
    from rasterio.windows import Window

    try:
        dataset = stack.enter_context(rasterio.open(content))
    except rasterio.errors.RasterioError as error:
        raise ValueError(str(error)) from error

    def read_cells(top, bottom, left, right):
        try:
            cells = dataset.read(1, window=Window(left, top, right - left, bottom - top), masked=True)
        except rasterio.errors.RasterioError as error:
            raise ValueError(str(error)) from error
        return cells.astype(float).filled(np.nan) * dataset.scales[0] + dataset.offsets[0]

    rows, columns = dataset.block_shapes[0]
    size = rows * columns * np.dtype(dataset.dtypes[0]).itemsize
    matrix = np.array(dataset.transform[:6], float).reshape(2, 3)
    crs = dataset.crs.to_wkt() if dataset.crs else None
    return Raster(path, dataset.width, dataset.height, matrix, crs, dataset.units[0] or "", size, rows, read_cells)
