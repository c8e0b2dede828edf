"""Which patches hand on light that is uneven over them, and what the surfaces that count receive more or less by it.

What they receive of one patch is the sum over its cells of light times how much of it they see. Handed on evenly it
would be

    Σ_c mean(light) · seen_c      instead of      Σ_c light_c · seen_c

and the difference is, but for its sign, their covariance: 0 for a patch that is lit evenly or seen evenly.
"""

from dataclasses import replace

import numpy as np
from numba import njit

from ..sampling.random_numbers import mix
from ..sampling.sample_points import HEMISPHERE_REPLICATES
from ..scene.check_scene import check_scene
from .gather_context import prepare_gather
from .solve_radiosity import radiosity_factor, solve_radiosity
from .trace_gather import view_hemispheres

CELLS = 4
PILOTS = 2
FEWEST_SAMPLES, MOST_SAMPLES = 256, 4096  # of a patch, in each pilot
RAYS = 1 << 21  # of small scenes, in each pilot


def measure_unevenness(scene, request, progress):
    """What the reflected light of all eligible surfaces would gain if a patch handed on its first light evenly.

    Of the sky's light at its first reflection, measured by two pilots with random numbers of their own: what is chosen
    by the one can be judged by the other, which has other errors.

    Parameters
    ----------
    scene : Scene
    request : Request
    progress : callable
        See `core.progress`.

    Returns
    -------
    (t, PILOTS) float64
        Of each triangle, as a share of their reflected light.
    """
    check_scene(scene)
    count = len(scene.triangles)
    samples = int(np.clip(RAYS // max(count, 1), FEWEST_SAMPLES, MOST_SAMPLES))
    context = prepare_gather(scene, replace(request, samples=samples, estimator="gather"), progress)
    if not context.plan.reflections:
        return np.zeros((count, PILOTS))
    keys = context.patches.key
    pilots = [replace(context.patches, key=mix(keys ^ np.uint64(number))) for number in range(PILOTS)]
    gains, wholes = zip(*[gain_of_even_patches(replace(context, patches=patches)) for patches in pilots], strict=True)
    return np.stack(gains, axis=1) / (np.mean(wholes) or 1.0)


def gain_of_even_patches(context):
    """What all eligible surfaces gain of each patch, and all their reflected light: (p,) float64, float."""
    hemisphere, patches = view_hemispheres(context, CELLS), context.patches
    weight = context.eligible_area @ context.merge  # of the patches that receive
    seen = weigh_cells(hemisphere.form_factors, weight)
    light = patches.albedo[:, None] * hemisphere.element_sky
    factor = radiosity_factor(patches, hemisphere.covered_share)
    first = hemisphere.sky.mean(axis=1, keepdims=True)
    far_first = context.request.ground_albedo * hemisphere.far_ground.mean(axis=1, keepdims=True)
    reflected = solve_radiosity(hemisphere.form_factors, factor, first, far_first, context.plan.max_bounces)[0]
    return ((factor[:, None] * first - light) * seen).sum(axis=1), float(weight @ reflected[:, 0])


def weigh_cells(form_factors, weight):
    """How much of each cell the patches see: their weights times the shares of their rays that meet it.

    Parameters
    ----------
    form_factors : FormFactors
    weight : (p,) float64

    Returns
    -------
    (p, cells) float64
    """
    seen = np.zeros(form_factors.count * form_factors.cells)
    share = 1 / (HEMISPHERE_REPLICATES * form_factors.rays)
    for rows in form_factors.rows:
        entries = rows.chosen, rows.start, rows.key, rows.count
        add_weights(entries, form_factors.start_bits, weight * share, seen)
    return seen.reshape(form_factors.count, form_factors.cells)


@njit(nogil=True, cache=True)
def add_weights(rows, to_cell, weight, seen):
    """Add the weights of some patches to the cells that their rays meet, in the order of the rows."""
    chosen, start, key, count = rows
    for row in range(len(chosen)):
        for entry in range(start[row], start[row + 1]):
            seen[key[entry] >> to_cell] += weight[chosen[row]] * count[entry]
