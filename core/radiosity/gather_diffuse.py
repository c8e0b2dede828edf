"""The gather estimator for the sky: diffuse irradiance of surfaces from hemisphere rays and form factors."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from ..form_factors.form_factor_products import multiply_elements
from .light_errors import LightError, ReflectedError, errors_of_surfaces
from .patch_size_errors import estimate_discretisation_error, reflect_cells
from .replicates import STEP, Deviations, propagate_deviations
from .solve_radiosity import iterate_bounces, radiosity_of_elements, variance_of_replicates


@dataclass
class Diffuse:
    """Irradiance under the isotropic sky, per DHI."""

    mean: np.ndarray  # (n,)
    error: LightError  # of the mean
    by_replicate: np.ndarray  # (p, HEMISPHERE_REPLICATES) float32, all light of patches by each replicate of their rays
    last: float  # share of the last bounce of all light
    discretisation_error: float = 0.0  # of `estimate_discretisation_error`
    radiosity: np.ndarray | None = None  # (p, cells) float32, of `radiosity_of_elements`; for further rounds


def gather_diffuse(context, hemisphere, element_sky):
    """Relative irradiance of the surfaces under the isotropic sky.

    Parameters
    ----------
    context : GatherContext
    hemisphere : Hemisphere
    element_sky : ElementSky or None
        None without reflections.

    Returns
    -------
    Diffuse
    """
    plan, merge = context.plan, context.merge
    first = hemisphere.sky.mean(axis=1, keepdims=True)
    by_replicate = hemisphere.sky.copy()
    last, discretisation_error, reflections, radiosity = 0.0, 0.0, None, None
    if plan.reflections:
        report_bounces(context, 0)
        far_first = context.request.ground_albedo * hemisphere.far_ground
        form_factors = hemisphere.form_factors
        first_bounce, steps = reflect_cells(context, hemisphere, element_sky.view)
        _, propagated, last = iterate_bounces(
            form_factors,
            hemisphere.factor,
            first_bounce.mean(axis=1, keepdims=True),
            plan.max_bounces,
            far_first=far_first.mean(axis=1, keepdims=True),
            first_light=first.sum(dtype=float),
            threads=context.threads,
            progress=partial(report_bounces, context),
        )
        reflected = multiply_elements(form_factors, propagated, hemisphere.factor, context.threads)
        reflected += first_bounce + far_first
        if context.rounds:
            radiosity = radiosity_of_elements(context, hemisphere, element_sky.view, propagated)
        by_replicate += reflected
        discretisation_error = estimate_discretisation_error(context, steps, reflected)
        passed_on = propagate_deviations(context, hemisphere, Deviations(element_sky.deviation, STEP), reflected)
        reflections = ReflectedError(merge @ by_replicate.mean(axis=1, dtype=float), passed_on, steps)
        report_bounces(context, plan.max_bounces + 1)
    return Diffuse(
        mean=merge @ by_replicate.mean(axis=1, dtype=float),
        error=errors_of_surfaces(merge, variance_of_replicates(by_replicate), reflections),
        by_replicate=by_replicate,
        last=last,
        discretisation_error=discretisation_error,
        radiosity=radiosity,
    )


def report_bounces(context, done):
    """Report the progress of the reflections; estimating their errors at the end takes about as long as one bounce."""
    context.progress("reflections of the sky", done, context.plan.max_bounces + 1, "bounces")
