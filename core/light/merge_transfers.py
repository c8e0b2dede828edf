"""Merge independent Transfers of one scene: values are averaged, and errors hold for the mean.

Each Transfer is a *round*: a complete trace with random numbers of its own (`seed_of_round`). With
K equal rounds

    variance of own noise          mean of the rounds' / K, and so is the covariance
    light passed on by others      the replicates of all rounds side by side: K times as many, of
                                   smaller deviations
    discretisation error           the mean: it is the same in every round
"""

from dataclasses import replace
from functools import partial

import numpy as np

from ..rays.random_numbers import GOLDEN, mix
from ..settings.errors import InputError
from .transfer import ErrorParts, SourceLight, variance_of_mean

MATRICES = ("visible_share", "direct_reflected")
MOST_REPLICATES = 64  # kept side by side; deviations of further rounds are added to these
SUMS = (
    "hemisphere_rays",
    "source_rays",
    "shadow_rays",
    "rays",
    "photons",
    "photons_per_source",
    "embree_thread_seconds",
    "seconds",
    "processor_seconds",
    "degrees_of_freedom",
)


def seed_of_round(seed, index):
    """Seed of a round, int: the run's own for the first, so that a single round is an
    ordinary run.
    """
    word = np.array([(int(GOLDEN) * (seed + 1) + index) % 2**64], np.uint64)
    return seed if index == 0 else int(mix(word)[0]) >> 33


def merge_rounds(total, other):
    """Mean of two independent Transfers of the same scene and suns, weighted by their rounds.

    Parameters
    ----------
    total, other : Transfer
        Traced with the same settings and different seeds. Matrices of surfaces × suns of the first
        are overwritten.

    Returns
    -------
    Transfer

    Raises
    ------
    InputError
        They are of different scenes or suns, or of different estimators.
    """
    # Only two runs of one city under the same suns can be merged, and not one by photons with one
    # by hemisphere rays.
    same = total.surfaces.surface_id == other.surfaces.surface_id
    same = same and np.array_equal(total.suns.direction, other.suns.direction)
    if not same or (total.error_parts is None) != (other.error_parts is None):
        raise InputError(
            "transfer",
            "it is of another scene, estimator or sampling of suns",
            "merge rounds of one run",
        )
    # weight  of the second, by its number of rounds.
    counts = tuple(one.record.rounds if one.record else 1 for one in (total, other))
    weight = counts[1] / sum(counts)
    # Deviations and own noise of the mean, then the standard errors that follow from them.
    parts = _merge_parts(total.error_parts, other.error_parts, weight, counts[0])
    # Without parts, as of photons, standard errors are of own noise alone.
    left = (
        (None, None, None, None)
        if parts is None
        else (
            parts.diffuse_passed_on,
            parts.diffuse_discretisation,
            parts.direct_passed_on,
            parts.direct_discretisation,
        )
    )
    own = [
        blend_variance(total.own_diffuse, other.own_diffuse, weight),
        blend_variance(total.own_direct, other.own_direct, weight),
    ]
    # Light is averaged by weight; with trees, the leafless state likewise.
    return replace(
        total,
        **_merge_light(total, other, weight),
        diffuse_relative_standard_error=whole_error(own[0], *left[:2]),
        direct_annual_standard_error=whole_error(own[1], *left[2:]),
        error_parts=parts,
        bare=total.bare and merge_rounds(total.bare, other.bare),
        record=merge_records(total.record, other.record, weight),
    )


def _merge_light(total, other, weight):
    """Light of two Transfers, with the weight of the second: dict of fields.

    The matrices of surfaces × suns of the first are overwritten, in blocks of rows.
    """
    for name in MATRICES:
        add_columns(getattr(total, name), getattr(other, name), weight)
    sources = {}
    for name, source in total.sources.items():
        two = other.sources[name]
        error = np.sqrt(blend_variance(source.standard_error**2, two.standard_error**2, weight))
        view, relative = (
            blend(getattr(source, n), getattr(two, n), weight) for n in ("view_factor", "relative")
        )
        sources[name] = SourceLight(view, relative, error)
    return {
        name: blend(getattr(total, name), getattr(other, name), weight)
        for name in (
            "covered_share",
            "sky_view_factor",
            "far_ground_view_factor",
            "diffuse_relative",
        )
    } | {"sources": sources}


