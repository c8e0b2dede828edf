"""Unpack a strip or tile of a TIFF file."""

import zlib

import numpy as np

from .unpack_lzw import unpack_lzw

PLAIN, LZW, DEFLATE, OLD_DEFLATE, PACKBITS = 1, 5, 8, 32946, 32773
KNOWN = (PLAIN, LZW, DEFLATE, OLD_DEFLATE, PACKBITS)
DIFFERENCES, FLOAT_DIFFERENCES = 2, 3  # predictors (TIFF 6.0, section 14; Adobe's technical note 3)


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
    size = int(np.prod(shape)) * kind.itemsize
    data = unpack_bytes(packed, compression, size)
    if len(data) < size:
        raise ValueError(f"a strip or tile has {len(data)} of {size} bytes")
    data = np.frombuffer(data, np.uint8, size)
    if predictor == FLOAT_DIFFERENCES:
        # The highest bytes of a row come first, then the next ones; each byte is the difference from the one before.
        rows = data.reshape(shape[0], -1, shape[2])
        rows = np.cumsum(rows, axis=1, dtype=np.uint8).reshape(shape[0], kind.itemsize, -1)
        return np.ascontiguousarray(rows.swapaxes(1, 2)).view(kind.newbyteorder(">")).reshape(shape)
    if predictor == DIFFERENCES:
        whole = np.dtype(f"u{kind.itemsize}")
        values = data.view(whole.newbyteorder(kind.byteorder)).reshape(shape)
        return np.cumsum(values, axis=1, dtype=whole).view(kind.newbyteorder("="))
    return data.view(kind).reshape(shape)


def unpack_bytes(packed, compression, size):
    """Bytes of a strip or tile, no more than a size."""
    if compression == LZW:
        data = np.empty(size, np.uint8)
        count = unpack_lzw(np.frombuffer(packed, np.uint8), data)
        if count < 0:
            raise ValueError("LZW codes are damaged")
        return data[:count].tobytes()
    if compression in (DEFLATE, OLD_DEFLATE):
        return zlib.decompressobj().decompress(packed, size)
    return unpack_runs(packed, size) if compression == PACKBITS else packed


def unpack_runs(packed, size):
    """Bytes of PackBits (TIFF 6.0, section 9)."""
    data, place = bytearray(), 0
    while place + 1 < len(packed) and len(data) < size:
        count = packed[place]
        if count < 128:
            data += packed[place + 1 : place + 2 + count]
            place += 2 + count
        else:
            data += packed[place + 1 : place + 2] * (257 - count if count > 128 else 0)
            place += 2 if count > 128 else 1
    return bytes(data[:size])
