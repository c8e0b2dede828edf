"""Reflections between patches: the radiosity equation, solved bounce by bounce with the matrix F of form factors.

E₀      first light: visible sky, or visible share of the sun times the cosine of incidence
E₁      = F (ρ ∘ E₀) + F_far · ρ_ground · (1 for the sky, cos(zenith) for a sun)
E_{n+1} = F (ρ ∘ E_n)

Incoming light may be uneven over a patch: where a wall continues inside its neighbour's house, one part is lit and the
other dark, and rays from the dark part hit the dark parts of others. The cells of a patch therefore re-emit its light
in proportion to each cell's first reflection of sky light.
"""

import numpy as np
from numba import njit

from ..form_factors.form_factor_products import multiply, multiply_starts, multiply_visible, propagate
from ..form_factors.form_factors import check_form_factors
from ..settings.errors import check_array
from ..settings.threads import work_in_slices

MINIMAL_OPEN_SHARE = 1 / 64  # below it the light of a patch is too uncertain to be divided by its open share


def radiosity_factor(patches, covered_share):
    """Factor from the mean irradiance of a patch to the radiosity of its open part.

    The irradiance of patches that lie partly under buildings includes zeros, but only their open part is visible.

    Returns
    -------
    (p,) float32
    """
    open_share = np.maximum(1 - covered_share, MINIMAL_OPEN_SHARE)
    return (patches.albedo / open_share).astype(np.float32)


def radiosity_of_elements(context, hemisphere, first, propagated):
    """Radiosity of the cells of patches: of their first light, (p, cells), and of what they received after it, (p,)."""
    return context.patches.albedo[:, None] * first + propagated[:, None] * hemisphere.factor


def element_factors(context, rays, tallies):
    """Factors from the mean irradiance of a patch to the radiosity of each of its cells (elements).

    Parameters
    ----------
    context : GatherContext
    rays : HemisphereRays
    tallies : ElementTallies

    Returns
    -------
    (p, cells) float32
        That of `radiosity_factor` where no reflected sky light arrives, or keys of hits do not resolve start cells.
    """
    patches, form_factors = context.patches, rays.form_factors
    whole = radiosity_factor(patches, rays.covered_share)
    if form_factors.starts < form_factors.cells or form_factors.cells == 1:
        return np.repeat(whole[:, None], form_factors.cells, axis=1)
    factor = multiply_starts(form_factors, patches.albedo, tallies.sky.view, context.threads)
    of_ground = np.float32(context.request.ground_albedo), tallies.far_ground

    def share(rows):
        light = factor[rows], of_ground[0], of_ground[1][rows]
        weigh_elements(light, tallies.open_share[rows], patches.albedo[rows], whole[rows])

    work_in_slices(share, len(factor), context.threads)
    return factor


@njit(nogil=True, cache=True)
def weigh_elements(light, open_share, albedo, whole):
    """Turn the light that arrives at cells into the factors of `element_factors`, in place.

    Parameters
    ----------
    light : tuple of (p, cells) float32, float32 and (p, cells) float32
        What patches reflect to each cell, overwritten with the factors; albedo of the far ground; and its view factor
        from each cell.
    open_share : (p, cells) float32
    albedo, whole : (p,) float32
        `whole` is that of `radiosity_factor`.
    """
    arriving, ground_albedo, far_ground = light
    cells = arriving.shape[1]
    for patch in range(len(arriving)):
        total = np.float32(0)
        for cell in range(cells):
            arriving[patch, cell] += ground_albedo * far_ground[patch, cell]
            total += arriving[patch, cell]
        if total <= 0:
            arriving[patch] = whole[patch]
            continue
        # The same number of rays starts in each cell; the covered part of a cell re-emits nothing.
        scale = np.float32(cells) * albedo[patch] / total
        for cell in range(cells):
            share = open_share[patch, cell]
            arriving[patch, cell] = scale * arriving[patch, cell] / share if share > 0 else 0


def solve_radiosity(form_factors, factor, first, far_first, max_bounces):
    """Irradiance by reflections: `iterate_bounces` for unchecked arrays and one `factor`, (p,), of
    `radiosity_factor` for each patch.

    Raises
    ------
    InputError
        If shapes do not match, or light is negative or not finite.
    """
    count, sources = check_array("first", first, ("p", "s"), least=0).shape
    check_array("far_first", far_first, (count, sources), least=0)
    check_array("factor", factor, (count,), least=0, most=1 / MINIMAL_OPEN_SHARE)
    check_form_factors(form_factors, count)
    factor = np.repeat(factor[:, None], form_factors.cells, axis=1)
    arriving = multiply(form_factors, factor, first)
    return iterate_bounces(form_factors, factor, arriving, max_bounces, far_first=far_first, first_light=first.sum())


