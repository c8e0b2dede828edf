"""Standard errors of the groups' full load hours at any place, from what a Transfer knows of its
own; mixes of cities.

The arithmetic is as in `energy.standard_errors`, with one difference: full load hours per
irradiance belong to the group, not to each surface, so that a place costs a few products of groups,
for the year and each of its months. Noise of light from the sun is taken as independent between
directions of the grid: a month has fewer of them than the year, and more noise in proportion to its
light.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pandas as pd

from ..energy.standard_errors import join_own
from ..light.transfer import variance_of_mean
from ..settings.errors import InputError
from .place_hours import MONTHS

OPTION = "--mix"
NAME = "mix"


@dataclass
class GroupErrors:
    """Relative irradiance of g groups, and the parts of its error."""

    # (3 + k, g) own variance of direct and diffuse light, covariance, sources'; of the group's mean
    own: np.ndarray
    # (g,) the part of the own variance of direct light that is from shadow points
    points: np.ndarray
    brightness: np.ndarray  # (g,) of what rays meet that miss the sky, over the sky
    # (g, r) deviations of replicates of light that other surfaces re-emit
    direct_passed_on: np.ndarray
    diffuse_passed_on: np.ndarray  # (g, r)
    discretisation: np.ndarray  # (2, g) signed, of direct and of diffuse light
    sun_sampling: float  # share of full load hours
    # (s, g) mean relative irradiance by the sun in each direction of the grid; far ground apart
    direct: np.ndarray
    # (2 + k, g) mean relative irradiance by dome, k traced sources and sunlit far ground
    shared: np.ndarray


def find_group_errors(transfer, environment, rows, traced=()):
    """Parts of the errors of an environment's groups: of their own light by the square of each
    surface's weight; of light that others pass on, and of patch size, which surfaces share, by
    the weight itself.

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
        For each group the variances of own light, the deviations of light that others pass on, the
        discretisation, and how bright what hides the sky is; besides, the error of the choice of
        suns, and the mean relative irradiance by the sun in each direction, by the dome, the traced
        sources and the far ground.
    """
    # Weights of surfaces in their group, per surface as a whole.
    parts = transfer.known_parts
    first, weight = environment.first, environment.weight
    # weights of what a Transfer tells: means over whole surfaces
    of_whole = weight / environment.block.lit_share
    # Variances of direct and diffuse light, their covariance, and of each source.
    own = [transfer.own_direct[rows], transfer.own_diffuse[rows], parts.covariance[rows]]
    own += [light.standard_error[rows] ** 2 for light in traced]
    discretisation = parts.direct_discretisation[rows], parts.diffuse_discretisation[rows]
    block = environment.block
    views, reflected = environment.sources[:-1].reshape(2, len(traced), len(rows))
    # Relative irradiance of each surface: by the dome, by each traced source with what is reflected
    # of it, and by the far ground.
    light = np.stack([block.diffuse, *(views + reflected), block.far_ground])
    # Shadow points have a part of the own variance of direct light, at most all of it.
    points = np.minimum(parts.direct_points[rows], own[0])
    # How bright faces are on the mean against the sky that they hide.
    seen = np.stack([transfer.sky_view_factor[rows], transfer.diffuse_relative[rows]])
    sky, diffuse = _mean_of_groups(seen, first, of_whole)
    # Direct light of each group under each direction of the grid.
    direct = []
    for start, stop in pairwise(first):
        cosine = np.maximum(environment.sky.direction @ block.normal[:, start:stop], 0)
        light_of_sun = block.visible_share[:, start:stop] * cosine + block.reflected[:, start:stop]
        direct.append(light_of_sun @ weight[start:stop])
    return GroupErrors(
        own=_mean_of_groups(np.stack(own) * of_whole, first, of_whole),
        points=_mean_of_groups(points * of_whole, first, of_whole),
        # Mean light from what rays meet that miss the sky, over the sky's: at most 0.9.
        brightness=np.clip((diffuse - sky) / np.maximum(1 - sky, 1e-9), 0, 0.9),
        direct_passed_on=_mean_of_groups(parts.direct_passed_on[rows].T, first, of_whole).T,
        diffuse_passed_on=_mean_of_groups(parts.diffuse_passed_on[rows].T, first, of_whole).T,
        discretisation=_mean_of_groups(np.stack(discretisation), first, of_whole),
        sun_sampling=transfer.sun_sampling_share("of_groups"),
        direct=np.stack(direct, axis=1),
        shared=_mean_of_groups(light, first, weight),
    )


def _mean_of_groups(values, first, weight):
    """Weighted means of the last axis over each group: (…, g)."""
    return np.add.reduceat(values * weight, first[:-1], axis=-1)


def carry_to_place(errors, hours, sunlight, full_load_hours, plain):
    """Standard errors of the groups' full load hours at a place, and of their gain by reflections.

    A month's direct light comes of fewer suns than the year's, so that the variance of its own
    noise grows; the error of the choice of suns is taken as the year's.

    Parameters
    ----------
    errors : GroupErrors
    hours : PlaceHours
    sunlight : Sunlight
    full_load_hours : numpy.ndarray, (13, g)
        [h] of the year and its months.
    plain : numpy.ndarray, (g,)
        [h] per year without reflected light.

    Returns
    -------
    hours : numpy.ndarray, (13, g)
        [h] NaN where the Transfer does not know the error of direct light.
    gain : numpy.ndarray, (g,)
        Of `full_load_hours[0] / plain - 1`; NaN without any light.
    """
    # Light of the year and its months, and hours per irradiance on the plane, of each group.
    light, poa, spread = _sum_light(errors, hours, sunlight)
    per_poa = np.divide(full_load_hours, poa, out=np.zeros_like(poa), where=poa > 0)
    direct, diffuse, *sources = per_poa * light.T[:, :, None]  # (13, g) [h] per relative irradiance
    # Deviations and discretisation add with their signs; sources and suns by their variances.
    passed_on = (
        direct[..., None] * errors.direct_passed_on + diffuse[..., None] * errors.diffuse_passed_on
    )
    discretisation = direct * errors.discretisation[0] + diffuse * errors.discretisation[1]
    common = variance_of_mean(passed_on) + discretisation**2
    for hours_of_source, variance in zip(sources, errors.own[3:], strict=True):
        common = common + hours_of_source**2 * variance
    suns = errors.sun_sampling * full_load_hours
    own = join_own(direct, diffuse, *errors.own[:3])
    # a month's suns are fewer than the year's
    growth = np.maximum(spread[0] / spread - 1, 0)[:, None] * direct**2
    fewer = growth * (errors.own[0] + variance_of_mean(errors.direct_passed_on))
    gain = (
        np.divide(full_load_hours[0], plain, out=np.full_like(plain, np.nan), where=plain > 0) - 1
    )
    # The surfaces' own rays: what is seen of sky and sun counts in both, so its noise is multiplied
    # by the gain only. A ray that misses the sky meets faces that send m of what the sky would, so
    # that noise δ of the visible sky is noise (1 - m) δ of diffuse light, all of whose own noise is
    # taken to be of this kind.
    share = (errors.brightness + gain) / (1 - errors.brightness)
    own_direct = errors.own[0] - (1 - gain**2) * errors.points
    split = join_own(direct[0], -share * diffuse[0], own_direct, *errors.own[1:3])
    reflected = common[0] + split + (gain * suns[0]) ** 2
    # All variances together give the error of the hours; the gain's is the error of the reflected
    # hours, over the hours without reflections.
    return np.sqrt(own + common + fewer + suns**2), np.sqrt(reflected) / np.where(
        plain > 0, plain, np.nan
    )


def _sum_light(errors, hours, sunlight):
    """Light of the year and its months, and the groups' irradiance by it.

    Cosines towards the grid's directions.

    Returns
    -------
    light : numpy.ndarray, (13, 2 + k) [kWh/m²]
        From the place of the sun (normal), from the dome and from each traced source.
    poa : numpy.ndarray, (13, g) [kWh/m²]
    spread : numpy.ndarray, (13,)
        Number of directions from which as much light would come from each: (Σ u)² / Σ u².
    """
    scale, count, months = hours.length / 1000.0, len(errors.direct), hours.share[: 1 + MONTHS]
    weight = sunlight.weight * hours.light[:, :1, None]  # (h, m, 3) [Wm⁻²]
    cell = months[1:].argmax(axis=0)[:, None, None] * count + sunlight.index
    suns = np.bincount(cell.ravel(), weight.ravel(), minlength=MONTHS * count).reshape(
        MONTHS, count
    )
    suns = scale * np.concatenate([suns.sum(axis=0, keepdims=True), suns])
    light, ground = scale * months @ hours.light, scale * months @ sunlight.level[:, None]
    spread = np.maximum(suns.sum(axis=1) ** 2, 1e-12) / np.maximum((suns**2).sum(axis=1), 1e-12)
    return (
        light,
        suns @ errors.direct + ground * errors.shared[-1] + light[:, 1:] @ errors.shared[:-1],
        spread,
    )


def parse_mix(text, names):
    """Weights of environments from "berlin=0.6,manhattan=0.4".

    Parameters
    ----------
    text : str
    names : list of str
        Environments that are there.

    Returns
    -------
    dict of str to float

    Raises
    ------
    InputError
        If a name is unknown, twice, or the mix's own, a weight is no number above 0, or they do not
        add up to 1.
    """
    if NAME in names:
        raise InputError(
            OPTION, f"an environment is called {NAME!r}", "give it another name: NAME=transfer.nc"
        )
    weights = {}
    for part in filter(None, text.split(",")):
        name, _, number = (piece.strip() for piece in part.partition("="))
        if name not in names or name in weights:
            raise InputError(
                OPTION,
                f"{name!r} is no environment, or is there twice",
                f"give some of {', '.join(names)}, each once",
            )
        weights[name] = pd.to_numeric(number, errors="coerce")
        if not 0 < weights[name] <= 1:  # NaN: it is no number
            raise InputError(
                OPTION,
                f"the weight {number!r} of {name} is not above 0 and at most 1",
                "give NAME=SHARE",
            )
    if abs(sum(weights.values()) - 1.0) > 1e-6:
        raise InputError(
            OPTION, f"the weights add up to {sum(weights.values()):g}", "let them add up to 1"
        )
    return weights


def add_mix(world, weights):
    """A world with the weighted mean of some environments as a further one, called "mix".

    Parameters
    ----------
    world : World
    weights : dict of str to float
        Of `parse_mix`: they add up to 1.

    Returns
    -------
    World
        A group that one of the environments lacks is missing in the mix; counts and areas of the
        others are sums over the environments. The mix's standard error is the root of the sum of
        (weight × error)², as errors of environments are independent.
    """
    # Shares of the members; a group counts only where all of them have it.
    members = [world.environments.index(name) for name in weights]
    share = np.array(list(weights.values()))

    def mean(values):
        return np.concatenate(
            [values, np.einsum("e,pe...->p...", share, values[:, members])[:, None]], axis=1
        )

    whole = (world.group_count[members] > 0).all(axis=0)
    # gain_error is a share of the hours without reflections: it becomes hours, these are joined as
    # all errors are, and divided by the mix's mean hours without reflections. A mix's error is the
    # root of the squares by squared shares, as environments are independent.
    plain = world.without_reflections[..., 0].astype(float)
    hours, plain = (
        _join_errors(world.gain_error * plain, share, members)[:, -1:],
        mean(plain)[:, -1:],
    )
    gain = np.divide(hours, plain, out=np.full_like(plain, np.nan), where=plain > 0).astype(
        np.float32
    )
    # The mix comes last along the axis of environments.
    return replace(
        world,
        environments=[*world.environments, NAME],
        sources=[
            *world.sources,
            ", ".join(f"{weight:g} {name}" for name, weight in weights.items()),
        ],
        group_count=np.concatenate(
            [world.group_count, [world.group_count[members].sum(axis=0) * whole]]
        ),
        group_area=np.concatenate(
            [world.group_area, [world.group_area[members].sum(axis=0) * whole]]
        ),
        full_load_hours=mean(world.full_load_hours).astype(np.float32),
        standard_error=_join_errors(world.standard_error, share, members),
        gain_error=np.concatenate([world.gain_error, gain], axis=1),
        without_reflections=mean(world.without_reflections).astype(np.float32),
    )


def _join_errors(values, share, members):
    """Standard errors, and the mix's, since errors of environments are independent: (p, e + 1, g,
    …).
    """
    mix = np.sqrt(np.einsum("e,pe...->p...", share**2, values[:, members].astype(float) ** 2))
    return np.concatenate([values, mix[:, None].astype(np.float32)], axis=1)
