"""The gather estimator under the sky: from rays and matrix to the diffuse irradiance of surfaces."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from .form_factor_products import multiply_elements
from .solve_radiosity import iterate_bounces, radiosity_factor, variance_of_replicates


@dataclass
class Diffuse:
    """Under the isotropic sky, per DHI."""

    mean: np.ndarray  # (n,)
    standard_error: np.ndarray  # (n,)
    last: float  # share of the last bounce in all light
    discretisation_error: float = 0.0  # of `estimate_discretisation_error`


def gather_diffuse(context, hemisphere):
    """Relative irradiance of the surfaces under the isotropic sky.

    Parameters
    ----------
    context : GatherContext
    hemisphere : Hemisphere

    Returns
    -------
    Diffuse
    """
    plan, merge = context.plan, context.merge
    first = hemisphere.sky.mean(axis=1, keepdims=True)
    by_replicate = hemisphere.sky.copy()
    last = discretisation_error = 0.0
    if plan.reflections:
        tell_bounces(context, 0)
        far_first = context.request.ground_albedo * hemisphere.far_ground
        form_factors, element_sky = hemisphere.form_factors, hemisphere.element_sky
        first_bounce = multiply_elements(form_factors, context.patches.albedo, element_sky, context.threads)
        celled = first_bounce.mean(axis=1, keepdims=True)
        _, propagated, last = iterate_bounces(
            form_factors,
            hemisphere.factor,
            celled.copy(),
            plan.max_bounces,
            far_first=far_first.mean(axis=1, keepdims=True),
            first_light=first.sum(dtype=float),
            threads=context.threads,
            progress=partial(tell_bounces, context),
        )
        reflected = multiply_elements(form_factors, propagated, hemisphere.factor, context.threads)
        reflected += first_bounce + far_first
        by_replicate += reflected
        discretisation_error = estimate_discretisation_error(context, hemisphere, first, celled, reflected)
        tell_bounces(context, plan.max_bounces + 1)
    return Diffuse(
        mean=merge @ by_replicate.mean(axis=1, dtype=float),
        standard_error=np.sqrt(merge.power(2) @ variance_of_replicates(by_replicate)),
        last=last,
        discretisation_error=discretisation_error,
    )


def tell_bounces(context, done):
    """Tell how far the reflections of the sky's light are; after the last one their errors take about as long."""
    context.progress("reflections of the sky", done, context.plan.max_bounces + 1, "bounces")


def estimate_discretisation_error(context, hemisphere, first, celled, reflected):
    """What the reflected light of all eligible surfaces would gain if each patch handed on its first light evenly.

    Light is uneven within the cells of patches too. As the error of such steps falls at least with their length, cells
    a quarter as long leave a third of this, or less.

    Parameters
    ----------
    first : (p, 1) float32
        Mean first light of the patches.
    celled : (p, 1) float32
        What arrives of it at first bounce, handed on cell by cell.
    reflected : (p, HEMISPHERE_REPLICATES) float32
        All reflected light.

    Returns
    -------
    float
        As a share of their reflected light.
    """
    factor = radiosity_factor(context.patches, hemisphere.covered_share)
    even = multiply_elements(hemisphere.form_factors, factor, first, context.threads).mean(axis=1, keepdims=True)
    weight = context.eligible_area @ context.merge  # of the patches
    whole = float(weight @ reflected.mean(axis=1))
    return float(weight @ (even - celled)[:, 0]) / whole if whole > 0 else 0.0
