"""Merge independent Transfers of one scene: values are averaged, and errors become those of the mean.

Each Transfer is a *round*: a complete trace with random numbers of its own (`seed_of_round`). With K equal rounds

    variance of own noise          mean of the rounds' / K, and so is the covariance
    light passed on by others      the replicates of all rounds side by side: K times as many, of smaller deviations
    discretisation error           the mean: it is the same in every round
"""

from dataclasses import replace

import numpy as np

from ..errors import InputError
from ..sampling.random_numbers import mix_seed
from .transfer import ErrorParts, SourceLight, own_diffuse, own_direct, variance_of_mean

MEANS = ("covered_share", "sky_view_factor", "far_ground_view_factor", "diffuse_relative")
MATRICES = ("visible_share", "direct_reflected")
MOST_REPLICATES = 64  # kept side by side; deviations of further rounds are added to these
ROWS = 1 << 14
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
)


def seed_of_round(seed, index):
    """Seed of a round: the run's own for the first, so that a single round is an ordinary run."""
    return seed if index == 0 else mix_seed(seed, index)


def merge_transfers(transfers):
    """Mean of independent Transfers of the same scene and suns, weighted by their rounds.

    Parameters
    ----------
    transfers : sequence of Transfer
        Traced with the same settings and different seeds.

    Returns
    -------
    Transfer

    Raises
    ------
    InputError
        They are of different scenes or suns.
    """
    first, *others = transfers
    total = own_matrices(first) if others else first
    for other in others:
        total = add_round(total, other)
    return total


def own_matrices(transfer):
    """The same with matrices of surfaces × suns that may be overwritten: Transfer."""
    copies = {name: np.array(getattr(transfer, name)) for name in MATRICES}
    return replace(transfer, **copies, bare=transfer.bare and own_matrices(transfer.bare))


def add_round(total, other):
    """Merge one Transfer into another, whose matrices of surfaces × suns are overwritten.

    Parameters, result and errors as of `merge_transfers`.
    """
    check_same(total, other)
    counts = count_rounds(total), count_rounds(other)
    weights = tuple(count / sum(counts) for count in counts)
    parts = merge_parts(total.error_parts, other.error_parts, weights, counts[0])
    own = [merge_variance(*(noise(one) for one in (total, other)), weights) for noise in (own_diffuse, own_direct)]
    for name in MATRICES:
        average_in_place(getattr(total, name), getattr(other, name), weights[1])
    return replace(
        total,
        **{name: weights[0] * getattr(total, name) + weights[1] * getattr(other, name) for name in MEANS},
        diffuse_relative_standard_error=whole_error(
            own[0], parts and (parts.diffuse_passed_on, parts.diffuse_discretisation)
        ),
        direct_annual_standard_error=whole_error(
            own[1], parts and (parts.direct_passed_on, parts.direct_discretisation)
        ),
        error_parts=parts,
        sources=merge_sources(total.sources, other.sources, weights),
        bare=total.bare and add_round(total.bare, other.bare),
        record=merge_records(total.record, other.record, weights),
    )


def check_same(one, other):
    """Refuse Transfers of different scenes or suns.

    Raises
    ------
    InputError
    """
    same = one.surfaces.surface_id == other.surfaces.surface_id and np.array_equal(
        one.suns.direction, other.suns.direction
    )
    if not same or (one.error_parts is None) != (other.error_parts is None):
        raise InputError("transfer", "it is of another scene, estimator or sampling of suns", "merge rounds of one run")


def count_rounds(transfer):
    """Number of rounds that were merged into a Transfer."""
    return transfer.record.rounds if transfer.record else 1


def average_in_place(matrix, other, weight):
    """Move a matrix of surfaces × suns, (n, s), towards another by `weight` of their difference, in blocks of rows."""
    for first in range(0, len(matrix), ROWS):
        rows = slice(first, first + ROWS)
        matrix[rows] += np.float32(weight) * (other[rows] - matrix[rows])


