"""Open a height raster, GeoTIFF or ASC, plain or gzip-compressed."""

import importlib.util
import io
import struct
import zlib
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..settings.errors import InputError
from .open_geotiff import UnreadError, open_geotiff
from .open_input import open_input
from .raster import Raster
from .read_ascii_grid import read_ascii_grid

TIFF_STARTS = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
DAMAGE = (
    OSError,
    ValueError,
    KeyError,
    IndexError,
    TypeError,
    AttributeError,
    ArithmeticError,
    struct.error,
    zlib.error,
)
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
        content = io.BytesIO(start + stream.read()) if is_packed(path) else path
    import tifffile  # imported late: few runs need it

    try:
        return open_geotiff(path, stack.enter_context(tifffile.TiffFile(content)))
    except UnreadError as reason:
        if importlib.util.find_spec("rasterio") is None:
            raise InputError(path, str(reason), CURE) from reason
        return open_with_rasterio(path, content, stack)


def is_packed(path):
    """Whether a file is compressed by gzip."""
    with Path(path).open("rb") as stream:
        return stream.read(2) == b"\x1f\x8b"


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
