"""Reflections between patches: the radiosity equation, solved bounce by bounce with the matrix F of
form factors.

E₀      first light: visible sky, or visible share of the sun times the cosine of incidence
E₁      = F (ρ ∘ E₀) + F_far · ρ_ground · (1 for the sky, cos(zenith) for a sun)
E_{n+1} = F (ρ ∘ E_n)

Incoming light may be uneven over a patch: where a wall continues inside its neighbour's house, one
part is lit and the other dark, and rays from the dark part hit the dark parts of others. The cells
of a patch therefore re-emit its light in proportion to each cell's first reflection of sky light.
"""

from functools import partial

import numpy as np

from ..effects.rays import LIMITS
from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..settings.errors import InputError, check_array
from .form_factor_products import multiply, multiply_starts
from .traced import SKY_DOME

# below it the light of a patch is too uncertain to be divided by its open share
MINIMAL_OPEN_SHARE = 1 / 64


def radiosity_factor(patches, covered_share):
    """Factor from the mean irradiance of a patch to the radiosity of its open part.

    The irradiance of patches that lie partly under buildings includes zeros, but only their open
    part is visible.

    Returns
    -------
    (p,) float32
    """
    open_share = np.maximum(1 - covered_share, MINIMAL_OPEN_SHARE)
    return (patches.albedo / open_share).astype(np.float32)


def element_factors(context, traced):
    """Factors from the mean irradiance of a patch to the radiosity of each of its elements.

    Parameters
    ----------
    context : GatherContext
    traced : Traced

    Returns
    -------
    (p, elements) float32
        As `radiosity_factor` where no reflected sky light arrives, or hits do not tell where rays
        start.
    """
    patches, form_factors = context.patches, traced.form_factors
    whole, cells = radiosity_factor(patches, traced.covered_share)[:, None], form_factors.elements
    if form_factors.start_elements < cells or cells == 1:
        return np.repeat(whole, cells, axis=1)
    albedo = patches.albedo[:, None]
    arriving = multiply_starts(
        form_factors, albedo * traced.first[SKY_DOME].element, context.threads
    )
    arriving += np.float32(context.ground_albedo) * traced.element_far_ground
    total, open_share = arriving.sum(axis=1, keepdims=True), traced.open_share
    # Equally many rays start in each cell; the covered part of a cell re-emits nothing.
    scaled = arriving * np.divide(cells * albedo, total, out=np.zeros_like(total), where=total > 0)
    return np.where(
        total > 0,
        np.divide(scaled, open_share, out=np.zeros_like(scaled), where=open_share > 0),
        whole,
    )


def reflection_of(context, traced):
    """How the patches of a run light each other: a function of light, (p, s), that returns F ·
    (factor ∘ light).
    """
    return partial(multiply, traced.form_factors, traced.factor, threads=context.threads)


def solve_radiosity(form_factors, factor, first, far_first, max_bounces):
    """Irradiance of p patches under s sources by up to `max_bounces` diffuse reflections among
    them, (p, s) float64: arrays are checked, then summed up by `sum_reflections`.

    `factor`, (p,), is one `radiosity_factor` for each patch; `far_first`, (p, s), is what the far
    ground adds to the first reflection. Light before reflections is not in the result.

    Raises
    ------
    InputError
        If shapes do not match, light is negative or not finite, or form factors have patches that
        do not exist, with which the compiled loops would read out of bounds.
    """
    # Shapes and ranges, and keys of the matrix within it.
    count, sources = check_array("first", first, ("p", "s"), least=0).shape
    check_array("far_first", far_first, (count, sources), least=0)
    check_array("factor", factor, (count,), least=0, most=1 / MINIMAL_OPEN_SHARE)
    if form_factors.count != count:
        raise InputError(
            "form_factors",
            f"{form_factors.count} patches instead of {count}",
            "give those of this scene",
        )
    last = count * form_factors.elements * form_factors.start_elements * HEMISPHERE_REPLICATES - 1
    for rows in form_factors.rows:
        check_array(
            "key of form_factors",
            rows.key,
            (len(rows.key),),
            kind="i",
            least=0,
            most=last,
            row="entry",
        )
    # One reflection is a product with the matrix; further ones are summed.
    reflect = partial(
        multiply, form_factors, np.repeat(factor[:, None], form_factors.elements, axis=1)
    )
    return sum_reflections(
        reflect, reflect(np.ascontiguousarray(first, float)) + far_first, max_bounces
    )


