"""What standard errors consist of: own noise, noise of light that others re-emit, and discretisation."""

import numpy as np

from .transfer import ErrorParts


def no_parts(count):
    """Error parts of n surfaces whose standard errors are own noise only."""
    return ErrorParts(np.zeros((count, 2)), np.zeros((count, 2)), *np.zeros((4, count)))


def own_variance(standard_error, passed_on, discretisation):
    """Variance from own rays: squared standard error, (n,), less those of replicates (n, r) and discretisation (n,)."""
    whole = np.asarray(standard_error, float) ** 2
    return np.maximum(whole - variance_of_mean(passed_on) - discretisation**2, 0)


def variance_of_mean(replicates):
    """Variance of the mean of independent replicates, along the last axis, in the square of their unit."""
    return replicates.var(axis=-1, ddof=1) / replicates.shape[-1]


def own_diffuse(transfer):
    """Variance of `diffuse_relative` from the surface's own rays: (n,) [–]."""
    parts = transfer.error_parts or no_parts(len(transfer.surfaces))
    error = transfer.diffuse_relative_standard_error
    return own_variance(error, parts.diffuse_passed_on, parts.diffuse_discretisation)


def own_direct(transfer):
    """Variance of the annual mean of direct irradiance per DNI from own rays: (n,) [–]; NaN if it is unknown."""
    parts = transfer.error_parts or no_parts(len(transfer.surfaces))
    error = transfer.direct_annual_standard_error
    return own_variance(error, parts.direct_passed_on, parts.direct_discretisation)
