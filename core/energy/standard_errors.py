"""How sure full load hours are: by rays, by the size of patches, and by the suns that stand for the year."""

import numpy as np
import pandas as pd

from ..transfer.transfer import ErrorParts

PROPORTION = 0.1  # to which full load hours follow the irradiance alike, whether direct, diffuse or reflected


def standard_errors_of_hours(transfer, weather, sums, groups):
    """Standard errors of full load hours, of surfaces and of the means of groups.

    Errors of the irradiance are carried over in proportion, that of the direct part is taken as that of its mean over
    the suns' weights. Over the surfaces of a group own noise adds up like that of independent numbers; light that other
    surfaces pass on, and light uneven within patches, adds up with its sign; and so does what the choice of suns does,
    for which the pilot's patches of the group stand.

    Parameters
    ----------
    transfer : Transfer
        Its record holds the error of sun sampling where it was measured.
    weather : Weather
    sums : tuple of (n,), (n,) and float
        Full load hours [h] and irradiance [kWh/m²] per year, and the years that the weather covers.
    groups : Groups

    Returns
    -------
    surfaces : numpy.ndarray, (n,)
        [h] NaN where there are no full load hours, or the error of the irradiance is unknown.
    means : numpy.ndarray, (g,)
        [h]
    """
    full_load_hours = sums[0]
    own, passed_on, discretisation = carry_to_hours(transfer, weather, *sums)
    names = list(zip(np.asarray(transfer.surfaces.kind), np.asarray(transfer.surfaces.orientation), strict=True))
    rms = np.array([share_of_suns(transfer.record, name, "rms") for name in names])
    sampling = own + spread_of_mean(passed_on) + discretisation**2
    surfaces = np.sqrt(sampling + (rms * full_load_hours) ** 2)
    means = np.zeros(len(groups.names))
    for column, name in enumerate(groups.names):
        members = groups.weight[:, column] > 0
        weight = groups.weight[members, column]
        suns = share_of_suns(transfer.record, name, "bias") * (weight @ full_load_hours[members])
        variance = weight**2 @ own[members] + spread_of_mean(weight @ passed_on[members])
        means[column] = np.sqrt(variance + (weight @ discretisation[members]) ** 2 + suns**2)
    return surfaces, means


def carry_to_hours(transfer, weather, full_load_hours, poa, years):
    """Parts of the error of full load hours by rays and patches.

    Returns
    -------
    own : numpy.ndarray, (n,)
        [h²] Variance by the surface's own rays; NaN where there are no full load hours, or it is unknown.
    passed_on : numpy.ndarray, (n, r)
        [h] Deviations of replicates of light that other surfaces pass on.
    discretisation : numpy.ndarray, (n,)
        [h] With a sign.
    """
    annual = weather.data[["dni", "dhi"]].sum() * (weather.interval / pd.Timedelta(hours=1)) / years / 1000.0
    per_poa = np.divide(full_load_hours, poa, out=np.zeros_like(poa), where=poa > 0)
    direct, diffuse = per_poa * annual["dni"], per_poa * annual["dhi"]  # [h] per relative irradiance
    parts = transfer.error_parts or no_parts(len(per_poa))
    own_diffuse = diffuse**2 * own_variance(
        transfer.diffuse_relative_standard_error, parts.diffuse_passed_on, parts.diffuse_discretisation
    )
    own_direct = direct**2 * own_variance(
        transfer.direct_annual_standard_error, parts.direct_passed_on, parts.direct_discretisation
    )
    # A ray that misses the sky meets what the suns light: the two cancel in part, as far as proportions hold.
    together = own_diffuse + own_direct
    own = np.maximum(together + 2 * direct * diffuse * parts.covariance, PROPORTION**2 * together)
    passed_on = direct[:, None] * parts.direct_passed_on + diffuse[:, None] * parts.diffuse_passed_on
    discretisation = direct * parts.direct_discretisation + diffuse * parts.diffuse_discretisation
    return np.where(np.isnan(full_load_hours), np.nan, own), passed_on, discretisation


def no_parts(count):
    """Of n surfaces whose standard errors are their own noise alone."""
    return ErrorParts(np.zeros((count, 2)), np.zeros((count, 2)), *np.zeros((3, count)))


def own_variance(standard_error, passed_on, discretisation):
    """What is left of the square of a standard error when its other parts are taken out: (n,)."""
    whole = np.asarray(standard_error, float) ** 2
    return np.maximum(whole - spread_of_mean(passed_on) - discretisation**2, 0)


def spread_of_mean(replicates):
    """Variance of the mean of independent replicates, along the last axis."""
    return replicates.var(axis=-1, ddof=1) / replicates.shape[-1]


def share_of_suns(record, name, part):
    """What the choice of suns does to full load hours, as a share of them, of a kind and orientation.

    0 where it was not measured; that of all pilot patches together where none is of that kind and orientation.
    """
    found = (record and record.sun_sampling) or {}
    return found.get("groups", {}).get(" ".join(name), found).get(part, 0.0) / 100
