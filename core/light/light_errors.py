"""Errors of surfaces' light: own noise, noise of the light that others re-emit, and discretisation.

Own noise          the hemisphere rays of a patch are four independent replicates; noise of patches
                   averages out
Transported        every patch that sees an element shares the error of its first light, and so do
                   all patches of a
                   surface: deviations of four replicates of it are followed through F like light
Discretisation     first light is re-emitted by elements, 16 per patch. Re-emitted from elements of
                   twice that length,
                   or evenly from whole patches, it arrives elsewhere:

    whole patches  ── first step ──►  4 elements  ── second step ──►  16 elements  ── remainder ──►  exact

Where light varies smoothly, each step is a quarter of the one before; where it ends abruptly, as at
the mouth of a narrow gap, half of it. So the remainder follows from the two steps: one third of the
second step, up to all of it.
"""

from dataclasses import dataclass

import numpy as np

from ..rays.sample_points import Cells
from .form_factor_products import multiply_columns, multiply_elements, multiply_steps
from .solve_radiosity import reflection_of
from .transfer import variance_of_mean

# of a surface's light: a smaller discretisation error is stated for the whole run only
SMALL_SHARE = 0.01


def propagate_deviations(context, traced, first, arrived):
    """Deviations of replicates of the light that patches receive from others.

    Linear in the deviations: the mean over the rays of one patch is combined with each replicate of
    others' light.

    Parameters
    ----------
    context : GatherContext
    traced : Traced
    first : FirstLight
    arrived : (p, HEMISPHERE_REPLICATES) float32
        What patches receive from others, by the rays of each replicate. Overwritten.

    Returns
    -------
    (p, HEMISPHERE_REPLICATES) float32
    """
    # First bounce: deviations of light that leaves others' elements, seen by all rays of a patch.
    reflect, albedo = reflection_of(context, traced), context.patches.albedo
    total = multiply_columns(
        traced.form_factors, albedo * first.unit, first.deviation, context.threads
    )
    # A patch's own rays see others' light with noise that all further bounces carry on.
    arrived -= arrived.mean(axis=1, keepdims=True)
    arrived += total
    # Each bounce multiplies by the albedo; it stops when little can be left of the first.
    brightest = float(albedo.max(initial=0))
    for bounce in range(2, context.bounces + 1):
        # Bounces that carry less than a tenth of a deviation are left out.
        if brightest**bounce < 0.1:
            break
        arrived = reflect(arrived)
        total += arrived
    return total


def reflect_elements(context, traced, first):
    """First bounce, and how much more light it would bring from cells of twice the length, and from
    whole patches.

    Parameters
    ----------
    context : GatherContext
    traced : Traced
    first : (p, cells) float32
        Light of the cells before reflections.

    Returns
    -------
    first_bounce : (p, HEMISPHERE_REPLICATES) float32
    steps : (p, 2) float32
        From cells of twice the length, and from whole patches over that. With four cells per patch
        there is no second step, so the first one is taken for both; with one cell both are 0.
    variance : (p,) float64
        Of the former, by the rays of the patch itself.
    """
    form_factors, albedo, threads = traced.form_factors, context.patches.albedo, context.threads
    count, cells = first.shape
    if cells == 1:
        first_bounce = multiply_elements(form_factors, albedo[:, None] * first, threads)
        return first_bounce, np.zeros((count, 2), np.float32), np.zeros(count)
    # Light of the elements, averaged over 2 × 2 of them, and over the whole patch; only where they
    # are open.
    open_share = (1 - shares_of_cells(traced.covered, cells)).astype(np.float32)
    whole = _average_groups(first, open_share, np.zeros(cells, int))
    halves = (
        _average_groups(first, open_share, Cells(round(np.sqrt(cells))).inside(2))
        if cells > 4
        else first
    )
    # The two steps of the picture above: from elements to twice the length, and on to the patch.
    steps = [halves - first, whole - halves] if cells > 4 else [whole - first] * 2
    # Light and both steps go through the matrix together: what each patch gets of them.
    radiosity = albedo[:, None, None] * np.stack([first, *steps], axis=2)
    first_bounce, by_replicate, received = multiply_steps(form_factors, radiosity, threads)
    return first_bounce, received, variance_of_mean(by_replicate)