def add_columns(matrix, values, weight, *, rows_at_once=1 << 14):
    """Overwrite a matrix of surfaces × suns with its mean with another, of some weight, in blocks
    of rows.
    """
    for first in range(0, len(matrix), rows_at_once):
        rows = slice(first, first + rows_at_once)
        matrix[rows] += np.float32(weight) * (values[rows] - matrix[rows])


def blend(one, other, weight):
    """Mean of two arrays with the weight of the second, for all rows or for each; (n, …) in their
    own type.
    """
    weight = np.asarray(weight, one.dtype)
    weight = weight[:, None] if weight.ndim and one.ndim > 1 else weight
    return (1 - weight) * one + weight * other


def blend_variance(one, other, weight):
    """Variance of that mean if both are independent."""
    return (1 - weight) ** 2 * one + weight**2 * other


def whole_error(own, transported, discretisation):
    """Standard error from the variance `own`, (n,), and replicates (n, r) and discretisation (n,),
    or None.
    """
    return np.sqrt(
        own if transported is None else own + variance_of_mean(transported) + discretisation**2
    )


def _merge_parts(one, other, weight, rounds):
    """ErrorParts of a weighted mean of two Transfers, the first with `rounds`; None if they have
    none.
    """
    if one is None:
        return None
    merges = {
        "diffuse_passed_on": partial(merge_replicates, rounds=rounds),
        "direct_passed_on": partial(merge_replicates, rounds=rounds),
        "diffuse_discretisation": blend,
        "direct_discretisation": blend,
        "covariance": blend_variance,
        "direct_points": blend_variance,
    }
    return ErrorParts(
        **{n: merge(getattr(one, n), getattr(other, n), weight) for n, merge in merges.items()}
    )


def merge_replicates(one, other, weight, rounds):
    """Deviations of replicates whose `variance_of_mean` is the variance of a weighted mean of two
    independent values.

    With weights w, numbers of replicates r and R of them all, deviations are scaled by w √(R (R -
    1) / (r (r - 1))).

    Parameters
    ----------
    one, other : (n, r) float
    weight : float
        Of the other.
    rounds : int
        In `one`: tells which of its replicates take the deviations of `other` where they are too
        many to stand side by side.

    Returns
    -------
    (n, R) float
    """
    counts = one.shape[1], other.shape[1]
    beside = sum(counts) <= MOST_REPLICATES
    whole = sum(counts) if beside else counts[0]
    # Deviations scaled so that their variance of the mean agrees with the weighted sum's.
    scaled = [
        share
        * np.sqrt(whole * (whole - 1) / (count * (count - 1)))
        * (values - values.mean(axis=1, keepdims=True))
        for values, share, count in zip((one, other), (1 - weight, weight), counts, strict=True)
    ]
    if beside:
        return np.concatenate(scaled, axis=1)
    # Too many replicates: the new ones are added to old ones in turn, as independent deviations.
    place = (rounds * counts[1] + np.arange(counts[1])) % counts[0]
    scaled[0][:, place] += scaled[1]
    return scaled[0]


def merge_records(one, other, weight):
    """TraceRecord of all rounds: counts and seconds add up, shares are averaged; None if one is
    unknown.
    """
    if one is None or other is None:
        return None
    sums = {name: _combine(getattr(one, name), getattr(other, name), (1, 1)) for name in SUMS}
    means = {
        name: _combine(getattr(one, name), getattr(other, name), (1 - weight, weight))
        for name in (
            "last_bounce_share_diffuse",
            "last_bounce_share_direct",
            "discretisation_error",
            "cut_reflections",
        )
    }
    return replace(one, rounds=one.rounds + other.rounds, **sums, **means)


def _combine(one, other, weights):
    """Weighted sum of two numbers, or of those in two dicts by their keys; None if one is
    unknown.
    """
    if one is None or other is None:
        return None
    if isinstance(one, dict):
        return {key: _combine(value, other.get(key, 0), weights) for key, value in one.items()}
    return weights[0] * one + weights[1] * other
