"""Open a GeoTIFF (OGC 19-008r4): uncompressed, Deflate, LZW or PackBits, in strips or tiles.

Its coordinate reference system and the unit of its heights follow from its keys.

LZW (Adobe, TIFF 6.0, section 13): codes of 9 to 12 bits, first bit highest, widened one code early.
"""

import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
import pyproj
from numba import njit

from ..settings.errors import InputError

METADATA, NO_DATA = 42112, 42113  # tags of GDAL
UNREADABLE, GIVE = "is not a readable raster", "give a GeoTIFF or an ASC grid"
USER_DEFINED = 32767
# EPSG's [m]
UNITS = {
    9001: ("metre", 1.0),
    9002: ("foot", 0.3048),
    9003: ("us survey foot", 1200 / 3937),
}


@dataclass
class Raster:
    """An open raster, read window by window."""

    path: object
    width: int  # columns
    height: int  # rows
    # (2, 3) float64, from (column, row, 1) of corners of cells to the raster's system
    matrix: np.ndarray
    crs: str | None  # WKT
    unit: str  # of the heights, "" if not told
    block_bytes: int  # of the largest piece that is unpacked at once
    block_rows: int  # rows that are stored together
    read_cells: (
        Callable  # (first row, last row, first column, last column) -> (r, c) float64, NaN in gaps
    )


def _crs_of_keys(keys):
    """Coordinate reference system of a GeoTIFF.

    Parameters
    ----------
    keys : dict
        GeoTIFF keys by name.

    Returns
    -------
    crs : str or None
        WKT; None if there is none.
    unit : str
        Of the heights, "" if not told.

    Raises
    ------
    NotImplementedError, pyproj.exceptions.CRSError
        It has no code of EPSG, or an unknown one.
    """
    model = _number_of_key(keys, "GTModelTypeGeoKey", 0)
    # Models of type 1 are projected, of type 2 geographic.
    name = {1: "ProjectedCSTypeGeoKey", 2: "GeographicTypeGeoKey"}.get(model)
    unit = UNITS.get(_number_of_key(keys, "VerticalUnitsGeoKey", 0), ("", None))[0]
    if name is None:
        return None, unit
    code = _number_of_key(keys, name, USER_DEFINED)
    vertical = _number_of_key(keys, "VerticalCSTypeGeoKey", USER_DEFINED)
    if code in (0, USER_DEFINED):
        raise NotImplementedError("its coordinate reference system has no EPSG code")
    system = pyproj.CRS.from_epsg(code)
    given = UNITS.get(_number_of_key(keys, "ProjLinearUnitsGeoKey", 0), ("", None))[1]
    if model == 1 and given and abs(given / system.axis_info[0].unit_conversion_factor - 1) > 1e-9:
        raise NotImplementedError(f"its unit of length is not that of EPSG:{code}")
    if 0 < vertical < USER_DEFINED and not unit and pyproj.CRS.from_epsg(vertical).is_vertical:
        system = pyproj.CRS.from_user_input(f"EPSG:{code}+{vertical}")
    return system.to_wkt(), unit


def _number_of_key(keys, name, default):
    """Whole number that a GeoTIFF key holds; a ValueError where it holds something else."""
    value = keys.get(name, default)
    if not isinstance(value, int | float):
        raise ValueError(f"{name} is {value!r}")
    return int(value)


