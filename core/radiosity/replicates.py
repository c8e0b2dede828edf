"""Propagation of the errors of re-emitted light to the patches that receive it.

The hemisphere rays of a patch are four independent replicates, and its shadow points differ from their neighbours. Both
give the error of the first light of each cell. Every patch that sees the cell shares that error, and so do all patches
of a surface: unlike their own noise, it does not average out among them. Deviations of four replicates of the first
light are therefore propagated through F like light, and the variance of what arrives is its error.
"""

from typing import NamedTuple

import numpy as np

from ..form_factors.form_factor_products import multiply_columns, propagate
from ..rays.sample_points import HEMISPHERE_REPLICATES

STEP = np.float32(1 / 4096)  # of deviations stored as 16-bit integers; the range ends at eight times full light
LEAST_SHARE = 0.1  # of a deviation, by powers of the brightest albedo: bounces that carry less are left out


class Deviations(NamedTuple):
    """Deviations of each replicate's first light from the mean of all."""

    values: np.ndarray  # (p, cells, HEMISPHERE_REPLICATES) int16
    unit: np.float32  # of `values`; or (p,) float32, of those of each patch


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
