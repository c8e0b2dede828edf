"""Rounds of gather that continue one net of points: what they keep of patches, and how they are merged.

Every patch goes on in its own sequence of points (`sampling.sample_points.sobol_points`), so k rounds are as even as
one of k times the samples. Their noise is not that of independent rounds: it is told from the light of all rounds at
the points of each patch, and by each replicate of its rays, as if they were one. Replicates stay independent.
"""

from dataclasses import replace

import numpy as np

from ..patches.patches import take_patches
from ..rays.hemisphere_rays import merge_nets
from ..transfer.merge_transfers import MATRICES, MEANS, check_same, merge_records, merge_sources, whole_error
from ..transfer.noise import own_diffuse, own_direct
from ..transfer.patch_light import Emitted, Net, OwnNoise, PatchFacts, PatchLight, Uneven
from .direct_errors import SeenSky, variance_of_shadow_points
from .light_errors import patch_size_error
from .shadow_points import shift_points
from .solve_radiosity import covariance_of_replicates, variance_of_replicates

MOST_POINTS = 1024  # of a net; larger ones stay apart
ROWS = 1 << 14  # of matrices at a time


def keep_patches(context, hemisphere, diffuse, annual, part):
    """Light of the patches of a run that send all rays, for merging with further rounds.

    Parameters
    ----------
    context : GatherContext
    hemisphere : Hemisphere
    diffuse : Diffuse
    annual : Annual
    part : Round

    Returns
    -------
    PatchLight
        Its noise is still to be told: `tell_noise`.
    """
    patches, plan = context.patches, context.plan
    full = patches.receives if plan.receivers is None else plan.receivers
    rows = np.flatnonzero(full & patches.receives)
    own = take_patches(patches, rows)
    before = int(own.points_before.max(initial=0))
    sent = ~plan.open_to_suns & patches.receives & ~hemisphere.covered.all(axis=1)
    facts = PatchFacts(
        patches=own,
        covered=hemisphere.covered[rows],
        sky=hemisphere.sky[rows].mean(axis=1),
        rays=context.request.samples,
        sent=sent[rows],
        squares=context.merge.power(2).tocsc()[:, rows].tocsr(),
        suns=annual.suns,
    )
    none = np.zeros((len(rows), diffuse.by_replicate.shape[1]), np.float32)
    reflected = none if annual.by_replicate is None else annual.by_replicate[rows]
    return PatchLight(
        rows,
        part,
        facts,
        diffuse.by_replicate[rows],
        reflected,
        [Net(before, annual.by_point[rows])],
        Emitted(diffuse.radiosity, annual.radiosity, annual.lit_ground),
        own=None,
        rest=None,
    )


def with_noise(transfer, kept, uneven):
    """A round's Transfer with the light of its patches: what of its errors these explain, and what they do not."""
    own, whole = tell_noise(kept), noise_of(transfer)
    rest = OwnNoise(*(np.maximum(all_of_it - part, 0) for all_of_it, part in zip(whole, own, strict=True)))
    rest = rest._replace(covariance=whole.covariance - own.covariance)
    return replace(transfer, patch_light=replace(kept, own=own, rest=rest, uneven=uneven))


def noise_of(transfer):
    """OwnNoise of a Transfer."""
    parts = transfer.error_parts
    return OwnNoise(own_diffuse(transfer), own_direct(transfer), parts.covariance, parts.direct_points)


def tell_noise(kept):
    """Noise of surfaces from the light of their patches: OwnNoise."""
    squares, points = kept.facts.squares, variance_of_nets(kept)
    rays = variance_of_replicates(kept.reflected)
    return OwnNoise(
        diffuse=squares @ variance_of_replicates(kept.diffuse),
        direct=squares @ (points + rays),
        covariance=squares @ covariance_of_replicates(kept.reflected, kept.diffuse),
        points=squares @ points,
    )


def variance_of_nets(kept):
    """Variance of the annual light of patches at all points of their nets: (k,) float64."""
    facts, count = kept.facts, sum(net.light.shape[1] for net in kept.nets)
    variance = np.zeros(len(kept.rows))
    for net in kept.nets:
        patches = replace(facts.patches, points_before=np.full(len(kept.rows), net.before, np.uint32))
        sky = SeenSky(facts.sky, facts.rays)
        found = variance_of_shadow_points(net.light, facts.covered, patches, facts.suns, sky)
        variance += (net.light.shape[1] / count) ** 2 * found
    variance[~facts.sent] = 0  # known exactly
    return variance


