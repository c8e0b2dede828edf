"""One light on the surfaces with its reflections and errors: the sky's dome, a source in it, or the
sum of all suns.

first light of patches and their elements ─► first reflection ─► further ones ─► mean of surfaces
     deviations of its replicates ─────────► the same way ──────────────────────► errors
"""

from dataclasses import dataclass

import numpy as np

from .form_factor_products import multiply_elements
from .light_errors import (
    SMALL_SHARE,
    LightError,
    errors_of_reflected,
    estimate_discretisation_error,
    propagate_deviations,
    reflect_elements,
)
from .solve_radiosity import bound_further, reflection_of, sum_reflections
from .transfer import variance_of_mean


@dataclass
class Light:
    """Irradiance of n surfaces of p patches: per DHI, in the unit of a source in the sky, or per
    DNI of all suns.
    """

    mean: np.ndarray  # (n,)
    error: LightError  # of the mean
    # (p, HEMISPHERE_REPLICATES) float32, all light of patches by each replicate of their rays
    by_replicate: np.ndarray
    last: float = 0.0  # share of the last reflection of all light
    cut: np.ndarray | None = None  # (n,) what further reflections bring at most; inf: no bound
    discretisation_error: float = 0.0  # of `estimate_discretisation_error`

    def add(self, values):
        """Add light by way of mirrors, glossy faces and glass, (r, n) of r replicates, with its
        variance.
        """
        self.mean = self.mean + values.mean(axis=0)
        self.error.own = self.error.own + variance_of_mean(values.T)


def solve_light(
    context, traced, first, far_ground=0.0, *, points=0.0, look=None, report=lambda done: None
):
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
    look : (p,) float, optional
        Light that one ray or point of a patch brings; 0 of patches in closed form.
    report : callable
        Called with the number of reflections done; their errors at the end take about as long as
        one.

    Returns
    -------
    Light
        Means of surfaces with their errors, light of patches by each replicate, and what further
        reflections would bring at most.
    """
    # by_replicate  light that arrives at patches by the rays of each replicate; first light to
    # begin with.
    to_surface, by_replicate = context.patch_to_surface, first.light.copy()
    light_of_surfaces = Light(None, None, by_replicate)
    transported, left = (
        np.zeros((to_surface.shape[0], by_replicate.shape[1])),
        np.zeros(to_surface.shape[0]),
    )
    if context.bounces:
        # First reflection from elements; further ones from patches, F(ρ …) until the last one.
        reflected, steps, variance = reflect_elements(context, traced, first.element)
        reflected += np.float32(far_ground) * traced.far_ground
        once = reflected.mean(axis=1, keepdims=True, dtype=float)
        passed_on = sum_reflections(
            reflection_of(context, traced), once, context.bounces - 1, report
        )
        radiosity = traced.factor * passed_on.astype(np.float32)
        # What is passed on arrives by all rays of the patch.
        reflected += multiply_elements(traced.form_factors, radiosity, context.threads)
        by_replicate += reflected
        # Last reflection's share, and a bound on all that would follow.
        arrived = reflected.mean(axis=1, dtype=float).sum()
        whole = first.light.mean(axis=1).sum(dtype=float) + arrived
        # nothing but for rounding where no light is left
        last = max(arrived - passed_on.sum(), 0.0)
        light_of_surfaces.last = last / whole if whole > 0 else 0.0
        last_one = np.maximum(reflected.mean(axis=1, dtype=float) - passed_on[:, 0], 0)
        light_of_surfaces.cut = to_surface @ bound_further(reflection_of(context, traced), last_one)
        # Errors: discretisation from the steps, and deviations that others' light brings.
        light_of_surfaces.discretisation_error = estimate_discretisation_error(
            context, steps, reflected
        )
        deviations = propagate_deviations(context, traced, first, reflected)
        transported, left = errors_of_reflected(to_surface, deviations, steps, variance)
    else:
        # Without reflections all of them are cut off: what they bring at most, wherever they end.
        light_of_surfaces.cut = np.full(
            to_surface.shape[0], _bound_all(context, first.light, far_ground)
        )
    # Mean of the surface, and its own noise; rays that all agree still have the noise of one of
    # them. A discretisation error that is small beside the mean counts as 0.
    light_of_surfaces.mean = to_surface @ by_replicate.mean(axis=1, dtype=float)
    own = to_surface.power(2) @ (points + variance_of_mean(by_replicate))
    if look is not None:
        # but rounding
        own = np.where(own <= 1e-14, np.maximum(own, _variance_of_one_look(to_surface, look)), own)
    light_of_surfaces.error = LightError(
        own, transported, np.where(np.abs(left) > SMALL_SHARE * light_of_surfaces.mean, left, 0)
    )
    return light_of_surfaces


def _bound_all(context, first, far_ground):
    """What all reflections together bring at most to any patch: float, inf where no bound exists.

    Nothing is brighter than the brightest albedo times the brightest light, (p, r) `first`, or the
    far ground.
    """
    brightest = max(float(context.patches.albedo.max(initial=0)), context.ground_albedo)
    once = max(brightest * float(first.max(initial=0)), far_ground)
    return 0.0 if once == 0 else once / (1 - brightest) if brightest < 1 else np.inf


def _variance_of_one_look(to_surface, look):
    """Variance of surfaces whose replicates all agree: as if one ray or point of them had met
    something else, (n,).

    They may agree by chance. One ray of four replicates that differs gives its own light,
    `look`, as the standard error of a patch; of the patches of a surface the mean of the squares
    counts.
    """
    known = to_surface.astype(bool).astype(float) @ (look > 0)
    return (to_surface.power(2) @ look**2) / np.maximum(known, 1)