def open_geotiff(path, file):
    """Open the first image of a GeoTIFF.

    Parameters
    ----------
    path : path-like
    file : tifffile.TiffFile
        Stays open as long as the raster is read.

    Returns
    -------
    Raster

    Raises
    ------
    NotImplementedError, pyproj.exceptions.CRSError
        Compressed in another way, or in a system without a known number.
    InputError, ValueError, ArithmeticError
        Damaged.
    """
    # The tags are read as they are asked for.
    with InputError.parsing(path, UNREADABLE, GIVE):
        page = file.pages[0]
        kind, keys = page.dtype, page.geotiff_tags or {}
        # Tags of GeoTIFF: the transformation, or the pixels' scale and a tie point.
        places = [page.tags.valueof(tag) for tag in (34264, 33550, 33922)]
        places = [
            None if values is None else np.atleast_1d(np.asarray(values, float))
            for values in places
        ]
        rows, columns = map(int, page.chunks[:2])
        across, down = -(-page.imagewidth // columns), -(-page.imagelength // rows)
        counts = len(page.dataoffsets), len(page.databytecounts)
    # Only what is read rightly is taken: plain compressions, and whole numbers or floats of whole
    # bytes.
    if (
        page.compression not in (1, LZW, DEFLATE, OLD_DEFLATE, PACKBITS)
        or page.predictor not in (1, 2, 3)
        or page.fillorder != 1
    ):
        raise NotImplementedError(
            f"is compressed by {getattr(page.compression, 'name', page.compression)}"
        )
    if kind is None or kind.kind not in "iuf" or page.bitspersample != 8 * kind.itemsize:
        raise NotImplementedError(f"has values of {page.bitspersample} bits")
    # Where the raster lies, from its keys; what its numbers mean, from GDAL's words; which one
    # means none.
    crs, unit = _crs_of_keys(keys)
    # Scale, offset and unit of the first band, as GDAL writes them.
    words = str(page.tags[METADATA].value) if METADATA in page.tags else ""
    role = r'<Item\b[^>]*\bsample="0"[^>]*\brole="(scale|offset|unittype)"[^>]*>([^<]*)<'
    told = {"scale": 1.0, "offset": 0.0, "unittype": ""} | dict(re.findall(role, words))
    scale, offset = float(told["scale"]), float(told["offset"])
    gap = None
    if NO_DATA in page.tags:
        gap = float(str(page.tags[NO_DATA].value).strip(" \0").replace(",", "."))
        gap = float(kind.type(gap)) if kind.kind == "f" else gap
    # Fewer strips or tiles than the size of the image asks for: the file is damaged.
    if min(counts) < across * down:
        raise ValueError(f"{min(counts)} of {across * down} strips or tiles")

    # A window of cells, put together from the strips or tiles that it meets; NaN where the number
    # means none, else number times scale plus offset.
    def read_cells(first, last, west, east):
        values = np.empty((last - first, east - west))
        for row, column in product(
            range(first // rows, -(-last // rows)), range(west // columns, -(-east // columns))
        ):
            # Of each block what lies in the window, so that one block at a time is held whole.
            top, left = row * rows, column * columns
            block = _read_block(page, row * across + column, gap or 0.0)[
                max(first - top, 0) : last - top
            ]
            block = block[:, max(west - left, 0) : east - left]
            start = max(top - first, 0), max(left - west, 0)
            values[start[0] : start[0] + block.shape[0], start[1] : start[1] + block.shape[1]] = (
                block
            )
        if gap is not None:
            values[values == gap] = np.nan
        return values * scale + offset

    # Largest piece that is held at once, and the matrix from cells to coordinates.
    size = int(np.prod(page.chunks)) * kind.itemsize
    matrix = matrix_of_page(places, keys, Path(path))
    unit = told["unittype"] or unit
    return Raster(
        path, page.imagewidth, page.imagelength, matrix, crs, unit, size, rows, read_cells
    )


def _read_block(page, number, absent):
    """One strip or tile, (rows, columns) array of its first sample; a value everywhere if the file
    leaves it out.
    """
    file, (rows, columns) = page.parent, page.chunks[:2]
    if not page.is_tiled:
        rows = min(rows, page.imagelength - number * rows)
    offset, count = page.dataoffsets[number], page.databytecounts[number]
    if count == 0:
        return np.full((rows, columns), absent)
    file.filehandle.seek(offset)
    packed, kind = file.filehandle.read(count), page.dtype.newbyteorder(file.byteorder)
    # Where the samples of a cell lie apart, only the first ones are read.
    shape = rows, columns, int(np.prod(page.chunks[2:]))
    return unpack_segment(packed, int(page.compression), int(page.predictor), shape, kind)[..., 0]


def matrix_of_page(places, keys, path):
    """Transformation from (column, row, 1) of cell corners: (2, 3) float64; from a world file where
    none is inside.

    `places` are the transformation, the size of cells and the tie points of the tags, None where
    there are none. The identity if there is none at all.
    """
    whole, size, point = places
    if whole is not None:
        matrix = whole.reshape(4, 4)[:2][:, [0, 1, 3]]
    elif size is not None and point is not None:
        x, y = size[0], -size[1]
        column, row, _, east, north, _ = point[:6]
        matrix = np.array([[x, 0.0, east - column * x], [0.0, y, north - row * y]])
    else:
        beside = next(
            (
                file
                for file in map(path.with_suffix, (".tfw", ".tifw", ".tiffw", ".wld", ".TFW"))
                if file.is_file()
            ),
            None,
        )
        if beside is None:
            return np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
        a, d, b, e, x, y = (float(word) for word in beside.read_text("ascii").split()[:6])
        return np.array([[a, b, x - 0.5 * (a + b)], [d, e, y - 0.5 * (d + e)]])
    # A raster of type 2 has points, not areas, as pixels.
    if _number_of_key(keys, "GTRasterTypeGeoKey", 1) == 2:
        matrix[:, 2] -= 0.5 * (matrix[:, 0] + matrix[:, 1])
    return matrix


LZW, DEFLATE, OLD_DEFLATE, PACKBITS = 5, 8, 32946, 32773
CLEAR, END = 256, 257
LARGEST = 4096  # codes


@njit(nogil=True, cache=True)
def _unpack_lzw(packed, unpacked):
    """Unpack bytes.

    Parameters
    ----------
    packed : (n,) uint8
    unpacked : (m,) uint8
        Filled with the result.

    Returns
    -------
    int
        Number of bytes that were unpacked; -1 if the codes are damaged.
    """
    # LZW, as TIFF packs it. Each code stands for a sequence that was unpacked before, followed by
    # one byte that came right behind it.
    start, length = np.zeros(LARGEST, np.int64), np.ones(LARGEST, np.int64)
    known, width, held, bits, place, before = END + 1, 9, 0, 0, 0, -1
    # Bytes are added until there are enough bits for a code.
    for byte in packed:
        held, bits = (held << 8) | byte, bits + 8
        if bits < width:
            continue
        bits -= width
        code = held >> bits
        held &= (1 << bits) - 1
        # The end, or a fresh start of the table.
        if code == END:
            return place
        if code == CLEAR:
            known, width, before = END + 1, 9, -1
            continue
        # The sequence before, with the first byte of this one, becomes a new entry.
        if before >= 0 and known < LARGEST:
            start[known], length[known] = (
                start[before] if before > END else place - 1,
                length[before] + 1,
            )
            known += 1
        # A code that stands for nothing yet: the bytes are damaged.
        if code >= known or (before < 0 and code > END):
            return -1
        # The sequence of the code is copied from where it came last, as far as there is room.
        count = length[code] if code > END else 1
        first = start[code]
        for number in range(min(count, len(unpacked) - place)):
            unpacked[place + number] = unpacked[first + number] if code > END else code
        # Where a code's bytes came last: any place does, and this one is right before the next
        # byte.
        if code > END:
            start[code] = place
        place, before = min(place + count, len(unpacked)), code
        # Codes get a bit longer when the table asks for it.
        if known >= (1 << width) - 1 and width < 12:
            width += 1
    return place


@njit(nogil=True, cache=True)
def unpack_bits(packed, unpacked):
    """Unpack bytes packed by PackBits (TIFF 6.0, section 9), as `_unpack_lzw` does: number of bytes
    unpacked.
    """
    place, next_one = 0, 0
    while next_one < len(packed) and place < len(unpacked):
        head = int(packed[next_one])
        next_one += 1
        if head < 128:  # so many bytes as they are, and one more
            count = min(head + 1, len(packed) - next_one, len(unpacked) - place)
            unpacked[place : place + count] = packed[next_one : next_one + count]
            place, next_one = place + count, next_one + head + 1
        elif head > 128 and next_one < len(packed):  # the next byte, repeated; 128 means nothing
            count = min(257 - head, len(unpacked) - place)
            unpacked[place : place + count] = packed[next_one]
            place, next_one = place + count, next_one + 1
    return place


def unpack_segment(packed, compression, predictor, shape, kind):
    """Values of a strip or tile.

    Parameters
    ----------
    packed : bytes
    compression, predictor : int
        As in the file.
    shape : (rows, columns, samples)
    kind : numpy.dtype
        With the byte order of the file.

    Returns
    -------
    (rows, columns, samples) numpy.ndarray

    Raises
    ------
    ValueError, zlib.error
        The bytes are damaged or too few.
    """
    # Unpacked by its compression, or taken as it is where it has none.
    size, data = int(np.prod(shape)) * kind.itemsize, packed
    if compression == LZW:
        unpacked = np.empty(size, np.uint8)
        count = _unpack_lzw(np.frombuffer(packed, np.uint8), unpacked)
        if count < 0:
            raise ValueError("LZW codes are damaged")
        data = unpacked[:count]
    elif compression in (DEFLATE, OLD_DEFLATE):
        data = zlib.decompressobj().decompress(packed, size)
    elif compression == PACKBITS:
        unpacked = np.empty(size, np.uint8)
        data = unpacked[: unpack_bits(np.frombuffer(packed, np.uint8), unpacked)]
    if len(data) < size:
        raise ValueError(f"a strip or tile has {len(data)} of {size} bytes")
    data = np.frombuffer(data, np.uint8, size)
    # Predictor 3: differences of floats, Adobe's technical note 3; 2: differences, TIFF 6.0,
    # section 14. Without either the bytes are the values.
    if predictor == 3:
        # The highest bytes of a row come first, then the next ones; each byte is the difference
        # from the one before.
        rows = data.reshape(shape[0], -1, shape[2])
        rows = np.cumsum(rows, axis=1, dtype=np.uint8).reshape(shape[0], kind.itemsize, -1)
        return np.ascontiguousarray(rows.swapaxes(1, 2)).view(kind.newbyteorder(">")).reshape(shape)
    if predictor == 2:
        whole = np.dtype(f"u{kind.itemsize}")
        values = data.view(whole.newbyteorder(kind.byteorder)).reshape(shape)
        return np.cumsum(values, axis=1, dtype=whole).view(kind.newbyteorder("="))
    return data.view(kind).reshape(shape)
