"""Discretisation error of reflected light, from the finite size of patches and their cells.

First light is re-emitted cell by cell, 16 per patch. Re-emitted from cells of twice that length, or evenly from whole
patches, it arrives elsewhere:

    whole patches  ── first step ──►  4 cells  ── second step ──►  16 cells  ── remainder ──►  exact distribution

Where light varies smoothly, each step is a quarter of the one before; where it ends abruptly, as at the mouth of a
narrow gap, half of it. So the remainder follows from the two steps: one third of the second step, up to all of it.
"""

from typing import NamedTuple

import numpy as np

from ..form_factors.form_factor_products import multiply_elements, multiply_steps
from ..rays.sample_points import cells_inside
from .direct_errors import shares_of_cells
from .solve_radiosity import variance_of_replicates

SMOOTH, ABRUPT = 1 / 4, 1 / 2  # ratio of successive steps: errors fall with the square or the first power of length


class Steps(NamedTuple):
    """What p patches would receive more at first bounce."""

    received: np.ndarray  # (p, 2) float32, from cells of twice the length; and from whole patches, over that
    variance: np.ndarray  # (p,) float64, of the former, by the rays of the patch itself


def reflect_cells(context, hemisphere, first):
    """First bounce, and how much more light it would bring from cells of twice the length, and from whole patches.

    Parameters
    ----------
    context : GatherContext
    hemisphere : Hemisphere
    first : (p, cells) float32
        Light of the cells before reflections.

    Returns
    -------
    first_bounce : (p, HEMISPHERE_REPLICATES) float32
    steps : Steps
        With four cells per patch there is no second step, so the first one is taken for both; with one cell both are 0.
    """
    form_factors, albedo, threads = hemisphere.form_factors, context.patches.albedo, context.threads
    count, cells = first.shape
    if cells == 1:
        none = Steps(np.zeros((count, 2), np.float32), np.zeros(count))
        return multiply_elements(form_factors, albedo, first, threads), none
    open_share = (1 - shares_of_cells(hemisphere.covered, cells)).astype(np.float32)
    whole = average_groups(first, open_share, np.zeros(cells, int))
    halves = average_groups(first, open_share, cells_inside(round(np.sqrt(cells)), 2)) if cells > 4 else first
    steps = [halves - first, whole - halves] if cells > 4 else [whole - first] * 2
    light = np.stack([first, *steps], axis=2)
    first_bounce, by_replicate, received = multiply_steps(form_factors, albedo, light, threads)
    return first_bounce, Steps(received, variance_of_replicates(by_replicate))


def average_groups(light, open_share, groups):
    """Mean light of the open part of each group of cells, assigned to all of its cells: (p, cells) float32."""
    found = np.empty_like(light)
    for group in range(groups.max() + 1):
        members = groups == group
        weight = open_share[:, members]
        mean = (light[:, members] * weight).sum(axis=1) / np.maximum(weight.sum(axis=1), np.float32(1e-6))
        found[:, members] = mean[:, None]
    return found


def remaining_error(steps, variance):
    """Error remaining after the last step, signed: positive where the estimate is too high.

    Parameters
    ----------
    steps : (n, 2) float
        Second and first step of surfaces.
    variance : (n,) float
        Of noise in them. It is subtracted from the square of the error. Steps that are lost in noise say nothing on how
        fast they decrease; light is then assumed to be smooth.

    Returns
    -------
    (n,) float64
    """
    second, first = steps.T
    squared = first**2 + variance
    ratio = np.divide(second * first + SMOOTH * variance, squared, out=np.full(len(steps), SMOOTH), where=squared > 0)
    ratio = np.clip(ratio, SMOOTH, ABRUPT)
    return np.sign(second) * np.sqrt(np.maximum(second**2 - variance, 0)) * ratio / (1 - ratio)


def estimate_discretisation_error(context, steps, reflected):
    """Gain in reflected light of all eligible surfaces if each patch re-emitted its first light evenly.

    Parameters
    ----------
    steps : Steps
    reflected : (p, HEMISPHERE_REPLICATES) float32
        All reflected light.

    Returns
    -------
    float
        As a share of their reflected light.
    """
    weight = context.eligible_area @ context.merge  # of the patches
    whole = float(weight @ reflected.mean(axis=1))
    return float(weight @ steps.received.sum(axis=1)) / whole if whole > 0 else 0.0
