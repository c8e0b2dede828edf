"""How sure the light of surfaces is, part by part: own noise, light that others pass on, and the size of patches."""

from dataclasses import dataclass

import numpy as np

from ..sampling.sample_points import HEMISPHERE_REPLICATES
from .patch_size_errors import light_left
from .solve_radiosity import variance_of_replicates

SMALL_SHARE = 0.01  # of a surface's light: less by the size of patches counts in the budget of the run alone


@dataclass
class LightError:
    """Of the light of n surfaces; each part of its kind adds up over surfaces in its own way."""

    own: np.ndarray  # (n,) variance by rays and points of the surface itself, independent of all other surfaces
    passed_on: np.ndarray  # (n, HEMISPHERE_REPLICATES) deviations of the light that others pass on
    discretisation: np.ndarray  # (n,) with a sign, what light uneven within cells of patches adds; 0 where little

    @property
    def standard_error(self):
        """Of all three together: (n,) float64."""
        return np.sqrt(self.own + variance_of_replicates(self.passed_on) + self.discretisation**2)

    def scaled(self, factor):
        """The same of light that is so many times as much."""
        return LightError(factor**2 * self.own, factor * self.passed_on, factor * self.discretisation)


def errors_of_surfaces(merge, variance, reflections=None):
    """Errors of surfaces from those of their patches.

    Parameters
    ----------
    merge : (n, p) sparse
        Averages patches over their surface.
    variance : (p,) float
        By rays and points of each patch itself.
    reflections : tuple, optional
        Where something reflects: all light of the surfaces, (n,); of the patches what `pass_on` and `steps_of_cells`
        tell.

    Returns
    -------
    LightError
    """
    own = merge.power(2) @ variance
    if reflections is None:
        none = np.zeros((merge.shape[0], HEMISPHERE_REPLICATES))
        return LightError(own, none, none[:, 0])
    light, passed_on, steps = reflections
    passed_on = merge @ passed_on.astype(float)
    # The light of cells is noise in part, and so are the steps.
    left = light_left(merge @ steps.astype(float), variance_of_replicates(passed_on))
    return LightError(own, passed_on, np.where(np.abs(left) > SMALL_SHARE * light, left, 0))
