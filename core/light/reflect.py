"""Reflections: light that patches hand to each other through the matrix F of form factors.

E₀      first light: visible sky, or visible share of the sun times the cosine of incidence
E₁      = F (ρ ∘ E₀) + F_far · ρ_ground · (1 for the sky, cos(zenith) for a sun)
E_{n+1} = F (ρ ∘ E_n)
"""

import numpy as np

from ..errors import InputError
from .check_arrays import check_array
from .sample_points import REPLICATES

MINIMAL_OPEN_SHARE = 1 / 64  # below it the light of a patch is too uncertain to be spread over its open part
ROWS_PER_BLOCK = 1 << 14


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
    """Irradiance by reflections.

    Parameters
    ----------
    form_factors : (p · REPLICATES, p) sparse float32
    factor : (p,) float32
        Of `radiosity_factor`.
    first : (p, s) float32
        E₀, one column per light source.
    far_first : (p, s) float32
        What the far ground adds at the first bounce.
    max_bounces : int

    Returns
    -------
    reflected : (p, s) float32
        The sum of E₁ to E_max.
    gathered : (p, s) float32
        ρ ∘ (E₀ + … + E_{max-1}), the light that F handed on: F · gathered + far_first = reflected.
    last : float
        Mean of E_max over mean of `first + reflected`, to judge what lies beyond the last bounce.

    Raises
    ------
    InputError
        If shapes do not fit, or light is negative or not finite.
    """
    count, sources = check_array("first", first, ("p", "s"), least=0).shape
    check_array("far_first", far_first, (count, sources), least=0)
    check_array("factor", factor, (count,), least=0, most=1 / MINIMAL_OPEN_SHARE)
    if form_factors.shape != (count * REPLICATES, count):
        raise InputError("form_factors", f"shape {form_factors.shape}", f"give {(count * REPLICATES, count)}")
    check_array("form_factors", form_factors.data, ("entries",), least=0, most=1, row="entry")
    reflected = np.zeros_like(first)
    gathered = np.zeros_like(first)
    arriving = first
    for bounce in range(max_bounces):
        leaving = factor[:, None] * arriving
        gathered += leaving
        arriving = multiply(form_factors, leaving)
        if bounce == 0:
            arriving += far_first
        reflected += arriving
    whole = float(first.sum(dtype=float) + reflected.sum(dtype=float))
    last = float(arriving.sum(dtype=float)) / whole if max_bounces and whole > 0 else 0.0
    return reflected, gathered, last


def multiply(form_factors, light):
    """F · light, the mean over the replicates: (p, s) float32."""
    count, sources = light.shape
    product = np.empty_like(light)
    for first in range(0, count, ROWS_PER_BLOCK):
        last = min(first + ROWS_PER_BLOCK, count)
        rows = form_factors[first * REPLICATES : last * REPLICATES] @ light
        product[first:last] = rows.reshape(last - first, REPLICATES, sources).mean(axis=1)
    return product


def replicates_of(form_factors, light):
    """F · light for one light source, each replicate by itself: (p, REPLICATES) float32."""
    return (form_factors @ light).reshape(-1, REPLICATES)


def variance_of_replicates(values):
    """Variance of the mean of independent replicates.

    Parameters
    ----------
    values : (p, REPLICATES) float

    Returns
    -------
    (p,) float64
    """
    return values.astype(float).var(axis=1, ddof=1) / values.shape[1]
