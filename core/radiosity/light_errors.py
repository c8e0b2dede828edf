"""Parts of the error of surfaces' light: own noise, noise of the light that others re-emit, and discretisation."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..transfer.patch_light import Uneven
from .patch_size_errors import Steps, remaining_error
from .solve_radiosity import variance_of_replicates

SMALL_SHARE = 0.01  # of a surface's light: a smaller discretisation error is stated for the whole run only


@dataclass
class LightError:
    """Error of the light of n surfaces, in three parts that combine over surfaces in different ways."""

    own: np.ndarray  # (n,) variance from rays and points of the surface itself, independent of all other surfaces
    passed_on: np.ndarray  # (n, HEMISPHERE_REPLICATES) deviations of the light that others re-emit
    discretisation: np.ndarray  # (n,) signed, error from light that is uneven within cells of patches; 0 where small
    uneven: Uneven | None = None  # what `discretisation` is told from

    @property
    def standard_error(self):
        """Standard error from all three parts: (n,) float64."""
        return np.sqrt(self.own + variance_of_replicates(self.passed_on) + self.discretisation**2)

    def scaled(self, factor):
        """Error of the light times a factor."""
        return LightError(factor**2 * self.own, factor * self.passed_on, factor * self.discretisation, self.uneven)


class ReflectedError(NamedTuple):
    """What the errors of reflected light are estimated from."""

    light: np.ndarray  # (n,) all light of the surfaces
    deviations: np.ndarray  # (p, HEMISPHERE_REPLICATES), of `propagate_deviations`
    steps: Steps  # of `reflect_cells`


def errors_of_surfaces(merge, variance, reflections=None):
    """Errors of surfaces from those of their patches.

    Parameters
    ----------
    merge : (n, p) sparse
        Averages patches over their surface.
    variance : (p,) float
        From rays and points of each patch itself.
    reflections : ReflectedError, optional
        None if nothing reflects.

    Returns
    -------
    LightError
    """
    own = merge.power(2) @ variance
    if reflections is None:
        none = np.zeros((merge.shape[0], HEMISPHERE_REPLICATES))
        return LightError(own, none, none[:, 0])
    passed_on = merge @ reflections.deviations.astype(float)
    steps = reflections.steps
    received = merge @ steps.received.astype(float)
    uneven = Uneven(received, merge.power(2) @ steps.variance, np.asarray(reflections.light))
    return LightError(own, passed_on, patch_size_error(uneven, passed_on), uneven)


def patch_size_error(uneven, passed_on):
    """Discretisation error of surfaces, signed, 0 where small: (n,) float64.

    Parameters
    ----------
    uneven : Uneven
    passed_on : (n, HEMISPHERE_REPLICATES) float64
        The light of cells contains noise, and so do the steps, of the rays that look at it as well.
    """
    left = remaining_error(uneven.received, variance_of_replicates(passed_on) + uneven.variance)
    return np.where(np.abs(left) > SMALL_SHARE * uneven.light, left, 0)
