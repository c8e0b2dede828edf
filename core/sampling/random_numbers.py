"""Counter-based random numbers per surface and sample, so that results do not depend on threads, chunks or order."""

from hashlib import blake2b

import numpy as np

GOLDEN = np.uint64(0x9E3779B97F4A7C15)


def mix(words):
    """Hash 64-bit words (SplitMix64's finalizer; Steele et al. 2014, doi:10.1145/2660193.2660195).

    Parameters
    ----------
    words : (...) uint64

    Returns
    -------
    (...) uint64
    """
    words = (words ^ (words >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    words = (words ^ (words >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return words ^ (words >> np.uint64(31))


def digest_names(names):
    """Hashes of names: (n,) uint64."""
    return np.frombuffer(b"".join(blake2b(name.encode(), digest_size=8).digest() for name in names), dtype="<u8")


def key_of_digests(digests, seed):
    """One 64-bit key per name, (n,) uint64, from `digest_names`."""
    return mix(digests + np.uint64(int(GOLDEN) * (seed + 1) % 2**64))


def key_of_names(names, seed):
    """One 64-bit key per name: (n,) uint64, independent of the position in the list."""
    return key_of_digests(digest_names(names), seed)


def mix_seed(seed, index):
    """Seed of an independent stream: int, for `index` from 1."""
    word = np.array([(int(GOLDEN) * (seed + 1) + index) % 2**64], np.uint64)
    return int(mix(word)[0]) >> 33


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
    """Some of these numbers: (...) float32 of keys, (...) uint64, and of their places from 1 on, (...) int."""
    counters = numbers.astype(np.uint64) * GOLDEN
    return (mix(keys + counters) >> np.uint64(40)).astype(np.float32) * np.float32(2**-24)
