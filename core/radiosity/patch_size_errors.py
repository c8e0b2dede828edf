"""What the size of patches does to the light that they hand on.

First light is handed on cell by cell, 16 to a patch. Handed on from cells of twice that length, and evenly from whole
patches, it arrives elsewhere:

    whole patches  ── first step ──►  4 cells  ── second step ──►  16 cells  ── left ──►  light as it lies

Where light changes smoothly each step is a quarter of the one before; where it ends abruptly, as at the mouth of a
narrow gap, half of it. So the two steps tell what is left: a third of the second step, up to all of it.
"""

import numpy as np

from ..sampling.sample_points import cells_inside
from .direct_errors import shares_of_cells
from .form_factor_products import multiply_columns

SMOOTH, ABRUPT = 1 / 4, 1 / 2  # of a step is the next one, as errors fall with the square or the first power of length


def steps_of_cells(context, hemisphere, first):
    """What patches would receive more at first bounce from cells of twice the length, and then from whole patches.

    Parameters
    ----------
    context : GatherContext
    hemisphere : Hemisphere
    first : (p, cells) float32
        First light of the cells.

    Returns
    -------
    (p, 2) float32
        The second step and the first one. With four cells to a patch there is no second step, the first one counts as
        both; with one cell there is none.
    """
    count, cells = first.shape
    if cells == 1:
        return np.zeros((count, 2), np.float32)
    open_share = (1 - shares_of_cells(hemisphere.covered, cells)).astype(np.float32)
    whole = even_out(first, open_share, np.zeros(cells, int))
    halves = even_out(first, open_share, cells_inside(round(np.sqrt(cells)), 2)) if cells > 4 else first
    steps = np.stack([halves - first, whole - halves] if cells > 4 else [whole - first] * 2, axis=2)
    return multiply_columns(hemisphere.form_factors, context.patches.albedo, steps, context.threads)


def even_out(light, open_share, groups):
    """Mean light of the open part of each group of cells, given to all of its cells: (p, cells) float32."""
    found = np.empty_like(light)
    for group in range(groups.max() + 1):
        members = groups == group
        weight = open_share[:, members]
        mean = (light[:, members] * weight).sum(axis=1) / np.maximum(weight.sum(axis=1), np.float32(1e-6))
        found[:, members] = mean[:, None]
    return found


def light_left(steps, variance):
    """What is left after the last step, with the sign of what gather has too much.

    Parameters
    ----------
    steps : (n, 2) float
        Second and first step of surfaces.
    variance : (n,) float
        Of noise in them. It is taken out of the square of what is left; and steps that drown in it say nothing on how
        they fall: then light is taken to be smooth.

    Returns
    -------
    (n,) float64
    """
    second, first = steps.T
    told = first**2 + variance
    ratio = np.divide(second * first + SMOOTH * variance, told, out=np.full(len(steps), SMOOTH), where=told > 0)
    ratio = np.clip(ratio, SMOOTH, ABRUPT)
    return np.sign(second) * np.sqrt(np.maximum(second**2 - variance, 0)) * ratio / (1 - ratio)


def estimate_discretisation_error(context, steps, reflected):
    """What the reflected light of all eligible surfaces would gain if each patch handed on its first light evenly.

    Parameters
    ----------
    steps : (p, 2) float32
        Of `steps_of_cells`.
    reflected : (p, HEMISPHERE_REPLICATES) float32
        All reflected light.

    Returns
    -------
    float
        As a share of their reflected light.
    """
    weight = context.eligible_area @ context.merge  # of the patches
    whole = float(weight @ reflected.mean(axis=1))
    return float(weight @ steps.sum(axis=1)) / whole if whole > 0 else 0.0
