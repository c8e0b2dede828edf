"""Reflections between patches: the radiosity equation, solved bounce by bounce with the matrix F of form factors.

E₀      first light: visible sky, or visible share of the sun times the cosine of incidence
E₁      = F (ρ ∘ E₀) + F_far · ρ_ground · (1 for the sky, cos(zenith) for a sun)
E_{n+1} = F (ρ ∘ E_n)

Incoming light may be uneven over a patch: where a wall continues inside its neighbour's house, one part is lit and the
other dark, and rays from the dark part hit the dark parts of others. The cells of a patch therefore re-emit its light
in proportion to each cell's first reflection of sky light.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from ..effects.rays import GROUP_LIMIT, MOST_BOUNCES, WHOLE_LIMIT
from ..settings.errors import check_array
from ..settings.threads import work_in_slices
from .form_factor_products import multiply, multiply_starts
from .form_factors import FormFactors, check_form_factors
from .traced import SKY_DOME

LARGEST_RATIO = 0.999
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


def element_factors(context, traced):
    """Factors from the mean irradiance of a patch to the radiosity of each of its elements.

    Parameters
    ----------
    context : GatherContext
    traced : Traced

    Returns
    -------
    (p, elements) float32
        That of `radiosity_factor` where no reflected sky light arrives, or hits do not tell where rays start.
    """
    patches, form_factors = context.patches, traced.form_factors
    whole = radiosity_factor(patches, traced.covered_share)
    if form_factors.starts < form_factors.cells or form_factors.cells == 1:
        return np.repeat(whole[:, None], form_factors.cells, axis=1)
    factor = multiply_starts(form_factors, patches.albedo, traced.first[SKY_DOME].element, context.threads)
    ground_albedo = np.float32(context.request.ground_albedo)

    def share(rows):
        light = factor[rows], ground_albedo, traced.element_far_ground[rows]
        weigh_elements(light, traced.open_share[rows], patches.albedo[rows], whole[rows])

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


@dataclass
class Exchange:
    """How patches light each other."""

    form_factors: FormFactors
    factor: np.ndarray  # (p, elements) float32, of `element_factors`
    threads: int = 1

    def reflect(self, light, **kept):
        """F · (factor ∘ light) of (p, s) float32; what is kept as of `multiply`."""
        return multiply(self.form_factors, self.factor, light, self.threads, **kept)


def exchange_of(context, traced):
    """How the patches of a run light each other: Exchange."""
    return Exchange(traced.form_factors, traced.factor, context.threads)


def solve_radiosity(form_factors, factor, first, far_first, max_bounces):
    """Irradiance by reflections, (p, s) float32: `sum_reflections` for unchecked arrays and one `factor`, (p,), of
    `radiosity_factor` for each patch; `far_first`, (p, s), is what the far ground adds to the first reflection.

    Raises
    ------
    InputError
        If shapes do not match, or light is negative or not finite.
    """
    count, sources = check_array("first", first, ("p", "s"), least=0).shape
    check_array("far_first", far_first, (count, sources), least=0)
    check_array("factor", factor, (count,), least=0, most=1 / MINIMAL_OPEN_SHARE)
    check_form_factors(form_factors, count)
    exchange = Exchange(form_factors, np.repeat(factor[:, None], form_factors.cells, axis=1))
    return sum_reflections(exchange, exchange.reflect(first) + far_first, max_bounces)


def sum_reflections(exchange, arriving, count, report=lambda done: None):
    """Irradiance by reflections: E₁ + … + E_count.

    Parameters
    ----------
    exchange : Exchange
    arriving : (p, s) float32
        E₁, one column per light source. Overwritten.
    count : int
    report : callable
        Called with the number of reflections done.

    Returns
    -------
    (p, s) float32
    """
    if not count:
        return np.zeros_like(arriving)
    # The light of the first reflection is not needed after the second: its array takes the sum of all.
    whole, light, spare = arriving, arriving, None
    report(1)
    for done in range(2, count + 1):
        if 2 < done == count:
            exchange.reflect(light, total=whole)
        else:
            product = exchange.reflect(light, out=spare)
            light, spare = product, None if light is whole else light
            add_in_slices(whole, light, exchange.threads)
        report(done)
    return whole


def find_bounces(exchange, light, weights, first):
    """How many reflections to follow until the solver's residual is small.

    What is left after n reflections is the next one and, with the ratio of the two, the geometric series that it
    begins: less than WHOLE_LIMIT of the light of all receivers, and than GROUP_LIMIT of that of any group of them.

    Parameters
    ----------
    exchange : Exchange
    light : (p, k) float32
        What k columns of light bring at their first reflection.
    weights : (g, p) sparse
        Patches in the light of each group, the last one being all.
    first : (g, k) float64
        Light of the groups before reflections.

    Returns
    -------
    count : int
        At least 1, at most MOST_BOUNCES.
    left : float
        Share of the light of all that is left, of the column with most.
    """
    limits = np.append(np.full(len(first) - 1, GROUP_LIMIT), WHOLE_LIMIT)[:, None]
    arrived, whole = weights @ light.astype(float), np.array(first)
    for count in range(1, MOST_BOUNCES + 1):  # noqa: B007
        whole += arrived
        light = exchange.reflect(light)
        following = weights @ light.astype(float)
        ratio = np.divide(following, arrived, out=np.zeros(whole.shape), where=arrived > 0)
        series = following / (1 - np.minimum(ratio, LARGEST_RATIO))
        left = np.divide(series, whole, out=np.zeros(whole.shape), where=whole > 0)
        if (left <= limits).all():
            break
        arrived = following
    return count, float(left[-1].max(initial=0))


def add_in_slices(total, light, threads):
    """Add one array of light, (p, s) float32, to another."""

    def add(rows):
        total[rows] += light[rows]

    work_in_slices(add, len(total), threads)


def covariance_of_replicates(one, other):
    """Covariance of the means of two kinds of light, (p, replicates) each, from the same independent replicates.

    Returns
    -------
    (p,) float64
    """
    count = one.shape[1]
    one, other = (light - light.mean(axis=1, keepdims=True, dtype=float) for light in (one, other))
    return (one * other).sum(axis=1) / ((count - 1) * count)
