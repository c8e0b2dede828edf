"""Unpack a strip or tile of a TIFF file: LZW, Deflate, PackBits, and differences between neighbours.

LZW (Adobe, TIFF 6.0, section 13): codes of 9 to 12 bits, first bit highest, widened one code early.
"""

import zlib

import numpy as np
from numba import njit

PLAIN, LZW, DEFLATE, OLD_DEFLATE, PACKBITS = 1, 5, 8, 32946, 32773
KNOWN = (PLAIN, LZW, DEFLATE, OLD_DEFLATE, PACKBITS)
DIFFERENCES, FLOAT_DIFFERENCES = 2, 3  # predictors (TIFF 6.0, section 14; Adobe's technical note 3)
CLEAR, END = 256, 257
LARGEST = 4096  # codes


@njit(nogil=True, cache=True)
def unpack_lzw(packed, unpacked):
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
    # Each code stands for a sequence that was unpacked before, followed by one byte that came right behind it.
    start, length = np.zeros(LARGEST, np.int64), np.ones(LARGEST, np.int64)
    known, width, held, bits, place, before = END + 1, 9, 0, 0, 0, -1
    for byte in packed:
        held, bits = (held << 8) | byte, bits + 8
        if bits < width:
            continue
        bits -= width
        code = held >> bits
        held &= (1 << bits) - 1
        if code == END:
            return place
        if code == CLEAR:
            known, width, before = END + 1, 9, -1
            continue
        if before >= 0 and known < LARGEST:
            start[known], length[known] = start[before] if before > END else place - 1, length[before] + 1
            known += 1
        if code >= known or (before < 0 and code > END):
            return -1
        count = length[code] if code > END else 1
        first = start[code]
        for number in range(min(count, len(unpacked) - place)):
            unpacked[place + number] = unpacked[first + number] if code > END else code
        # Where a code's bytes came last: any place does, and this one is right before the next byte.
        if code > END:
            start[code] = place
        place, before = min(place + count, len(unpacked)), code
        if known >= (1 << width) - 1 and width < 12:
            width += 1
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
