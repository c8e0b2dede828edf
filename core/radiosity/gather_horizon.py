"""The gather estimator for the horizon: its light on surfaces, and what they reflect of it."""

import numpy as np

from ..transfer.transfer import Horizon
from .form_factor_products import multiply_elements
from .light_errors import ReflectedError, errors_of_surfaces
from .patch_size_errors import steps_of_cells
from .replicates import propagate_deviations
from .solve_radiosity import iterate_bounces, variance_of_replicates


def gather_horizon(context, hemisphere, first):
    """Light of the horizon on the surfaces.

    Parameters
    ----------
    context : GatherContext
    hemisphere : Hemisphere
    first : HorizonLight

    Returns
    -------
    Horizon
    """
    merge, reflections, by_replicate = context.merge, None, first.light
    if context.plan.reflections:
        form_factors, threads = hemisphere.form_factors, context.threads
        first_bounce = multiply_elements(form_factors, context.patches.albedo, first.element, threads)
        arriving = first_bounce.mean(axis=1, keepdims=True)
        _, propagated, _ = iterate_bounces(
            form_factors, hemisphere.factor, arriving, context.plan.max_bounces, threads=threads
        )
        reflected = multiply_elements(form_factors, propagated, hemisphere.factor, threads) + first_bounce
        by_replicate = first.light + reflected
        steps = steps_of_cells(context, hemisphere, first.element)
        passed_on = propagate_deviations(context, hemisphere, (first.deviation, first.unit), reflected)
        reflections = ReflectedError(merge @ by_replicate.mean(axis=1, dtype=float), passed_on, steps)
    error = errors_of_surfaces(merge, variance_of_replicates(by_replicate), reflections)
    return Horizon(
        view_factor=merge @ first.light.mean(axis=1, dtype=float),
        relative=merge @ by_replicate.mean(axis=1, dtype=float),
        standard_error=np.asarray(error.standard_error),
    )
