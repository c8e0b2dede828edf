"""The gather estimator under the sky: from rays and matrix to the diffuse irradiance of surfaces."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from .form_factor_products import multiply_cells
from .reflect import follow_bounces, radiosity_factor, variance_of_replicates


@dataclass
class Diffuse:
    """Under the isotropic sky, per DHI."""

    mean: np.ndarray  # (n,)
    standard_error: np.ndarray  # (n,)
    last: float  # share of the last bounce in all light
    evened: float = 0.0  # of `change_by_even_patches`


def gather_diffuse(tracing, hemisphere):
    """Relative irradiance of the surfaces under the isotropic sky.

    Parameters
    ----------
    tracing : Tracing
    hemisphere : Hemisphere

    Returns
    -------
    Diffuse
    """
    plan, merge = tracing.plan, tracing.merge
    first = hemisphere.sky.mean(axis=1, keepdims=True)
    by_replicate = hemisphere.sky.copy()
    last = evened = 0.0
    if plan.reflections:
        tell_bounces(tracing, 0)
        far_first = tracing.request.ground_albedo * hemisphere.far_ground
        form_factors, sky_of_cells = hemisphere.form_factors, hemisphere.sky_of_cells
        first_bounce = multiply_cells(form_factors, tracing.patches.albedo, sky_of_cells, tracing.threads)
        celled = first_bounce.mean(axis=1, keepdims=True)
        _, handed_on, last = follow_bounces(
            form_factors,
            hemisphere.factor,
            celled.copy(),
            plan.max_bounces,
            far_first=far_first.mean(axis=1, keepdims=True),
            first_light=first.sum(dtype=float),
            threads=tracing.threads,
            progress=partial(tell_bounces, tracing),
        )
        reflected = multiply_cells(form_factors, handed_on, hemisphere.factor, tracing.threads)
        reflected += first_bounce + far_first
        by_replicate += reflected
        evened = change_by_even_patches(tracing, hemisphere, first, celled, reflected)
        tell_bounces(tracing, plan.max_bounces + 1)
    return Diffuse(
        mean=merge @ by_replicate.mean(axis=1, dtype=float),
        standard_error=np.sqrt(merge.power(2) @ variance_of_replicates(by_replicate)),
        last=last,
        evened=evened,
    )


def tell_bounces(tracing, done):
    """Tell how far the reflections of the sky's light are; after the last one their errors take about as long."""
    tracing.progress("reflections of the sky", done, tracing.plan.max_bounces + 1, "bounces")


def change_by_even_patches(tracing, hemisphere, first, celled, reflected):
    """What the reflected light of all eligible surfaces would gain if each patch handed on its first light evenly.

    Light is uneven within the cells of patches too. As the error of such steps falls at least with their length, cells
    a quarter as long leave a third of this, or less.

    Parameters
    ----------
    first : (p, 1) float32
        Mean first light of the patches.
    celled : (p, 1) float32
        What arrives of it at first bounce, handed on cell by cell.
    reflected : (p, REPLICATES) float32
        All reflected light.

    Returns
    -------
    float
        As a share of their reflected light.
    """
    factor = radiosity_factor(tracing.patches, hemisphere.covered_share)
    even = multiply_cells(hemisphere.form_factors, factor, first, tracing.threads).mean(axis=1, keepdims=True)
    weight = tracing.eligible_area @ tracing.merge  # of the patches
    whole = float(weight @ reflected.mean(axis=1))
    return float(weight @ (even - celled)[:, 0]) / whole if whole > 0 else 0.0
