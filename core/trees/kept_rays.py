"""Rays that are the same in leaf and bare: which of them end without leaves, kept until the bare state is traced.

Both states send the same rays from a patch, with the same random numbers, and bare crowns stop none that crowns in leaf
let pass. So one sum over the crossings of a ray tells for both. What is not kept, such as rays from ground that is seen
only in one state, is traced again.
"""

from dataclasses import dataclass, field

import numpy as np

LARGEST = 1 << 28  # [bytes] that are kept at most, a bit for each ray


@dataclass
class KeptRays:
    """Answers to rows of rays."""

    parts: dict = field(default_factory=dict)  # what the rows have in common -> list of (c,) uint64 and (c, b) uint8
    size: int = 0  # [bytes]


def forget_rays(kept):
    """Empty what was kept."""
    kept.parts.clear()
    kept.size = 0


def keep_rays(kept, common, words, answer):
    """Keep the answers to rows of rays, while there is room.

    Parameters
    ----------
    kept : KeptRays
    common : hashable
        What the rows have in common.
    words : (c,) uint64
        Of each row, by its rays.
    answer : (c, ...) bool
    """
    packed = np.packbits(answer.reshape(len(words), -1), axis=1)
    if len(words) and kept.size + packed.nbytes + words.nbytes <= LARGEST:
        kept.parts.setdefault(common, []).append((words, packed))
        kept.size += packed.nbytes + words.nbytes


def recall_rays(kept, common, words, shape):
    """What is known of rows of rays.

    Parameters
    ----------
    kept : KeptRays
    common, words
        As of `keep_rays`.
    shape : tuple of int
        Of the answer to one row.

    Returns
    -------
    answer : (c, *shape) bool
    known : (c,) bool
        Rows that were kept.
    """
    parts = kept.parts.get(common)
    if not parts or not len(words):
        return np.zeros((len(words), *shape), bool), np.zeros(len(words), bool)
    if len(parts) > 1:
        every, packed = (np.concatenate(part) for part in zip(*parts, strict=True))
        order = np.argsort(every)
        parts = kept.parts[common] = [(every[order], packed[order])]
    every, packed = parts[0]
    order = np.arange(len(every)) if (every[1:] >= every[:-1]).all() else np.argsort(every)
    place = order[np.minimum(np.searchsorted(every, words, sorter=order), len(every) - 1)]
    answer = np.unpackbits(packed[place], axis=1, count=int(np.prod(shape)))
    return answer.astype(bool).reshape(len(words), *shape), every[place] == words