def merge_variance(one, other, weights):
    """Variance of a weighted mean of two independent values with variances `one` and `other`, in their unit."""
    return weights[0] ** 2 * one + weights[1] ** 2 * other


def whole_error(own, others):
    """Standard error from the variance `own`, (n,), and None or replicates (n, r) and discretisation (n,)."""
    if others is None:
        return np.sqrt(own)
    passed_on, discretisation = others
    return np.sqrt(own + variance_of_mean(passed_on) + discretisation**2)


def merge_parts(one, other, weights, rounds):
    """ErrorParts of a weighted mean of two Transfers, of which the first has `rounds`; None if they have none."""
    if one is None:
        return None

    def mean(name):
        return weights[0] * getattr(one, name) + weights[1] * getattr(other, name)

    def replicates(name):
        return merge_replicates(getattr(one, name), getattr(other, name), weights, rounds)

    def variance(name):
        return merge_variance(getattr(one, name), getattr(other, name), weights)

    return ErrorParts(
        diffuse_passed_on=replicates("diffuse_passed_on"),
        direct_passed_on=replicates("direct_passed_on"),
        diffuse_discretisation=mean("diffuse_discretisation"),
        direct_discretisation=mean("direct_discretisation"),
        covariance=variance("covariance"),
        direct_points=variance("direct_points"),
    )


def merge_sources(one, other, weights):
    """Light of each traced source in a weighted mean: dict of SourceLight."""
    return {name: merge_light(light, other[name], weights) for name, light in one.items()}


def merge_light(one, other, weights):
    """SourceLight of a weighted mean."""
    return SourceLight(
        weights[0] * one.view_factor + weights[1] * other.view_factor,
        weights[0] * one.relative + weights[1] * other.relative,
        np.sqrt(merge_variance(one.standard_error**2, other.standard_error**2, weights)),
    )


def merge_replicates(one, other, weights, rounds):
    """Deviations of replicates whose `variance_of_mean` is that of a weighted mean of two independent values.

    With weights w, numbers of replicates r and R of them all, deviations are scaled by w √(R (R - 1) / (r (r - 1))).

    Parameters
    ----------
    one, other : (n, r) float
    weights : tuple of two float
    rounds : int
        In `one`: tells to which replicates those of `other` are added where they are too many to stand side by side.

    Returns
    -------
    (n, R) float
    """
    counts = one.shape[1], other.shape[1]
    beside = sum(counts) <= MOST_REPLICATES
    whole = sum(counts) if beside else counts[0]
    scaled = [
        weight * np.sqrt(whole * (whole - 1) / (count * (count - 1))) * (values - values.mean(axis=1, keepdims=True))
        for values, weight, count in zip((one, other), weights, counts, strict=True)
    ]
    if beside:
        return np.concatenate(scaled, axis=1)
    place = (rounds * counts[1] + np.arange(counts[1])) % counts[0]
    scaled[0][:, place] += scaled[1]
    return scaled[0]


def merge_records(one, other, weights):
    """TraceRecord of all rounds: counts and seconds add up, shares are averaged; None if one is unknown."""
    if one is None or other is None:
        return None

    def mean(name):
        return blend(getattr(one, name), getattr(other, name), weights)

    return replace(
        one,
        rounds=one.rounds + other.rounds,
        **{name: blend(getattr(one, name), getattr(other, name), (1, 1)) for name in SUMS},
        last_bounce_share_diffuse=mean("last_bounce_share_diffuse"),
        last_bounce_share_direct=mean("last_bounce_share_direct"),
        discretisation_error=mean("discretisation_error"),
        degrees_of_freedom=blend(one.degrees_of_freedom, other.degrees_of_freedom, (1, 1)),
    )


def blend(one, other, weights):
    """Weighted sum of two numbers, or of those in two dicts by their keys; None if one is unknown."""
    if one is None or other is None:
        return None
    if isinstance(one, dict):
        return {key: blend(value, other.get(key, 0), weights) for key, value in one.items()}
    return weights[0] * one + weights[1] * other
