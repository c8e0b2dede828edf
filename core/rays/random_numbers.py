"""Counter-based random numbers per surface and sample, so that results do not depend on threads,
chunks or order.
"""

from hashlib import blake2b

import numpy as np
from numba import njit

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
FACTORS = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)  # of SplitMix64
SHIFTS = tuple(np.uint64(bits) for bits in (30, 27, 31, 40))  # the last one leaves 24 bits
LEAST = np.float32(2**-24)


def mix(words):
    """Hash 64-bit words (SplitMix64's finalizer; Steele et al. 2014, doi:10.1145/2660193.2660195).

    Parameters
    ----------
    words : (...) uint64

    Returns
    -------
    (...) uint64
    """
    words = (words ^ (words >> SHIFTS[0])) * FACTORS[0]
    words = (words ^ (words >> SHIFTS[1])) * FACTORS[1]
    return words ^ (words >> SHIFTS[2])


def keys_of_names(names, *seeds):
    """One 64-bit key per name, independent of its position in the list, for each seed: list of (n,)
    uint64.
    """
    digests = np.frombuffer(
        b"".join(blake2b(name.encode(), digest_size=8).digest() for name in names), dtype="<u8"
    )
    return [mix(digests + np.uint64(int(GOLDEN) * (seed + 1) % 2**64)) for seed in seeds]


def uniform(keys, count):
    """Uniform numbers in [0, 1) for each key.

    Parameters
    ----------
    keys : (n,) uint64
    count : int
        Numbers per key.

    Returns
    -------
    (n, count) float32
    """
    return uniform_of(keys[:, None], np.arange(1, count + 1))


def uniform_of(keys, numbers):
    """Some of these numbers: (n, m) float32 of keys, (n, 1) uint64, and of their places from 1 on,
    (m,) int.
    """
    numbers_of_keys = np.empty((len(keys), len(numbers)), np.float32)
    _fill_uniform(keys.ravel(), numbers.astype(np.uint64) * GOLDEN, numbers_of_keys)
    return numbers_of_keys


@njit(nogil=True, cache=True)
def _fill_uniform(keys, counters, found):
    """Write numbers in [0, 1) of keys, (n,) uint64, and counters, (m,) uint64, into (n, m) float32;
    `mix` in a loop.
    """
    for row in range(len(keys)):
        for column in range(len(counters)):
            word = keys[row] + counters[column]
            word = (word ^ (word >> SHIFTS[0])) * FACTORS[0]
            word = (word ^ (word >> SHIFTS[1])) * FACTORS[1]
            found[row, column] = np.float32((word ^ (word >> SHIFTS[2])) >> SHIFTS[3]) * LEAST