def add_continued(total, other):
    """Merge a further round into a Transfer, whose matrices of surfaces × suns are overwritten.

    Parameters
    ----------
    total : Transfer
        Of all rounds before, with `patch_light`.
    other : Transfer
        Of a round that continues them. Surfaces that it is not for stay as they are.

    Returns
    -------
    Transfer

    Raises
    ------
    InputError
        They are of different scenes or suns.
    """
    check_same(total, other)
    sizes = total.patch_light.round.size, other.patch_light.round.size
    share = sizes[1] / sum(sizes)
    counted = other.patch_light.round.counted
    weight = np.full(len(total.surfaces), share) if counted is None else np.where(counted, share, 0.0)
    weights = 1 - weight, weight
    kept = merge_light(total.patch_light, other.patch_light, weights)
    own = OwnNoise(*(part + rest for part, rest in zip(kept.own, kept.rest, strict=True)))
    parts = merge_error_parts(total.error_parts, other.error_parts, weights, own)
    parts = with_discretisation(parts, kept.uneven)
    for name in MATRICES:
        average_rows(getattr(total, name), getattr(other, name), weight)
    diffuse, direct = (
        (own.diffuse, (parts.diffuse_passed_on, parts.diffuse_discretisation)),
        (own.direct, (parts.direct_passed_on, parts.direct_discretisation)),
    )
    record = merge_records(total.record, other.record, (1 - share, share))
    return replace(
        total,
        **{name: blend_rows(getattr(total, name), getattr(other, name), weights) for name in MEANS},
        diffuse_relative_standard_error=whole_error(*diffuse),
        direct_annual_standard_error=whole_error(*direct),
        error_parts=parts,
        sources=merge_sources(total.sources, other.sources, weights),
        bare=total.bare and add_continued(total.bare, other.bare),
        record=replace(record, degrees_of_freedom=total.record.degrees_of_freedom),
        patch_light=kept,
    )


def merge_light(one, other, weights):
    """PatchLight of all rounds: of the patches of the last one, and the noise of the others as it was."""
    sizes = one.round.size, other.round.size
    share = sizes[1] / sum(sizes)
    place = np.searchsorted(one.rows, other.rows)
    facts = other.facts
    if len(other.rows) < len(one.rows):
        facts = replace(facts, covered=one.facts.covered[place], sky=one.facts.sky[place], rays=one.facts.rays)
    else:
        facts = one.facts
    kept = PatchLight(
        rows=other.rows,
        round=other.round._replace(size=sum(sizes)),
        facts=facts,
        diffuse=blend_rows(one.diffuse[place], other.diffuse, (1 - share, share)),
        reflected=blend_rows(one.reflected[place], other.reflected, (1 - share, share)),
        nets=join_nets(facts.patches.key, [Net(net.before, net.light[place]) for net in one.nets] + other.nets),
        emitted=one.emitted if other.round.alone else other.emitted,
        own=None,
        rest=one.rest if other.round.alone else merge_rest(one.rest, other.rest, weights),
        uneven=one.uneven if other.round.alone else merge_uneven(one.uneven, other.uneven, weights),
    )
    told = tell_noise(kept)
    still = weights[1] == 0
    return replace(kept, own=OwnNoise(*(np.where(still, a, b) for a, b in zip(one.own, told, strict=True))))


def merge_rest(one, other, weights):
    """OwnNoise of light that has numbers of its own in every round."""
    return OwnNoise(*(weights[0] ** 2 * a + weights[1] ** 2 * b for a, b in zip(one, other, strict=True)))


def join_nets(keys, nets):
    """Nets of which none continues the one before it: list of Net."""
    joined = []
    for net in nets:
        joined.append(net)
        while len(joined) > 1 and are_halves(*joined[-2:]):
            halves = joined[-2:]
            shifts = tuple(shift_points(keys, np.full(len(keys), half.before)) for half in halves)
            joined[-2:] = [Net(halves[0].before, merge_nets(shifts, tuple(half.light for half in halves)))]
    return joined


def are_halves(one, other):
    """Whether two nets are the halves of a larger one."""
    count = one.light.shape[1]
    same = count == other.light.shape[1] and other.before == one.before + count
    return same and one.before % (2 * count) == 0 and 2 * count <= MOST_POINTS


def merge_error_parts(one, other, weights, own):
    """ErrorParts of all rounds, whose replicates go on."""

    def mean(name):
        return blend_rows(getattr(one, name), getattr(other, name), weights)

    names = ("diffuse_passed_on", "direct_passed_on")
    return replace(one, **{name: mean(name) for name in names}, covariance=own.covariance, direct_points=own.points)


def merge_uneven(one, other, weights):
    """Uneven light of all rounds, of the sky and of the suns."""
    return tuple(
        mine
        and Uneven(
            blend_rows(mine.received, others.received, weights),
            weights[0] ** 2 * mine.variance + weights[1] ** 2 * others.variance,
            blend_rows(mine.light, others.light, weights),
        )
        for mine, others in zip(one, other, strict=True)
    )


def with_discretisation(parts, uneven):
    """ErrorParts with patch-size errors told from the light of all rounds.

    Those of single rounds, in which noise hides much of it and turns its sign, would cancel in their mean, though all
    rounds have the same patches.
    """
    for name, light in zip(("diffuse", "direct"), uneven, strict=True):
        if light is not None:
            left = patch_size_error(light, getattr(parts, f"{name}_passed_on"))
            parts = replace(parts, **{f"{name}_discretisation": left})
    return parts


def blend_rows(one, other, weights):
    """Weighted sum of two arrays with a weight for each row, or one for all."""
    first, second = (np.asarray(weight, one.dtype) for weight in weights)
    if first.ndim and one.ndim > 1:
        first, second = first[:, None], second[:, None]
    return first * one + second * other


def average_rows(matrix, other, weight):
    """Move a matrix of surfaces × suns towards another by a share of their difference, (n,), by blocks of rows."""
    weight = weight.astype(np.float32)[:, None]
    for first in range(0, len(matrix), ROWS):
        rows = slice(first, first + ROWS)
        matrix[rows] += weight[rows] * (other[rows] - matrix[rows])
