"""LZW as in TIFF (Adobe, TIFF 6.0, section 13): codes of 9 to 12 bits, first bit highest, widened one code early."""

import numpy as np
from numba import njit

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
