"""Values of traced suns at the intervals that they represent, and how far these are from them."""

import numpy as np


def values_at(values, index, weight):
    """Values of the traced suns, (s, n), at the intervals that they represent: (t, n).

    Parameters
    ----------
    values : numpy.ndarray, (s, n)
        In any unit.
    index, weight : numpy.ndarray, (t, k)
        As of `SunMatch`. A single sun, k = 1, has the weight 1.
    """
    if index.shape[1] == 1:
        return np.take(values, index[:, 0], axis=0, mode="clip")
    return sum(
        np.take(values, index[:, column], axis=0, mode="clip") * weight[:, column, None]
        for column in range(index.shape[1])
    )


def largest_mismatch(suns, direction, index, weight):
    """Largest angle between the sun of an interval, unit vectors (t, 3), and a traced one that represents it: [°]."""
    angle = 0.0
    for column in range(index.shape[1]):
        used = weight[:, column] != 0
        cosine = np.einsum("hi,hi->h", suns.direction[index[used, column]], direction[used])
        angle = max(angle, float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).max(initial=0.0)))
    return angle