def shares_of_cells(covered, cells):
    """Covered share of each of `cells` larger cells: (p, cells) float64, from (p, c) bool; 0 if
    they are not larger.
    """
    # Small cells that lie in each larger one, as a matrix that averages them.
    inside = Cells(round(np.sqrt(covered.shape[1]))).inside(round(np.sqrt(cells)))
    members = np.zeros((covered.shape[1], cells))
    members[np.arange(len(inside)), inside] = 1
    share, partly = np.zeros((len(covered), cells)), np.flatnonzero(covered.any(axis=1))
    share[partly] = covered[partly] @ (members / np.maximum(members.sum(axis=0), 1))
    return share


def _average_groups(light, open_share, groups):
    """Mean light of the open part of each group of cells, assigned to all of its cells: (p, cells)
    float32.
    """
    means = np.empty_like(light)
    for group in range(groups.max() + 1):
        members = groups == group
        weight = open_share[:, members]
        mean = (light[:, members] * weight).sum(axis=1) / np.maximum(
            weight.sum(axis=1), np.float32(1e-6)
        )
        means[:, members] = mean[:, None]
    return means


def remaining_error(steps, variance):
    """Error remaining after the last step, signed: positive where the estimate is too high.

    Parameters
    ----------
    steps : (n, 2) float
        Second and first step of surfaces.
    variance : (n,) float
        Of noise in them. It is subtracted from the square of the error. Steps that are lost in
        noise say nothing on how fast they decrease; light is then assumed to be smooth.

    Returns
    -------
    (n,) float64
    """
    # The ratio of the second step to the first tells how fast errors fall; noise pulls it towards
    # 1/4.
    second, first = steps.T
    squared = first**2 + variance
    # Ratio of successive steps: errors fall with the square or the first power of length.
    smooth, abrupt = 1 / 4, 1 / 2
    ratio = np.divide(
        second * first + smooth * variance,
        squared,
        out=np.full(len(steps), smooth),
        where=squared > 0,
    )
    # Steps fall like a geometric series with ratio q, so q/(1 - q) of the last one remains: 1/3 to
    # 1.
    ratio = np.clip(ratio, smooth, abrupt)
    return np.sign(second) * np.sqrt(np.maximum(second**2 - variance, 0)) * ratio / (1 - ratio)


def estimate_discretisation_error(context, steps, reflected):
    """Gain in reflected light of all eligible surfaces if each patch re-emitted its first light
    evenly.

    Parameters
    ----------
    steps : (p, 2) float32
        Of `reflect_elements`.
    reflected : (p, HEMISPHERE_REPLICATES) float32
        All reflected light.

    Returns
    -------
    float
        As a share of their reflected light.
    """
    weight = context.eligible_area @ context.patch_to_surface  # of the patches
    whole = float(weight @ reflected.mean(axis=1))
    return float(weight @ steps.sum(axis=1)) / whole if whole > 0 else 0.0


@dataclass
class LightError:
    """Error of the light of n surfaces, in three parts that combine over surfaces in different
    ways.
    """

    # (n,) variance from rays and points of the surface itself, independent of all other surfaces
    own: np.ndarray
    # (n, HEMISPHERE_REPLICATES) deviations of the light that others re-emit
    transported: np.ndarray
    # (n,) signed, error from light that is uneven within cells of patches; 0 where small
    discretisation: np.ndarray

    @property
    def standard_error(self):
        """Standard error from all three parts: (n,) float64."""
        return np.sqrt(self.own + variance_of_mean(self.transported) + self.discretisation**2)

    def scaled(self, factor):
        """Error of the light times a factor."""
        return LightError(
            factor**2 * self.own, factor * self.transported, factor * self.discretisation
        )


def errors_of_reflected(patch_to_surface, deviations, steps, variance):
    """The two parts of a LightError that reflections bring.

    Parameters
    ----------
    patch_to_surface : (n, p) sparse
        Averages patches over their surface.
    deviations : (p, HEMISPHERE_REPLICATES) float32
        Of `propagate_deviations`.
    steps, variance
        Of `reflect_elements`.

    Returns
    -------
    transported : (n, HEMISPHERE_REPLICATES) float64
    discretisation : (n,) float64
        Small ones included.
    """
    # Averages over surfaces: deviations with their signs, own noise by its square.
    transported = patch_to_surface @ deviations.astype(float)
    # The light of cells contains noise, and so do the steps, of the rays that look at it as well.
    noise = variance_of_mean(transported) + patch_to_surface.power(2) @ variance
    return transported, remaining_error(patch_to_surface @ steps.astype(float), noise)
