"""Variance of the direct light of patches, estimated from their shadow points."""

import numpy as np

from ..rays.random_numbers import mix
from ..rays.sample_points import HEMISPHERE_REPLICATES
from .light_errors import shares_of_cells
from .shadow_points import grid_of

# Variance of a net of 2, 4, … 1,024 points as a share of the variance of stratified points:
# computed for straight edges of shadow at any place and angle it is 0.38 to 0.59
# (`tests/core/test_standard_errors.py`).
EVENNESS = 0.5


def variance_of_neighbours(by_point):
    """Variance of the mean of stratified points, estimated from squares of four neighbours.

    Parameters
    ----------
    by_point : (p, m) float32
        For m a power of two, in the order of `points_of_grid`.

    Returns
    -------
    (p,) float64
        NaN for a single point.

    Notes
    -----
    The difference of two neighbours counts the gradient between them as noise; the contrast of
    four, with the gradients removed, does not. It gives the full variance of independent points,
    one in each stratum. The points of a digital net are more even: where the straight edge of a
    shadow crosses the patch anywhere, EVENNESS of it remains. For light with a gradient only, all
    of it remains, since all points lie at the same place of their rectangles.

    References
    ----------
    W. G. Cochran (1977), Sampling techniques, 3rd ed., 8.11 (successive differences).
    """
    count = by_point.shape[1]
    if count < 2:
        return np.full(len(by_point), np.nan)
    if count < 4:
        return EVENNESS * (by_point[:, 0] - by_point[:, 1]).astype(float) ** 2 / count**2
    # contrast  a - b - c + d of each square of four; across, along  its mean gradients.
    contrast, across, along = (found.astype(float) ** 2 for found in _differences(by_point))
    uneven = contrast.sum(axis=(1, 2))
    # A gradient over a rectangle of length 1 has variance 1/12; the differences contain the
    # contrast's noise as well.
    sloping = 4 * (across + along - contrast / 2).sum(axis=(1, 2)) / 12
    return (EVENNESS * uneven + (1 - EVENNESS) * np.clip(sloping, 0, uneven)) / count**2


def variance_of_points(nets, covered, unshaded):
    """Variance of the mean annual light of patches at all their shadow points.

    Parameters
    ----------
    nets : list of (p, m) float32
        Light at the points of each net, in the order of `points_of_grid`.
    covered : (p,) float
        Covered share.
    unshaded : (p,) float
        Light of a point in the open that nothing shades.

    Returns
    -------
    (p,) float64
        NaN for a single point.

    Notes
    -----
    Where part of a patch is covered, few points may all lie on one side of the edge of that part,
    and agree. A straight edge crosses about √m of m strata, and in each a point lies on either side
    at random.
    """
    # Nets have as much weight as they have points.
    count = sum(light.shape[1] for light in nets)
    variance = sum((light.shape[1] / count) ** 2 * variance_of_neighbours(light) for light in nets)
    # At the edge of a covered part: points that are lit by chance may all agree, so the variance is
    # at least as for the toss of a coin at each of √m points along the edge.
    partly = np.flatnonzero((covered > 0) & (covered < 1))
    by_point, covered = np.concatenate([light[partly] for light in nets], axis=1), covered[partly]
    lit = (by_point > 0).sum(axis=1)
    light = by_point.sum(axis=1, dtype=float) / np.maximum(lit, 1)
    # by the rule of succession
    light = np.where(lit > 0, light, unshaded[partly] / (1 + count * (1 - covered)))
    least = EVENNESS * light**2 * np.sqrt(covered * (1 - covered)) / (2 * count**1.5)
    variance[partly] = np.maximum(variance[partly], least)
    return variance


