"""Standard errors of the groups' full load hours at any place, from what a Transfer knows of its own.

The arithmetic is that of `energy.standard_errors`, with one difference: full load hours per irradiance are those of the
group, not of each surface, so that a place costs a few sums over surfaces.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..energy.standard_errors import join_own, sun_sampling_share
from ..transfer.noise import no_parts, own_diffuse, own_direct, variance_of_mean

KILO = 1000.0


@dataclass
class GroupErrors:
    """Relative irradiance of g groups of n surfaces, and the parts of its error."""

    first: np.ndarray  # (g + 1,) int64, first surface of each group, and n
    own: np.ndarray  # (3 + k, n) own variance of direct and diffuse light, covariance, sources'; times squared weight
    direct_passed_on: np.ndarray  # (g, r) deviations of replicates of light that other surfaces re-emit
    diffuse_passed_on: np.ndarray  # (g, r)
    discretisation: np.ndarray  # (2, g) signed, of direct and of diffuse light
    sun_sampling: np.ndarray  # (g,) share of full load hours
    direct: np.ndarray  # (s, g) mean relative irradiance by the sun in each direction of the grid; far ground apart
    shared: np.ndarray  # (2 + k, g) mean relative irradiance by dome, k traced sources and sunlit far ground


def find_group_errors(transfer, environment, rows, traced=()):
    """Parts of the errors of an environment's groups.

    Parameters
    ----------
    transfer : Transfer
    environment : Environment
        Of this Transfer, before surfaces are merged.
    rows : numpy.ndarray, (n,) int
        The environment's surfaces.
    traced : sequence of SourceLight
        Of the environment's sky.

    Returns
    -------
    GroupErrors
    """
    parts, first, weight = (
        transfer.error_parts or no_parts(len(transfer.surfaces)),
        environment.first,
        environment.weight,
    )
    own = [own_direct(transfer)[rows], own_diffuse(transfer)[rows], parts.covariance[rows]]
    own += [light.standard_error[rows] ** 2 for light in traced]
    discretisation = parts.direct_discretisation[rows], parts.diffuse_discretisation[rows]
    block = environment.block
    views, reflected = environment.sources[:-1].reshape(2, len(traced), len(rows))
    light = np.stack([block.diffuse, *(views + reflected), block.far_ground])
    return GroupErrors(
        first=first,
        own=np.stack(own) * weight**2,
        direct_passed_on=mean_of_groups(parts.direct_passed_on[rows].T, first, weight).T,
        diffuse_passed_on=mean_of_groups(parts.diffuse_passed_on[rows].T, first, weight).T,
        discretisation=mean_of_groups(np.stack(discretisation), first, weight),
        sun_sampling=np.array([sun_sampling_share(transfer.record, name, "bias") for name in environment.groups]),
        direct=mean_direct(block, environment.sky.direction, first, weight),
        shared=mean_of_groups(light, first, weight),
    )


def mean_of_groups(values, first, weight):
    """Weighted means of the last axis over each group: (…, g)."""
    return np.add.reduceat(values * weight, first[:-1], axis=-1)


def mean_direct(block, direction, first, weight):
    """Mean relative irradiance of groups by the sun in the grid's directions: (s, g)."""
    found = []
    for start, stop in pairwise(first):
        cosine = np.maximum(direction @ block.normal[:, start:stop], 0)
        light = block.visible_share[:, start:stop] * cosine + block.reflected[:, start:stop]
        found.append(light @ weight[start:stop])
    return np.stack(found, axis=1)


def carry_to_place(errors, hours, sunlight, full_load_hours):
    """Standard errors of the groups' full load hours at a place.

    Parameters
    ----------
    errors : GroupErrors
    hours : PlaceHours
    sunlight : Sunlight
    full_load_hours : numpy.ndarray, (g,)
        [h] per year.

    Returns
    -------
    numpy.ndarray, (g,)
        [h] NaN where the Transfer does not know the error of direct light.
    """
    light = hours.light.sum(axis=0, dtype=float) * hours.length / KILO  # (2 + k,) [kWh/m²]
    poa = sum_irradiance(errors, hours, sunlight, light)
    per_poa = np.divide(full_load_hours, poa, out=np.zeros_like(poa), where=poa > 0)
    direct, diffuse, *sources = per_poa * light[:, None]  # (g,) [h] per relative irradiance
    member = np.repeat(np.arange(len(poa)), np.diff(errors.first))
    own = join_own(direct[member], diffuse[member], *errors.own[:3])
    for hours_of_source, variance in zip(sources, errors.own[3:], strict=True):
        own = own + hours_of_source[member] ** 2 * variance
    passed_on = direct[:, None] * errors.direct_passed_on + diffuse[:, None] * errors.diffuse_passed_on
    discretisation = direct * errors.discretisation[0] + diffuse * errors.discretisation[1]
    suns = errors.sun_sampling * full_load_hours
    variance = np.add.reduceat(own, errors.first[:-1]) + variance_of_mean(passed_on)
    return np.sqrt(variance + discretisation**2 + suns**2)


def sum_irradiance(errors, hours, sunlight, light):
    """Annual irradiance of the groups [kWh/m²]: (g,). Cosines are those of the grid's directions."""
    share = sunlight.weight * hours.light[:, :1, None]  # (h, m, 3) [Wm⁻²]
    per_direction = np.bincount(sunlight.index.ravel(), share.ravel(), minlength=len(errors.direct))
    ground = sunlight.level.sum(dtype=float)
    scale = hours.length / KILO
    return scale * (per_direction @ errors.direct + ground * errors.shared[-1]) + light[1:] @ errors.shared[:-1]
