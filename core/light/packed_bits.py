"""Shadow bits at rest, in a fifth of their room: most patches see a sun from none of their points
or from all.
"""

from dataclasses import dataclass

import numpy as np

# Of each number of four codes, (256, 4) bool: which of them are 1, all points, and 2, some points.
_codes = np.arange(256)[:, None] >> np.arange(0, 8, 2) & 3
_ALL, _SOME = np.ascontiguousarray(_codes & 1 > 0), np.ascontiguousarray(_codes & 2 > 0)


@dataclass
class PackedBits:
    """Bits of `Shadows` for the states of trees, (states, p, words, s) uint16, packed."""

    shape: tuple  # of the bits
    full: int  # word of a patch all of whose points see the sun
    codes: np.ndarray  # (c,) uint8, of four words each
    others: np.ndarray  # (o,) uint16, words of code 2

    def unpack(self):
        """The bits: (states, p, words, s) uint16."""
        count = int(np.prod(self.shape))
        words = (_ALL * np.uint16(self.full)).view(np.uint64)[self.codes, 0].view(np.uint16)[:count]
        some = _SOME.view(np.uint32)[self.codes, 0].view(bool)[:count]
        words[np.flatnonzero(some)] = self.others
        return words.reshape(self.shape)


def pack_bits(bits):
    """PackedBits of (states, p, words, s) uint16."""
    words = np.ascontiguousarray(bits).reshape(-1)
    full = int(words.max(initial=0))
    some = (words != 0) & (words != full)
    codes = np.zeros(-(-len(words) // 4) * 4, np.uint8)
    codes[: len(words)] = (words != 0).view(np.uint8) + some.view(np.uint8)
    codes = codes[0::4] | codes[1::4] << 2 | codes[2::4] << 4 | codes[3::4] << 6
    return PackedBits(bits.shape, full, codes, words[some])