def sum_reflections(reflect, arriving, count, report=lambda done: None):
    """Irradiance by reflections: E₁ + … + E_count.

    Parameters
    ----------
    reflect : callable
        Of `reflection_of`.
    arriving : (p, s) float32 or float64
        E₁, one column per light source. Overwritten.
    count : int
    report : callable
        Called with the number of reflections done.

    Returns
    -------
    (p, s) of the same type
    """
    if not count:
        return np.zeros_like(arriving)
    whole = light = arriving
    report(1)
    for done in range(2, count + 1):
        light = reflect(light)
        whole += light
        report(done)
    return whole


def find_bounces(reflect, light, weights, first):
    """How many reflections to follow until the solver's residual is small.

    What is left after n reflections is the next one and, with the ratio of the two, the geometric
    series that it begins: less than LIMITS.whole of the light of all receivers, and than
    LIMITS.group of the light of any group of them.

    Parameters
    ----------
    reflect : callable
        Of `reflection_of`.
    light : (p, k) float32
        What k columns of light bring at their first reflection.
    weights : (g, p) sparse
        Patches in the light of each group, the last one being all.
    first : (g, k) float64
        Light of the groups before reflections.

    Returns
    -------
    count : int
        At least 1, at most LIMITS.bounces.
    left : float
        Share of the light of all that is left, of the column with most.
    """
    limits = np.append(np.full(len(first) - 1, LIMITS.group), LIMITS.whole)[:, None]
    arrived, whole = weights @ light.astype(float), np.array(first)
    for count in range(1, LIMITS.bounces + 1):  # noqa: B007
        whole += arrived
        light = reflect(light)
        following = weights @ light.astype(float)
        ratio = np.divide(following, arrived, out=np.zeros(whole.shape), where=arrived > 0)
        series = following / (1 - np.minimum(ratio, 0.999))
        left = np.divide(series, whole, out=np.zeros(whole.shape), where=whole > 0)
        if (left <= limits).all():
            break
        arrived = following
    return count, float(left[-1].max(initial=0))


def bound_further(reflect, last, count=3):
    """What all reflections after the last one bring at most: (p,) float64, inf where no bound is
    found.

    `count` of them are followed. Form factors are not negative: where one step makes a light v at
    most r times as bright on every patch, F v ≤ r v, so does each further step, and all steps from
    F v on bring at most r / (1 - r) · F v. As v serve the light itself, and the light of a city
    whose patches were all equally bright at first, which is 0 nowhere that light arrives.

    Parameters
    ----------
    reflect : callable
        Of `reflection_of`.
    last : (p,) float64
        Light of the last reflection that was made.
    count : int
        At least 1.

    References
    ----------
    L. Collatz (1942), Einschließungssatz für die charakteristischen Zahlen von Matrizen.
    :doi:`10.1007/BF01180013`
    """
    light, further = np.stack([last, np.ones(len(last))], axis=1), np.zeros(len(last))
    for _ in range(count):
        # Both lights go one reflection further.
        before, light = light, reflect(light)
        further += light[:, 0]
    if not light[:, 0].any():
        return further
    tails = []
    for v, step in zip(before.T, light.T, strict=True):
        # ratio  r, how much brighter a step makes any patch at most; times  the light over that
        # step.
        ratio, times = _largest_ratio(step, v), _largest_ratio(light[:, 0], step)
        known = ratio < 1 and np.isfinite(times)
        tails.append(times * ratio / (1 - ratio) * step if known else np.full(len(last), np.inf))
    return further + np.minimum(*tails)


def _largest_ratio(one, other):
    """Largest of the ratios of two arrays that are not negative, 0 over 0 being none: float."""
    ratio = np.divide(one, other, out=np.where(one > 0, np.inf, 0.0), where=other > 0)
    return float(ratio.max(initial=0))


def covariance_of_replicates(one, other):
    """Covariance of the means of two kinds of light, (p, replicates) each, from the same
    independent replicates.

    Returns
    -------
    (p,) float64
    """
    count = one.shape[1]
    one, other = (light - light.mean(axis=1, keepdims=True, dtype=float) for light in (one, other))
    return (one * other).sum(axis=1) / ((count - 1) * count)
