"""How sure the direct light of patches is, from the points that spoke for it."""

import numpy as np

from ..sampling.sample_points import cells_inside, neighbouring_order
from ..threads import work_in_slices
from ..transfer.incidence import projection_in_front


def variance_of_shadow_points(by_point, covered, normal, suns, threads):
    """Variance of the mean light of patches.

    Neighbouring points tell it, and where part of a patch lies under something, the line along which it does. Few of
    the cells hold that line; their points may agree by chance, whether they lie on one side or on the other. What these
    cells must do is known: a share q of one is covered, so its point is dark with probability q, and the variance is
    q (1 - q). The larger of the two counts.

    Parameters
    ----------
    by_point : (p, m) float32
        Light at each point, summed over the suns by weight.
    covered : (p, cells) bool
        Cells, as a rule more of them than points, that lie inside or under something.
    normal : (p, 3) float32
    suns : tuple of (s, 3) float32 and (s,) float32
        Directions and weights of the suns in `by_point`.
    threads : int

    Returns
    -------
    (p,) float64
        NaN for a single point.
    """
    variance = variance_of_neighbours(by_point)
    partly = np.flatnonzero(covered.any(axis=1) & ~covered.all(axis=1))
    brightest = by_point[partly].max(axis=1).astype(float)

    def sum_unshaded(rows):
        return projection_in_front(normal[partly[rows]], suns[0]) @ suns[1]

    unshaded = np.concatenate([np.zeros(0), *work_in_slices(sum_unshaded, len(partly), threads)])
    light = np.where(brightest > 0, brightest, unshaded)
    along_the_line = light**2 * variance_of_cover(covered[partly], by_point.shape[1])
    variance[partly] = np.maximum(variance[partly], along_the_line)
    return variance


def variance_of_cover(covered, count):
    """Variance of the share of open points that lie as evenly as one in each of `count` cells: (p,) float64.

    0 where these are the finer; of 4^k cells where `count` is none.
    """
    divisions = 1 << (count.bit_length() - 1) // 2
    inside = cells_inside(round(np.sqrt(covered.shape[1])), divisions)
    members = np.zeros((covered.shape[1], divisions**2))
    members[np.arange(len(inside)), inside] = 1
    share = covered @ (members / np.maximum(members.sum(axis=0), 1))  # (p, divisions²)
    return (share * (1 - share)).sum(axis=1) / divisions**4


def variance_of_neighbours(by_point):
    """Variance of the mean of points that lie evenly, estimated from neighbours taken by pairs.

    What differs between the two of a pair counts as noise, so the estimate is conservative.

    Parameters
    ----------
    by_point : (p, m) float32
        Of a power of two of points, in the order of `points_of_grid`.

    Returns
    -------
    (p,) float64
        NaN for a single point.

    References
    ----------
    W. G. Cochran (1977), Sampling techniques, 3rd ed., 5A.12 (collapsed strata).
    """
    count = by_point.shape[1]
    if count < 2:
        return np.full(len(by_point), np.nan)
    values = by_point[:, neighbouring_order(count)]
    return ((values[:, 0::2] - values[:, 1::2]).astype(float) ** 2).sum(axis=1) / count**2
