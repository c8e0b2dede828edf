"""Reflections: light that patches hand to each other through the matrix F of form factors.

E₀      first light: visible sky, or visible share of the sun times the cosine of incidence
E₁      = F (ρ ∘ E₀) + F_far · ρ_ground · (1 for the sky, cos(zenith) for a sun)
E_{n+1} = F (ρ ∘ E_n)
"""

import numpy as np
from numba import njit

from .check_arrays import check_array
from .form_factor_products import multiply
from .form_factors import check_form_factors
from .row_slices import work_in_slices

MINIMAL_OPEN_SHARE = 1 / 64  # below it the light of a patch is too uncertain to be spread over its open part


def radiosity_factor(patches, covered_share):
    """What turns the mean irradiance of a patch into the radiosity of its open part.

    Patches that lie partly under buildings average zeros into their irradiance, but only their open part is seen.

    Returns
    -------
    (p,) float32
    """
    open_share = np.maximum(1 - covered_share, MINIMAL_OPEN_SHARE)
    return (patches.albedo / open_share).astype(np.float32)


def reflect(form_factors, factor, first, far_first, max_bounces):
    """Irradiance by reflections: `follow_bounces` for arrays that nobody has looked at yet.

    Raises
    ------
    InputError
        If shapes do not fit, or light is negative or not finite.
    """
    count, sources = check_array("first", first, ("p", "s"), least=0).shape
    check_array("far_first", far_first, (count, sources), least=0)
    check_array("factor", factor, (count,), least=0, most=1 / MINIMAL_OPEN_SHARE)
    check_form_factors(form_factors, count)
    arriving = multiply(form_factors, factor, first)
    return follow_bounces(form_factors, factor, arriving, max_bounces, far_first=far_first, first_light=first.sum())


def follow_bounces(
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
    factor : (p,) float32
        Of `radiosity_factor`.
    arriving : (p, s) float32
        F (ρ ∘ E₀), one column per light source. It is overwritten.
    max_bounces : int
    far_first : (p, s) float32, optional
        What the far ground adds at the first bounce.
    first_light : float
        Sum of E₀ over all patches and, by weight, the light sources, for `last`.
    weight : (s,) float32, optional
        Of each light source in sums over them; 1 if not given.
    threads : int
    progress : callable, optional
        Called with the number of bounces done.

    Returns
    -------
    reflected : (p, s) float32
        The sum of E₁ to E_max.
    handed_on : (p,) float32
        ρ ∘ (E₁ + … + E_{max-1}), the light that F handed on after the first bounce, summed with `weight`.
    last : float
        Share of E_max in all light, to judge what lies beyond the last bounce.
    """
    if not max_bounces:
        return np.zeros_like(arriving), np.zeros(len(arriving), np.float32), 0.0
    weight = np.ones(arriving.shape[1], np.float32) if weight is None else weight
    reflected, handed_on = np.zeros_like(arriving), np.zeros(len(arriving), np.float32)
    whole, spare = float(first_light), None
    for bounce in range(max_bounces):
        arrived = np.zeros(len(arriving), np.float32)
        if bounce == 0:
            add_first_bounce(arriving, far_first, weight, (reflected, arrived), threads)
        else:

            def add(rows, light, arrived=arrived):
                add_light(rows, light, weight, reflected, arrived)

            arriving, spare = multiply(form_factors, factor, arriving, threads, out=spare, after=add), arriving
        last = arrived.sum(dtype=float)
        whole += last
        if bounce + 1 < max_bounces:
            handed_on += factor * arrived
        if progress is not None:
            progress(bounce + 1)
    return reflected, handed_on, last / whole if max_bounces and whole > 0 else 0.0


def add_first_bounce(arriving, far_first, weight, sums, threads):
    """Add what the far ground reflects to the light of the first bounce, and both to the sums of `add_light`."""

    def add(rows):
        if far_first is not None:
            arriving[rows] += far_first[rows]
        add_light(np.arange(rows.start, rows.stop), arriving, weight, *sums)

    work_in_slices(add, len(arriving), threads)


@njit(nogil=True, cache=True, fastmath={"reassoc"})
def add_light(rows, light, weight, reflected, arrived):
    """Add the light of one bounce that arrives at some patches.

    Parameters
    ----------
    rows : (c,) int
    light : (p, s) float32
    weight : (s,) float32
    reflected : (p, s) float32
        The light is added to these rows.
    arrived : (p,) float32
        Written: the light summed over its sources, by weight.
    """
    for row in rows:
        source, total, weighted = light[row], reflected[row], np.float32(0)
        for column in range(len(total)):
            total[column] += source[column]
            weighted += source[column] * weight[column]
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