def iterate_bounces(
    form_factors,
    factor,
    arriving,
    max_bounces,
    *,
    far_first=None,
    first_light=0.0,
    weight=None,
    threads=1,
    progress=None,
):
    """Irradiance by reflections.

    Parameters
    ----------
    form_factors : FormFactors
    factor : (p, cells) float32
        Of `element_factors`.
    arriving : (p, s) float32
        F (ρ ∘ E₀), one column per light source. Overwritten.
    max_bounces : int
    far_first : (p, s) float32, optional
        What the far ground adds at the first bounce.
    first_light : float
        Sum of E₀ over all patches and, weighted, over the light sources; for `last`.
    weight : (s,) float32, optional
        Weight of each light source in sums over them; 1 if not given.
    threads : int
    progress : callable, optional
        Called with the number of bounces done.

    Returns
    -------
    reflected : (p, s) float32
        The sum of E₁ to E_max.
    propagated : (p,) float32
        E₁ + … + E_{max-1}, the light re-emitted after the first bounce, summed with `weight`.
    last : float
        Share of E_max of all light, to judge what is cut off after the last bounce.
    """
    if not max_bounces:
        return np.zeros_like(arriving), np.zeros(len(arriving), np.float32), 0.0
    weight = np.ones(arriving.shape[1], np.float32) if weight is None else weight
    propagated, whole, last = np.zeros(len(arriving), np.float32), float(first_light), 0.0
    # The light of the first bounce is not needed after the second: its array accumulates the sum of all.
    reflected, light, spare = arriving, arriving, None
    arrived = np.empty(len(arriving), np.float32)
    for bounce in range(max_bounces):
        if bounce == 0:
            weigh_light(light, far_first, (weight, arrived), threads)
        elif bounce > 1 and bounce + 1 == max_bounces:
            propagate(form_factors, factor, light, (weight, arrived), threads, total=reflected)
        else:
            product = propagate(form_factors, factor, light, (weight, arrived), threads, out=spare)
            light, spare = product, None if light is reflected else light
            add_in_slices(reflected, light, threads)
        last = arrived.sum(dtype=float)
        whole += last
        if bounce + 1 < max_bounces:
            propagated += arrived
        if progress is not None:
            progress(bounce + 1)
    return reflected, propagated, last / whole if whole > 0 else 0.0


def add_in_slices(total, light, threads):
    """Add one array of light, (p, s) float32, to another."""

    def add(rows):
        total[rows] += light[rows]

    work_in_slices(add, len(total), threads)


def weigh_light(light, far_first, sums, threads):
    """Add the light from the far ground to that of the first bounce, and write its sums as in `propagate`."""
    weight, arrived = sums

    def weigh(rows):
        if far_first is not None:
            light[rows] += far_first[rows]
        weigh_rows(light[rows], weight, arrived[rows])

    work_in_slices(weigh, len(light), threads)


@njit(nogil=True, cache=True, fastmath={"reassoc"})
def weigh_rows(light, weight, arrived):
    """Weighted sums of rows, written into `arrived`."""
    for row in range(len(light)):
        weighted = np.float32(0)
        for column in range(light.shape[1]):
            weighted += light[row, column] * weight[column]
        arrived[row] = weighted


def variance_of_replicates(values):
    """Variance of the mean of independent replicates.

    Parameters
    ----------
    values : (p, replicates) float

    Returns
    -------
    (p,) float64
    """
    return values.astype(float).var(axis=1, ddof=1) / values.shape[1]


def covariance_of_replicates(one, other):
    """Covariance of the means of two kinds of light, (p, replicates) each, from the same independent replicates.

    Returns
    -------
    (p,) float64
    """
    count = one.shape[1]
    one, other = (light - light.mean(axis=1, keepdims=True, dtype=float) for light in (one, other))
    return (one * other).sum(axis=1) / ((count - 1) * count)


def reflect_block(context, hemisphere, light, suns, report):
    """Reflections of one block of suns, without the first bounce off the far ground.

    Parameters
    ----------
    light : SunLight
        Of the b suns of the block.
    suns : SunBlock
    report : callable
        Called with the number of bounces done.

    Returns
    -------
    reflected : (p, b) float32
    propagated : (p,) float32
        As in `iterate_bounces`, with the suns' weights.
    last : float
    """
    directions, weights = suns
    form_factors, threads = hemisphere.form_factors, context.threads
    far_first = None
    if context.plan.far_ground:
        lit_ground = np.maximum(directions[:, 2], 0) * np.float32(context.request.ground_albedo)
        far_first = np.outer(hemisphere.far_ground.mean(axis=1), lit_ground)
    visible = directions, light.visible_elements
    albedo = context.patches.albedo * light.point_weight
    arriving = multiply_visible(form_factors, albedo, context.patches.normal, visible, threads)
    reflected, propagated, last = iterate_bounces(
        form_factors,
        hemisphere.factor,
        arriving,
        context.plan.max_bounces,
        far_first=far_first,
        first_light=light.by_point.mean(axis=1).sum(dtype=float),
        weight=weights,
        threads=threads,
        progress=report,
    )
    if far_first is not None:
        subtract_far_ground(reflected, far_first, threads)
    return reflected, propagated, last


def subtract_far_ground(reflected, far_first, threads):
    """Subtract the first bounce off the far ground from all reflected light, (p, s), in place."""

    def subtract(rows):
        reflected[rows] -= far_first[rows]
        np.maximum(reflected[rows], 0, out=reflected[rows])

    work_in_slices(subtract, len(reflected), threads)
