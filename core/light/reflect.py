"""Reflections: light that patches hand to each other through the matrix F of form factors.

E₀      first light: visible sky, or visible share of the sun times the cosine of incidence
E₁      = F (ρ ∘ E₀) + F_far · ρ_ground · (1 for the sky, cos(zenith) for a sun)
E_{n+1} = F (ρ ∘ E_n)
"""

import numpy as np

from .check_arrays import check_array
from .form_factors import check_form_factors, multiply

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
    return follow_bounces(form_factors, factor, first, far_first, max_bounces)


def follow_bounces(
    form_factors, factor, first, far_first, max_bounces, *, arriving=None, weight=None, threads=1, progress=None
):
    """Irradiance by reflections.

    Parameters
    ----------
    form_factors : FormFactors
    factor : (p,) float32
        Of `radiosity_factor`.
    first : (p, s) float32
        E₀, one column per light source.
    far_first : (p, s) float32 or None
        What the far ground adds at the first bounce, if anything.
    max_bounces : int
    arriving : (p, s) float32, optional
        F (ρ ∘ E₀), where it is known better than from the means of the patches. It is overwritten.
    weight : (s,) float32, optional
        Of each light source in `handed_on`; 1 if not given.
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
        Mean of E_max over mean of `first + reflected`, to judge what lies beyond the last bounce.
    """
    weight = np.ones(first.shape[1], np.float32) if weight is None else weight
    reflected = np.zeros_like(first)
    handed_on = np.zeros(len(first), np.float32)
    for bounce in range(max_bounces):
        if bounce:
            handed_on += factor * (arriving @ weight)
            arriving = multiply(form_factors, factor, arriving, threads)
        else:
            arriving = multiply(form_factors, factor, first, threads) if arriving is None else arriving
            if far_first is not None:
                arriving += far_first
        reflected += arriving
        if progress is not None:
            progress(bounce + 1)
    whole = float(first.sum()) + float(reflected.sum())
    last = float(arriving.sum()) / whole if max_bounces and whole > 0 else 0.0
    return reflected, handed_on, last


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
