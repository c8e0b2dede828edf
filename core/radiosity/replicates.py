"""Propagation of the errors of re-emitted light to the patches that receive it.

The hemisphere rays of a patch are four independent replicates, and its shadow points differ from their neighbours. Both
give the error of the first light of each cell. Every patch that sees the cell shares that error, and so do all patches
of a surface: unlike their own noise, it does not average out among them. Deviations of four replicates of the first
light are therefore propagated through F like light, and the variance of what arrives is its error.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from ..form_factors.form_factor_products import multiply_columns, propagate
from ..sampling.sample_points import HEMISPHERE_REPLICATES

STEP = np.float32(1 / 4096)  # of deviations stored as 16-bit integers; the range ends at eight times full light
LEAST_SHARE = 0.1  # of a deviation, by powers of the brightest albedo: bounces that carry less are left out


class Deviations(NamedTuple):
    """Deviations of each replicate's first light from the mean of all."""

    values: np.ndarray  # (p, cells, HEMISPHERE_REPLICATES) int16
    unit: np.float32  # of `values`; or (p,) float32, of those of each patch


@njit(nogil=True, cache=True)
def tally_deviations(met_by, cells, limits, deviation):
    """Deviation of each replicate's visible sky from the mean of all, for each cell, in units of STEP.

    The visible sky of the open part of a cell is a ratio of two counts, rays that reach the sky over rays that start in
    the open; its deviation is linearised in both.

    Parameters
    ----------
    met_by : tuple of (c, rays) uint8, (c, rays) uint8 and (c, CELL_DIVISIONS²) bool
        Fates and start cells of rays, and the cells of `cells_near_cover`.
    cells : tuple of (CELL_DIVISIONS²,) int and bool
        The larger cell that contains each of these, and whether enough rays start in each; if not, the patch is taken
        as a whole.
    limits : tuple of two int
        Fates: the one that counts as sky, and the first of those that do not prove a start in the open.
    deviation : (c, cells, HEMISPHERE_REPLICATES) int16
        Written.
    """
    (fate, start_cells, near_cover), (cell_of, resolves), (sky, back) = met_by, cells, limits
    count, rays = fate.shape
    replicates = deviation.shape[2]
    per_replicate = rays // replicates
    resolved = deviation.shape[1] if resolves else 1
    free, started = np.empty((2, resolved, replicates), np.float32)
    for patch in range(count):
        free[:], started[:] = 0, 0
        for ray in range(replicates * per_replicate):
            start, met = start_cells[patch, ray], fate[patch, ray]
            cell, replicate = cell_of[start] if resolves else 0, ray // per_replicate
            free[cell, replicate] += met == sky
            started[cell, replicate] += (not near_cover[patch, start]) | (met < back)
        for cell in range(deviation.shape[1]):
            of_cell, begun = free[cell if resolves else 0], started[cell if resolves else 0]
            whole = max(begun.sum(), np.float32(1))
            mean = of_cell.sum() / whole
            for replicate in range(replicates):
                apart = (of_cell[replicate] - mean * begun[replicate]) * replicates / whole
                deviation[patch, cell, replicate] = np.int16(max(-32767, min(32767, np.rint(apart / STEP))))


def propagate_deviations(context, hemisphere, first, arrived):
    """Deviations of replicates of the light that patches receive from others.

    Linear in the deviations: the mean over the rays of one patch is combined with each replicate of others' light.

    Parameters
    ----------
    context : GatherContext
    hemisphere : Hemisphere
    first : Deviations
    arrived : (p, HEMISPHERE_REPLICATES) float32
        What patches receive from others, by the rays of each replicate. Overwritten.

    Returns
    -------
    (p, HEMISPHERE_REPLICATES) float32
    """
    form_factors, albedo = hemisphere.form_factors, context.patches.albedo
    total = multiply_columns(form_factors, albedo * first.unit, first.values, context.threads)
    arrived -= arrived.mean(axis=1, keepdims=True)
    arrived += total
    unused = np.zeros(HEMISPHERE_REPLICATES, np.float32), np.empty(len(arrived), np.float32)
    for _ in range(count_bounces(float(albedo.max(initial=0)), context.plan.max_bounces) - 1):
        arrived = propagate(form_factors, hemisphere.factor, arrived, unused, context.threads)
        total += arrived
    return total


def count_bounces(albedo, max_bounces):
    """Number of reflections that carry more than LEAST_SHARE of a deviation at the brightest albedo, at least one."""
    return next((n for n in range(1, max_bounces) if albedo ** (n + 1) < LEAST_SHARE), max(max_bounces, 1))
