"""Light of the sky, and of each source in it, on surfaces: what their rays meet, and what patches reflect of it."""

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
from .solve_radiosity import exchange_of, iterate_bounces, radiosity_factor
from .transfer import SourceLight, variance_of_mean

STAGE = "reflections of the sky"


@dataclass
class SkyLight:
    """Irradiance of n surfaces of p patches by the sky's dome, per DHI, or by a source in the sky, in its unit."""

    mean: np.ndarray  # (n,)
    error: LightError  # of the mean
    by_replicate: np.ndarray  # (p, HEMISPHERE_REPLICATES) float32, all light of patches by each replicate of their rays
    last: float = 0.0  # share of the last bounce of all light
    discretisation_error: float = 0.0  # of `estimate_discretisation_error`
    radiosity: np.ndarray | None = None  # (p, elements) float32, what further rounds see

    def add(self, values):
        """Add light by way of mirrors, glossy faces and glass, (r, n) of r replicates, with its variance."""
        self.mean = self.mean + values.mean(axis=0)
        self.error.own = self.error.own + variance_of_mean(values.T)


def solve_sky(context, traced, first, ground_albedo=0.0, report=None):
    """Light of the sky's dome or of a source in it, all reflections included.

    Parameters
    ----------
    context : GatherContext
    traced : Traced
    first : FirstLight
        Of all patches. Its elements are no longer needed afterwards.
    ground_albedo : float
        Of the far ground, if it is lit.
    report : callable, optional
        Called with the number of bounces done; estimating their errors at the end takes about as long as one.

    Returns
    -------
    SkyLight
    """
    patch_to_surface, by_replicate = context.patch_to_surface, first.light.copy()
    found = SkyLight(None, None, by_replicate)
    reflections = None
    if context.bounces:
        first_bounce, steps = reflect_elements(context, traced, first.element)
        first_bounce += np.float32(ground_albedo) * traced.far_ground
        _, propagated, found.last = iterate_bounces(
            exchange_of(context, traced),
            first_bounce.mean(axis=1, keepdims=True),
            context.bounces,
            first_light=first.light.mean(axis=1).sum(dtype=float),
            progress=report,
        )
        reflected = multiply_elements(traced.form_factors, propagated, traced.factor, context.threads) + first_bounce
        if context.rounds:
            found.radiosity = radiosity_of_elements(context, traced, first.element, propagated)
        by_replicate += reflected
        found.discretisation_error = estimate_discretisation_error(context, steps, reflected)
        deviations = Deviations(first.deviation, first.unit)
        transported = propagate_deviations(context, traced, deviations, reflected)
        light = patch_to_surface @ by_replicate.mean(axis=1, dtype=float)
        reflections = ReflectedError(light, transported, steps)
    found.mean = patch_to_surface @ by_replicate.mean(axis=1, dtype=float)
    found.error = errors_of_surfaces(patch_to_surface, variance_of_mean(by_replicate), reflections)
    return found


def radiosity_of_elements(context, traced, first, propagated):
    """Radiosity of the elements of patches: of first light, (p, elements), and of what they received after it, (p,)."""
    return context.patches.albedo[:, None] * first + propagated[:, None] * traced.factor


def solve_dome(context, traced, first):
    """Irradiance under the isotropic sky: SkyLight."""

    def report(done):
        context.progress(STAGE, done, context.bounces + 1, "bounces")

    if context.bounces:
        report(0)
    found = solve_sky(context, traced, first, context.request.ground_albedo, report)
    if context.bounces:
        report(context.bounces + 1)
    return found


def solve_source(context, traced, name, specular=None):
    """Light of a source in the sky on the surfaces: SkyLight, and the same as SourceLight.

    Parameters
    ----------
    name : str
    specular : SpecularLight, optional
        Light by way of mirrors, glossy faces and glass.
    """
    first = traced.first[name]
    found = solve_sky(context, traced, first)
    if specular:
        factor = radiosity_factor(context.patches, traced.covered_share)
        found.add(specular.of_source(name, factor * found.by_replicate.mean(axis=1)))
    view = context.patch_to_surface @ first.light.mean(axis=1, dtype=float)
    return found, SourceLight(view, found.mean, np.asarray(found.error.standard_error))
