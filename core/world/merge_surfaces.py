"""Fewer surfaces for large maps: surfaces of a group that get much the same light are merged into
one.
"""

import heapq
from dataclasses import replace
from itertools import pairwise

import numpy as np


def merge_surfaces(environment, most):
    """An environment of at most some surfaces, with the same groups and areas.

    The mean direct light of a merged surface is exact for the directions of the grid, and so is
    everything that is linear: sky, far ground, reflections. What is lost is the spread of
    irradiance within it, on which the module's efficiency depends.

    Parameters
    ----------
    environment : Environment
    most : int
        Surfaces of the result; at least one for each group.

    Returns
    -------
    Environment
    """
    # An environment that is small enough stays as it is.
    if len(environment.weight) <= most:
        return environment
    block, weight = environment.block, environment.weight
    # What decides on the light of each surface, in few numbers: (n, k).
    count = len(block.visible_share)
    # Sixteen random projections of what a surface gets from each direction.
    mixer = np.random.default_rng(0).normal(size=(count, 16)).astype(np.float32) / np.sqrt(count)
    light = [
        block.visible_share.T @ mixer,
        block.diffuse[:, None],
        block.reflected.mean(axis=0)[:, None],
    ]
    # The normal counts beside them, twice as much as the mean light.
    features = np.concatenate([*light, 2.0 * block.normal.T], axis=1)
    # Pieces are split in two at the mean of the feature that differs most in them, until there are
    # as many as wanted; none has surfaces of two groups.
    pieces = _split_surfaces(features, weight, environment.first, most)
    group = np.array(
        [np.searchsorted(environment.first, rows[0], side="right") - 1 for rows in pieces]
    )
    pieces = [pieces[k] for k in np.argsort(group, kind="stable")]
    # Light of a piece is the mean of its surfaces by weight, exact for each direction.
    return replace(
        environment,
        first=np.searchsorted(np.sort(group), np.arange(len(environment.groups) + 1)).astype(
            np.int64
        ),
        weight=np.array([weight[rows].sum() for rows in pieces]),
        sources=_mean_of_pieces(environment.sources, weight, pieces).astype(np.float32),
        block=_merge_block(block, weight, pieces, environment.sky.direction),
    )


def _split_surfaces(features, share, first, most):
    """Split the groups at the mean of their widest feature until there are as many pieces as
    wanted.

    Parameters
    ----------
    features : numpy.ndarray, (n, k)
    share : numpy.ndarray, (n,)
        Weight of each surface in its group; all groups weigh the same.
    first : numpy.ndarray, (g + 1,)
        First surface of each group, and n.
    most : int

    Returns
    -------
    list of numpy.ndarray of int
        Surfaces of each piece.
    """
    done, waiting = [], []

    def add(rows):
        mean = np.average(features[rows], axis=0, weights=share[rows])
        spread = share[rows] @ (features[rows] - mean) ** 2
        widest = int(spread.argmax())
        left = features[rows, widest] <= mean[widest]
        if len(rows) > 1 and spread[widest] > 0 and left.any() and not left.all():
            heapq.heappush(waiting, (-float(spread[widest]), int(rows[0]), rows, left))
        else:
            done.append(rows)

    for start, stop in pairwise(first):
        add(np.arange(start, stop))
    while waiting and len(done) + len(waiting) < most:
        _, _, rows, left = heapq.heappop(waiting)
        add(rows[left])
        add(rows[~left])
    return done + [rows for _, _, rows, _ in waiting]


def _mean_of_pieces(values, weight, pieces):
    """Weighted means of the last axis over each piece."""
    return np.stack(
        [np.average(values[..., rows], axis=-1, weights=weight[rows]) for rows in pieces], axis=-1
    )


def _merge_block(block, weight, pieces, direction, *, grazing=0.05):
    """Weighted means of surfaces; the normals' mean is not of unit length, so that mean cosines are
    exact.
    """
    # Visible shares that give the mean direct light: the mean of visible share times cosine, over
    # the cosine of the mean normal.
    seen = []
    for rows in pieces:
        share, visible, normal = (
            weight[rows] / weight[rows].sum(),
            block.visible_share[:, rows],
            block.normal[:, rows],
        )
        projection = np.maximum(direction @ (normal @ share), 0.0)
        # `grazing`: cosine of incidence below which the visible share is the plain mean.
        exact = ((visible * np.maximum(direction @ normal, 0.0)) @ share) / np.maximum(
            projection, grazing
        )
        seen.append(np.where(projection > grazing, exact, visible @ share))
    # What is linear is a mean by weight; sources and weights of groups are left empty in the block.
    linear = ("normal", "diffuse", "far_ground", "sky", "iam", "reflected", "lit_share")
    means = {
        name: _mean_of_pieces(getattr(block, name), weight, pieces).astype(np.float32)
        for name in linear
    }
    return replace(
        block,
        **means,
        sources=np.zeros((0, len(pieces)), np.float32),  # the environment's count
        source_view=np.zeros((0, len(pieces)), np.float32),
        visible_share=np.stack(seen, axis=1).astype(np.float32),
        group_weight=np.zeros((len(pieces), 0), np.float32),
    )
