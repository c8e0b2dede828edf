"""One light on the surfaces with its reflections and errors: the sky's dome, a source in it, or the sum of all suns.

first light of patches and their elements ─► first reflection ─► further ones ─► mean of surfaces
     deviations of its replicates ─────────► the same way ──────────────────────► errors
"""

from dataclasses import dataclass

import numpy as np

from .form_factor_products import multiply_elements
from .light_errors import (
    Deviations,
    LightError,
    ReflectedError,
    errors_of_surfaces,
    estimate_discretisation_error,
    propagate_deviations,
    reflect_elements,
)
from .solve_radiosity import exchange_of, sum_reflections
from .transfer import variance_of_mean


@dataclass
class Light:
    """Irradiance of n surfaces of p patches: per DHI, in the unit of a source in the sky, or per DNI of all suns."""

    mean: np.ndarray  # (n,)
    error: LightError  # of the mean
    by_replicate: np.ndarray  # (p, HEMISPHERE_REPLICATES) float32, all light of patches by each replicate of their rays
    last: float = 0.0  # share of the last reflection of all light
    discretisation_error: float = 0.0  # of `estimate_discretisation_error`

    def add(self, values):
        """Add light by way of mirrors, glossy faces and glass, (r, n) of r replicates, with its variance."""
        self.mean = self.mean + values.mean(axis=0)
        self.error.own = self.error.own + variance_of_mean(values.T)


def solve_light(context, traced, first, far_ground=0.0, *, points=0.0, report=lambda done: None):
    """One light on the surfaces, all reflections included.

    Parameters
    ----------
    context : GatherContext
    traced : Traced
    first : FirstLight
        Of all patches.
    far_ground : float
        Radiosity of the far ground.
    points : (p,) float, optional
        Variance of first light that its replicates do not tell, as of shadow points.
    report : callable
        Called with the number of reflections done; their errors at the end take about as long as one.

    Returns
    -------
    Light
    """
    to_surface, by_replicate, reflections = context.patch_to_surface, first.light.copy(), None
    found = Light(None, None, by_replicate)
    if context.bounces:
        reflected, steps = reflect_elements(context, traced, first.element)
        reflected += np.float32(far_ground) * traced.far_ground
        once = reflected.mean(axis=1, keepdims=True)
        passed_on = sum_reflections(exchange_of(context, traced), once, context.bounces - 1, report)
        reflected += multiply_elements(traced.form_factors, passed_on[:, 0], traced.factor, context.threads)
        by_replicate += reflected
        arrived = reflected.mean(axis=1).sum(dtype=float)
        whole = first.light.mean(axis=1).sum(dtype=float) + arrived
        found.last = (arrived - passed_on.sum(dtype=float)) / whole if whole > 0 else 0.0
        found.discretisation_error = estimate_discretisation_error(context, steps, reflected)
        transported = propagate_deviations(context, traced, Deviations(first.deviation, first.unit), reflected)
        light = to_surface @ by_replicate.mean(axis=1, dtype=float)
        reflections = ReflectedError(light, transported, steps)
    found.mean = to_surface @ by_replicate.mean(axis=1, dtype=float)
    found.error = errors_of_surfaces(to_surface, points + variance_of_mean(by_replicate), reflections)
    return found