def spread_of_elements(by_point, representative_points, covered):
    """Standard error of the annual light of the patches' elements (cells) under the suns.

    Shadow points have no replicates that are as evenly distributed as all of them together. The
    light of each cell is measured at one point; its error is about the contrast of four
    neighbouring points, with their gradient removed.

    Parameters
    ----------
    by_point : (p, m) float32
    representative_points : (p, cells) uint
    covered : (p, c) bool
        Cells, usually more of them than points, that lie inside or under something. No point in
        them represents a cell in the open.

    Returns
    -------
    (p, cells) float32
    """
    # In the open: the contrast of the point that measures the cell.
    spread = _spread_of_points(by_point)
    # Partly covered patches: points inside something are dark, which is no noise of the light.
    partly = np.flatnonzero(covered.any(axis=1) & ~covered.all(axis=1))
    filled = by_point[partly]  # dark points get the mean of those that are lit
    mean = filled.sum(axis=1, keepdims=True) / np.maximum(
        (filled > 0).sum(axis=1, keepdims=True), 1
    )
    filled = np.where(filled > 0, filled, mean).astype(np.float32)
    spread[partly] = _spread_of_points(filled)
    spread = np.take_along_axis(spread, representative_points.astype(np.intp), axis=1)  # (p, cells)
    # In a cell on the edge of the covered part, the representative point may lie on the wrong side
    # of it.
    share = shares_of_cells(covered[partly], spread.shape[1])
    # A quarter of the points along the edge of the covered part lie in cells that are covered by
    # less than half.
    line = filled.mean(axis=1, keepdims=True) * np.sqrt(0.25 * share * (1 - share))
    spread[partly] = np.hypot(spread[partly], line)
    return spread


def deviations_of_spread(spread, keys):
    """Deviations of four replicates of light with known standard errors: independent random signs.

    Parameters
    ----------
    spread : (p, cells) float32
        Overwritten.
    keys : (p,) uint64
        Keys of the patches' random numbers.

    Returns
    -------
    deviation : (p, cells, HEMISPHERE_REPLICATES) int16
    step : float32
        Their unit.
    """
    # Four replicates whose mean has the given standard error: each deviates by twice that, with a
    # random sign.
    spread *= np.float32(np.sqrt(HEMISPHERE_REPLICATES))
    # Rounded to 16 bits, in units such that the largest just fits.
    largest = float(spread.max(initial=0))
    # Steps are 16-bit numbers.
    step = np.float32(largest / 32767) if largest > 0 else np.float32(1)
    bits = mix(keys[:, None] ^ mix(np.arange(1, spread.shape[1] + 1, dtype=np.uint64)))
    deviation = np.empty((*spread.shape, HEMISPHERE_REPLICATES), np.int16)
    for replicate in range(HEMISPHERE_REPLICATES):
        sign = 1 - 2 * ((bits >> np.uint64(replicate)) & np.uint64(1)).astype(np.float32)
        deviation[:, :, replicate] = np.rint(sign * spread / step)
    return deviation, step


def _spread_of_points(by_point):
    """Standard deviation of each point about the mean light of its part of the patch: (p, m)
    float32.

    Up to 16 points, from the contrast of squares of four neighbours, with their gradients removed.
    With more points, each part contains several, and their own standard deviation is used.
    """
    count, parts = by_point.shape
    # Too few points for squares: their own standard deviation.
    if parts < 4:
        return (
            np.repeat(by_point.std(axis=1, ddof=1)[:, None], parts, axis=1)
            if parts > 1
            else np.zeros_like(by_point)
        )
    # A square of four: half its contrast is the deviation of each of its points.
    if parts <= 16:
        rows, columns = grid_of(parts)
        contrast = _differences(by_point)[0]  # (p, rows / 2, columns / 2)
        spread = np.broadcast_to(
            (np.abs(contrast) / 2)[:, :, None, :, None], (count, rows // 2, 2, columns // 2, 2)
        )
        return spread.reshape(count, parts).astype(np.float32)
    # Many points: the standard deviation within each of 4 × 4 parts of the patch.
    (rows, columns), (down, across) = grid_of(parts), (4, 4)
    part = by_point.reshape(count, down, rows // down, across, columns // across)
    spread = part.std(axis=(2, 4), keepdims=True, ddof=1)
    return np.broadcast_to(spread, part.shape).reshape(count, parts).astype(np.float32)


def _differences(by_point):
    """Differences within each square of four neighbours.

    Parameters
    ----------
    by_point : (p, m) float32
        For m = 4, 8, 16 …, in the order of `points_of_grid`.

    Returns
    -------
    contrast, across, along : (p, rows / 2, columns / 2) float32
        The contrast a - b - c + d, free of gradients, and the mean gradients from point to point.
    """
    # Points in rows and columns, cut into squares:  a b / c d
    rows, columns = grid_of(by_point.shape[1])
    square = by_point.reshape(len(by_point), rows // 2, 2, columns // 2, 2)
    # a b   light that is a plane over the square has a - b = c - d,
    # c d   and so no contrast
    a, b, c, d = (square[:, :, row, :, column] for row in (0, 1) for column in (0, 1))
    return a - b - c + d, (a - b + c - d) / 2, (a + b - c - d) / 2
