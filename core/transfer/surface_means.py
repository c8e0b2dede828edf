"""Averages of patches over their surfaces."""

import numpy as np
from numba import njit
from scipy import sparse

from ..settings.threads import map_in_order

ROWS_PER_TASK = 1 << 13
COVER_STEPS = 512  # finer than cover is known: walls that are covered by exactly one half are told from larger ones
TIE = 1e-4  # of a step: what lies halfway between two is rounded down, whatever the rounding of areas adds to it


def area_means(triangle_surface, area, count):
    """Matrix that averages patches over their surface: (count, p) sparse float64; 0 for patches without area."""
    own = np.flatnonzero((triangle_surface >= 0) & (area > 0))
    surface = triangle_surface[own]
    whole = np.bincount(surface, weights=area[own], minlength=count)
    return sparse.csr_matrix((area[own] / whole[surface], (surface, own)), shape=(count, len(area)))


def cover_of_surfaces(merge, covered_share):
    """Covered share of surfaces, to 1/COVER_STEPS.

    Parameters
    ----------
    merge : (n, p) sparse float64
        Of `area_means`.
    covered_share : (p,) float
        Of patches.

    Returns
    -------
    (n,) float64
    """
    return np.floor(COVER_STEPS * (merge @ covered_share) + 0.5 - TIE) / COVER_STEPS


def average_surfaces(merge, values, threads, out=None):
    """Means over surfaces, in float32.

    Parameters
    ----------
    merge : (n, p) sparse float64
        Of `area_means`.
    values : (p, s) float32
    threads : int
    out : (n, s) float32, optional
        Array to write to.

    Returns
    -------
    (n, s) float32
    """
    means = np.empty((merge.shape[0], values.shape[1]), np.float32) if out is None else out

    def average(first):
        last = min(first + ROWS_PER_TASK, len(means))
        add_rows(merge.indptr[first : last + 1], merge.indices, merge.data, values, means[first:last])

    for _ in map_in_order(average, range(0, len(means), ROWS_PER_TASK), threads):
        pass
    return means


@njit(nogil=True, cache=True)
def add_rows(start, patches, weights, values, means):
    """Weighted sums of the rows of `values`, (p, c), by a matrix in CSR form, added in float64 into `means`, (n, c)."""
    total = np.empty(values.shape[1])
    for row in range(len(means)):
        total[:] = 0
        for entry in range(start[row], start[row + 1]):
            source, weight = values[patches[entry]], weights[entry]
            for column in range(len(total)):
                total[column] += weight * source[column]
        for column in range(len(total)):
            means[row, column] = total[column]
