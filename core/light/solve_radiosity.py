"""Reflections between patches: the radiosity equation, solved bounce by bounce with the matrix F of form factors.

E₀      first light: visible sky, or visible share of the sun times the cosine of incidence
E₁      = F (ρ ∘ E₀) + F_far · ρ_ground · (1 for the sky, cos(zenith) for a sun)
E_{n+1} = F (ρ ∘ E_n)

First light is re-emitted by the elements of a patch where it arrived, reflected light by all of them alike but those
that are covered: where a wall continues inside its neighbour's house, rays from the dark part hit dark parts of others.
"""

from dataclasses import dataclass

import numpy as np

from ..effects.rays import GROUP_LIMIT, MOST_BOUNCES, WHOLE_LIMIT
from ..rays.sample_points import cells_inside
from ..settings.errors import check_array
from .form_factor_products import multiply
from .form_factors import FormFactors, check_form_factors

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


def element_factors(patches, covered, elements):
    """Factors from the mean irradiance of a patch to the radiosity of each of its elements, for reflected light.

    Parameters
    ----------
    patches : Patches
    covered : (p, c) bool
        Cells that lie inside or under something.
    elements : int

    Returns
    -------
    (p, elements) float32
        That of `radiosity_factor`; 0 for elements that are wholly covered.
    """
    whole = radiosity_factor(patches, covered.mean(axis=1, dtype=np.float32))
    return np.where(shares_of_cells(covered, elements) < 1, whole[:, None], np.float32(0))


def shares_of_cells(covered, cells):
    """Covered share of each of `cells` larger cells: (p, cells) float64, from (p, c) bool; 0 if they are not larger."""
    inside = cells_inside(round(np.sqrt(covered.shape[1])), round(np.sqrt(cells)))
    members = np.zeros((covered.shape[1], cells))
    members[np.arange(len(inside)), inside] = 1
    share, partly = np.zeros((len(covered), cells)), np.flatnonzero(covered.any(axis=1))
    share[partly] = covered[partly] @ (members / np.maximum(members.sum(axis=0), 1))
    return share


@dataclass
class Exchange:
    """How patches light each other."""

    form_factors: FormFactors
    factor: np.ndarray  # (p, elements) float32, of `element_factors`
    threads: int = 1

    def reflect(self, light):
        """F · (factor ∘ light) of (p, s) float32."""
        return multiply(self.form_factors, self.factor, light, self.threads)


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
    whole = light = arriving
    report(1)
    for done in range(2, count + 1):
        light = exchange.reflect(light)
        whole += light
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


def covariance_of_replicates(one, other):
    """Covariance of the means of two kinds of light, (p, replicates) each, from the same independent replicates.

    Returns
    -------
    (p,) float64
    """
    count = one.shape[1]
    one, other = (light - light.mean(axis=1, keepdims=True, dtype=float) for light in (one, other))
    return (one * other).sum(axis=1) / ((count - 1) * count)
