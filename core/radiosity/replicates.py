"""What the errors of the light that seen patches pass on do to the patches that see them.

The hemisphere rays of a patch come in four independent sets, its shadow points differ from their neighbours. Either
tells by how much the first light of each cell may be off. Every patch that sees the cell shares that error, and so do
all patches of a surface: it does not average out among them as their own noise does. Deviations of four replicates of
the first light are therefore carried through F like light, and the spread of what arrives is its error.
"""

import numpy as np
from numba import njit

from ..sampling.sample_points import HEMISPHERE_REPLICATES
from .form_factor_products import multiply_columns, propagate

STEP = np.float32(1 / 4096)  # of deviations kept as 16-bit numbers; they end at eight times full light
LEAST_SHARE = 0.1  # of the brightest albedo's powers: bounces that carry less of a deviation are left out


@njit(nogil=True, cache=True)
def tally_deviations(met_by, cells, limits, deviation):
    """Sky that each replicate sees from each cell less what all of them see, in steps of STEP.

    The open part of a cell is a ratio of two counts, rays that reach the sky over rays that start in the open; its
    deviation is linear in both.

    Parameters
    ----------
    met_by : tuple of (c, rays) uint8, (c, rays) uint8 and (c, CELL_DIVISIONS²) bool
        Fates and start cells of rays, and what `ask_each_ray` tells.
    cells : tuple of (CELL_DIVISIONS²,) int and bool
        The larger cell in which each of these lies, and whether rays enough start in each; else the patch is one.
    limits : tuple of two int
        Of fates: the one that counts as sky, and the first of those that tell no start in the open.
    deviation : (c, cells, HEMISPHERE_REPLICATES) int16
        Written.
    """
    (fate, start_cells, asked), (cell_of, told), (sky, back) = met_by, cells, limits
    count, rays = fate.shape
    replicates = deviation.shape[2]
    per_replicate = rays // replicates
    resolved = deviation.shape[1] if told else 1
    free, started = np.empty((2, resolved, replicates), np.float32)
    for patch in range(count):
        free[:], started[:] = 0, 0
        for ray in range(replicates * per_replicate):
            start, met = start_cells[patch, ray], fate[patch, ray]
            cell, replicate = cell_of[start] if told else 0, ray // per_replicate
            free[cell, replicate] += met == sky
            started[cell, replicate] += (not asked[patch, start]) | (met < back)
        for cell in range(deviation.shape[1]):
            of_cell, begun = free[cell if told else 0], started[cell if told else 0]
            whole = max(begun.sum(), np.float32(1))
            mean = of_cell.sum() / whole
            for replicate in range(replicates):
                apart = (of_cell[replicate] - mean * begun[replicate]) * replicates / whole
                deviation[patch, cell, replicate] = np.int16(max(-32767, min(32767, np.rint(apart / STEP))))


def pass_on(context, hemisphere, first, arrived):
    """Deviations of replicates of the light that patches receive from others.

    Linear in the deviations: rays of one patch, at their mean, meet the light of others as each replicate of those has
    it.

    Parameters
    ----------
    context : GatherContext
    hemisphere : Hemisphere
    first : tuple of (p, cells, HEMISPHERE_REPLICATES) int16 and float32
        Deviations of first light, and the step that they are counted in.
    arrived : (p, HEMISPHERE_REPLICATES) float32
        What patches receive from others by the rays of each replicate. It is overwritten.

    Returns
    -------
    (p, HEMISPHERE_REPLICATES) float32
    """
    form_factors, albedo = hemisphere.form_factors, context.patches.albedo
    total = multiply_columns(form_factors, albedo * first[1], first[0], context.threads)
    arrived -= arrived.mean(axis=1, keepdims=True)
    arrived += total
    unused = np.zeros(HEMISPHERE_REPLICATES, np.float32), np.empty(len(arrived), np.float32)
    for _ in range(count_bounces(float(albedo.max(initial=0)), context.plan.max_bounces) - 1):
        arrived = propagate(form_factors, hemisphere.factor, arrived, unused, context.threads)
        total += arrived
    return total


def count_bounces(albedo, max_bounces):
    """How many reflections carry more than LEAST_SHARE of a deviation at the brightest albedo, one at least."""
    return next((n for n in range(1, max_bounces) if albedo ** (n + 1) < LEAST_SHARE), max(max_bounces, 1))
