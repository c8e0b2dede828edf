"""Standard errors of full load hours: from rays, discretisation, and the suns that represent the
year.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pandas as pd

from ..light.transfer import variance_of_mean
from ..sky.sky_models import split_sky
from .energy import states_of_year


def state_errors(energy, errors, groups):
    """An Energy with the standard errors of surfaces, of the means of groups, and of the mean of
    all groups together.

    A surface has NaN without full load hours, or if the error of the irradiance is unknown.

    Parameters
    ----------
    energy : Energy
    errors : HourErrors
    groups : Groups

    Returns
    -------
    Energy
    """
    rows, label = np.nonzero(groups.weight)
    # What the suns do to means of groups was measured on these: what surfaces have of their own is
    # in it.
    of_groups = replace(errors, rms=errors.bias)
    means = of_groups.of_sums(rows, groups.weight[rows, label], label, len(groups.names))
    # All groups together, each by its area: noise of light that surfaces pass on is common to all
    # and is followed with its sign.
    weight = (
        groups.weight[rows, label]
        * (groups.area / max(groups.area.sum(), np.finfo(float).tiny))[label]
    )
    whole = errors.noise_of_mean(weight, rows)
    return replace(
        energy,
        full_load_hours_standard_error=errors.of_surfaces,
        group_standard_error=means,
        sampling_error=float(np.sqrt(whole)),
    )


@dataclass
class _HourErrors:
    """Parts of the errors of the full load hours of n surfaces."""

    # (n,) [h²] variance from the surface's own rays; NaN without full load hours, or if unknown
    own: np.ndarray
    # (n, r) [h] deviations of replicates of light that other surfaces re-emit
    passed_on: np.ndarray
    discretisation: np.ndarray  # (n,) [h] signed
    points: np.ndarray  # (n,) [h²] the part of `own` that is from shadow points
    bias: np.ndarray  # (n,) [h] what the choice of suns does to the mean of a kind and orientation
    rms: np.ndarray  # (n,) [h] and to single surfaces

    @property
    def of_surfaces(self):
        """Standard errors of single surfaces: (n,) [h]."""
        # Parts that have nothing to do with each other add up by their variances.
        apart = self.own + variance_of_mean(self.passed_on)
        return np.sqrt(apart + self.discretisation**2 + self.rms**2)

    def noise_of_mean(self, weight, rows):
        """Variance of a weighted sum over some surfaces by the rays alone: own noise is
        independent, noise of light passed on is common.

        Parameters
        ----------
        weight : (k,) float
        rows : (k,) int, or (n,) bool with k that hold
            The surfaces.
        """
        return weight**2 @ self.own[rows] + variance_of_mean(weight @ self.passed_on[rows])

    def of_sums(self, rows, weight, label, count):
        """Standard errors of weighted sums of the hours of some surfaces: (count,) [h].

        Own noise adds up as of independent numbers; errors of light that other surfaces re-emit,
        and discretisation errors, add up with their signs; so does what the choice of suns does to
        the mean of a kind and orientation, the rest of whose error is each surface's own.

        Parameters
        ----------
        rows : numpy.ndarray, (k,) int
            The surfaces.
        weight : numpy.ndarray, (k,)
        label : numpy.ndarray, (k,) int
            Sum that each belongs to.
        count : int
        """
        add = partial(np.bincount, label, minlength=count)
        # apart  variance that is each surface's own; common  deviations that all share, by
        # replicate; signed  errors known with their sign [h²].
        apart = self.own + np.maximum(self.rms**2 - self.bias**2, 0.0)
        common = np.stack([add(weight * replicate) for replicate in self.passed_on[rows].T], axis=1)
        signed = add(weight * self.discretisation[rows]) ** 2 + add(weight * self.bias[rows]) ** 2
        return np.sqrt(add(weight**2 * apart[rows]) + variance_of_mean(common) + signed)


def errors_of_energy(transfer, weather, energy):
    """Parts of the errors of the full load hours that an Energy has of a Transfer and a weather:
    HourErrors, of each surface in [h] or, as variance, [h²]: own noise and its part from shadow
    points, light that others pass on, discretisation, and the choice of suns.
    """
    # per_poa  hours that a surface yields per irradiance on its plane in the year [h per kWh/m²].
    full_load_hours, poa, sky = (
        energy.full_load_hours,
        energy.poa_global_annual,
        split_sky(weather, energy.sky),
    )
    per_poa = np.divide(full_load_hours, poa, out=np.zeros_like(poa), where=poa > 0)
    own, points, passed_on, discretisation = [], [], 0.0, 0.0
    # Trees in leaf and bare are two states, each with its own hours: light of the year that falls
    # into this one, direct, from the dome, and from traced sources [kWh/m²].
    for state, holds in states_of_year(transfer, weather.data.index, weather.interval):
        light = [(weather.data["dni"].to_numpy() + sky.circumsolar) @ holds, sky.dome @ holds]
        light += [of_source @ holds for of_source in sky.sources.values()]
        annual = (
            np.array(light) * (weather.interval / pd.Timedelta(hours=1)) / energy.years / 1000.0
        )
        # In the hours of this state, [h] per relative irradiance of direct and diffuse light and of
        # traced sources.
        direct, diffuse, *of_sources = per_poa * annual[:, None]
        parts = state.known_parts
        # Own noise of the surface's rays to suns and dome, which are not independent, and to the
        # sources.
        noise = join_own(direct, diffuse, state.own_direct, state.own_diffuse, parts.covariance)
        for name, of_source in zip(sky.sources, of_sources, strict=True):
            # with what others pass on
            noise = noise + (of_source * state.sources[name].standard_error) ** 2
        own.append(noise)
        # Part of the noise that shadow points bring: it cannot be more than all of it.
        points.append(np.minimum(direct**2 * parts.direct_points, noise))
        # Deviations and discretisation errors keep their signs, so that states add up before
        # squares.
        passed_on = (
            passed_on
            + direct[:, None] * parts.direct_passed_on
            + diffuse[:, None] * parts.diffuse_passed_on
        )
        discretisation = (
            discretisation
            + direct * parts.direct_discretisation
            + diffuse * parts.diffuse_discretisation
        )
    # The states are traced by the same rays: their noise adds up with its standard deviations.
    own, points = (np.square(sum(map(np.sqrt, of_states))) for of_states in (own, points))
    own = np.where(np.isnan(full_load_hours), np.nan, own)
    # What the choice of suns costs was measured on all of the city, as a share of the hours.
    shares = [transfer.sun_sampling_share(part) for part in ("of_groups", "rms")]
    suns = (full_load_hours * share for share in shares)
    return _HourErrors(own, passed_on, discretisation, points, *suns)


def join_own(direct, diffuse, own_direct, own_diffuse, covariance):
    """Variance of full load hours from the own rays of surfaces, direct and diffuse light together:
    (n,) [h²].

    A ray that misses the sky hits sunlit surfaces: the two errors cancel in part, as far as
    proportionality holds.

    Parameters
    ----------
    direct, diffuse : numpy.ndarray, (n,)
        [h] per relative irradiance.
    own_direct, own_diffuse, covariance : numpy.ndarray, (n,)
        Of relative irradiances.
    """
    # Variance of a sum, a² V(A) + b² V(B) + 2ab Cov(A, B), but never below a hundredth of it
    # without the covariance: light and hours are in proportion to within a tenth.
    together = diffuse**2 * own_diffuse + direct**2 * own_direct
    # The yield per irradiance differs by about a tenth between direct, diffuse and reflected light.
    return np.maximum(together + 2 * direct * diffuse * covariance, 0.1**2 * together)
