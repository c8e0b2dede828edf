"""Variance of the direct light of patches, estimated from their shadow points."""

import functools
from typing import NamedTuple

import numpy as np

from ..effects.closed_form import sky_view_of_tilt
from ..patches.cover_cells import enclosed_cells
from ..patches.patches import take_patches
from ..rays.random_numbers import mix
from ..rays.sample_points import DIGITS, HEMISPHERE_REPLICATES, cell_of_point, cells_inside, grid_of, points_of_grid
from ..transfer.incidence import projection_in_front
from .replicates import Deviations
from .shadow_points import fill_from_nearest, place_points, places_of_points

# Variance of a net of 2, 4, … 1,024 points as a share of that of stratified points: computed for straight edges of
# shadow at any place and angle it is 0.38 to 0.59 (`tests/core/test_standard_errors.py`).
EVENNESS = 0.5
PLACES, NETS, MOST_POINTS = 16, 16, 256  # of nets laid over covered cells
WRONG_SIDE = 0.25  # of points along the edge of the covered part, in cells of which less than half is covered
LARGEST_STEP = 32767  # of 16-bit numbers


class SeenSky(NamedTuple):
    """What patches see of the sky."""

    share: np.ndarray  # (p,) float32, visible share
    rays: np.ndarray | int  # (p,) int or one for all, by which it was found


def variance_of_shadow_points(by_point, covered, patches, suns, sky):
    """Variance of the mean light of patches.

    It is estimated from differences of neighbouring points. Where part of a patch is covered, the number of points that
    lie in the open varies as well, and few points cannot tell how much: how even they are depends on whether the edge
    of the covered part runs along an edge of the patch, as those of many neighbours' roofs and walls do. The variance
    of their number is that of randomly shifted nets over the covered cells, whose course is known; differences of
    neighbours then tell that of the light in the open.

    Parameters
    ----------
    by_point : (p, m) float32
        Light at each point, weighted sum over the suns.
    covered : (p, cells) bool
        Cells, as a rule more of them than points, that lie inside or under something.
    patches : Patches
    suns : SunBlock
        Those in `by_point`.
    sky : SeenSky

    Returns
    -------
    (p,) float64
        NaN for a single point.
    """
    variance = variance_of_neighbours(by_point)
    partly = np.flatnonzero(covered.any(axis=1) & ~covered.all(axis=1))
    if len(partly) and by_point.shape[1] > 1:
        cells, normal = covered[partly], patches.normal[partly]
        filled, light = fill_covered(by_point[partly], cells, take_patches(patches, partly))
        dark = light == 0
        open_share = 1 - cells[dark].mean(axis=1)
        share, rays = (np.broadcast_to(part, len(covered))[partly[dark]] for part in sky)
        visible = share_of_sky(normal[dark], share, rays, open_share)
        unshaded = projection_in_front(normal[dark], suns.directions) @ suns.weights.astype(float)
        # Points may all have missed what is lit, by the rule of succession; and suns are hidden as the sky is.
        light[dark] = unshaded * visible / (1 + by_point.shape[1] * open_share)
        variance[partly] = variance_of_neighbours(filled) + light**2 * variance_of_cover(cells, by_point.shape[1])
    return variance


def fill_covered(by_point, covered, patches):
    """Replace dark points in or beside covered cells by the nearest of the other points of their patch.

    Parameters
    ----------
    by_point : (k, m) float32
    covered : (k, cells) bool
    patches : Patches
        These k.

    Returns
    -------
    filled : (k, m) float32
    beside : (k,) float64
        Root mean square of the light that replaces the dark points, which is that beside the covered part; of all
        points where none was replaced.
    """
    places = places_of_points(patches.key, patches.points_before, by_point.shape[1])
    near_cover = ~enclosed_cells(~covered)
    cell = cell_of_point(*places, round(np.sqrt(covered.shape[1]))).astype(np.intp)
    hidden = (by_point == 0) & np.take_along_axis(near_cover, cell, axis=1)
    filled, beside = by_point.copy(), np.empty(len(by_point))
    fill_from_nearest(places, hidden, filled, beside)
    return filled, beside


def share_of_sky(normal, sky, rays, open_share):
    """Visible share of the sky in the open part of patches, by the rule of succession: (k,) float64.

    Parameters
    ----------
    normal : (k, 3) float32
    sky : (k,) float32
        Share of the rays that reach the sky.
    rays : (k,) int
    open_share : (k,) float
    """
    unobstructed = sky_view_of_tilt(normal).astype(float) * open_share
    return np.minimum((sky * rays + 1) / (unobstructed * rays + 1), 1)


def variance_of_cover(covered, count):
    """Variance of the share of the points of a net that lie in the open: (k,) float64.

    Parameters
    ----------
    covered : (k, cells) bool
    count : int
        Points, a power of two.
    """
    used = min(count, MOST_POINTS)
    found = covered @ points_in_cells(used, covered.shape[1]).reshape(-1, covered.shape[1]).T / used
    variance = found.reshape(len(covered), PLACES, NETS).var(axis=2, ddof=1).mean(axis=1)
    return variance * used / count  # of more points than these as of independent ones, a bound


@functools.cache
def points_in_cells(count, cells):
    """Number of points in each cell, of nets with random digital shifts: (PLACES, NETS, cells) float64.

    All NETS of one place are moved by the same vector of up to half a cell: where in a cell the edge of the covered
    part runs is not known.
    """
    generator, divisions = np.random.default_rng(0), round(np.sqrt(cells))
    shift = (generator.random((PLACES * NETS, 2)) * (1 << DIGITS)).astype(np.uint32)
    places = np.empty((2, len(shift), count), np.float32)
    place_points(shift, (points_of_grid(count), grid_of(count)), places)
    moved = generator.uniform(-0.5, 0.5, (2, PLACES)) / divisions
    b1, b2 = np.abs(places + np.repeat(moved, NETS, axis=1)[:, :, None])
    outside = b1 + b2 > 1
    b1, b2 = np.where(outside, 1 - b2, b1), np.where(outside, 1 - b1, b2)
    cell = cell_of_point(np.clip(b1, 0, 1), np.clip(b2, 0, 1), divisions).astype(np.intp)
    found = np.zeros((len(shift), cells))
    np.add.at(found, (np.arange(len(shift))[:, None], cell), 1)
    return found.reshape(PLACES, NETS, cells)


def shares_of_cells(covered, cells):
    """Covered share of each of `cells` larger cells: (p, cells) float64, from (p, c) bool; 0 if they are not larger."""
    inside = cells_inside(round(np.sqrt(covered.shape[1])), round(np.sqrt(cells)))
    members = np.zeros((covered.shape[1], cells))
    members[np.arange(len(inside)), inside] = 1
    share, partly = np.zeros((len(covered), cells)), np.flatnonzero(covered.any(axis=1))
    share[partly] = covered[partly] @ (members / np.maximum(members.sum(axis=0), 1))
    return share


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
    The difference of two neighbours counts the gradient between them as noise; the contrast of four, with the gradients
    removed, does not. It gives the full variance of independent points, one in each stratum. The points of a digital
    net are more even: where the straight edge of a shadow crosses the patch anywhere, EVENNESS of it remains. For light
    with a gradient only, all of it remains, since all points lie at the same place of their rectangles.

    References
    ----------
    W. G. Cochran (1977), Sampling techniques, 3rd ed., 8.11 (successive differences).
    """
    count = by_point.shape[1]
    if count < 2:
        return np.full(len(by_point), np.nan)
    if count < 4:
        return EVENNESS * (by_point[:, 0] - by_point[:, 1]).astype(float) ** 2 / count**2
    contrast, across, along = (found.astype(float) ** 2 for found in differences(by_point))
    uneven = contrast.sum(axis=(1, 2))
    # A gradient over a rectangle of length 1 has variance 1/12; the differences contain the contrast's noise as well.
    sloping = 4 * (across + along - contrast / 2).sum(axis=(1, 2)) / 12
    return (EVENNESS * uneven + (1 - EVENNESS) * np.clip(sloping, 0, uneven)) / count**2


def spread_of_elements(by_point, representative_points, covered):
    """Standard error of the annual light of the patches' elements (cells) under the suns.

    Shadow points have no replicates that are as evenly distributed as all of them together. The light of each cell is
    that of one point; its error is about the contrast of four neighbouring points, with their gradient removed.

    Parameters
    ----------
    by_point : (p, m) float32
    representative_points : (p, cells) uint
    covered : (p, c) bool
        Cells, usually more of them than points, that lie inside or under something. No point in them represents a
        cell in the open.

    Returns
    -------
    (p, cells) float32
    """
    spread = spread_of_points(by_point)
    partly = np.flatnonzero(covered.any(axis=1) & ~covered.all(axis=1))
    filled = fill_dark(by_point[partly])
    spread[partly] = spread_of_points(filled)
    spread = np.take_along_axis(spread, representative_points.astype(np.intp), axis=1)  # (p, cells)
    # In a cell on the edge of the covered part, the representative point may lie on the wrong side of it.
    share = shares_of_cells(covered[partly], spread.shape[1])
    line = filled.mean(axis=1, keepdims=True) * np.sqrt(WRONG_SIDE * share * (1 - share))
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
    Deviations
    """
    spread *= np.float32(np.sqrt(HEMISPHERE_REPLICATES))
    largest = float(spread.max(initial=0))
    step = np.float32(largest / LARGEST_STEP) if largest > 0 else np.float32(1)
    bits = mix(keys[:, None] ^ mix(np.arange(1, spread.shape[1] + 1, dtype=np.uint64)))
    deviation = np.empty((*spread.shape, HEMISPHERE_REPLICATES), np.int16)
    for replicate in range(HEMISPHERE_REPLICATES):
        sign = 1 - 2 * ((bits >> np.uint64(replicate)) & np.uint64(1)).astype(np.float32)
        deviation[:, :, replicate] = np.rint(sign * spread / step)
    return Deviations(deviation, step)


def fill_dark(by_point):
    """Replace dark points by the mean of the lit points of their patch: (p, m) float32."""
    lit = by_point > 0
    mean = by_point.sum(axis=1) / np.maximum(lit.sum(axis=1), 1)
    return np.where(lit, by_point, mean[:, None]).astype(np.float32)


def spread_of_points(by_point):
    """Standard deviation of each point about the mean light of its part of the patch: (p, m) float32.

    Up to 16 points, from the contrast of squares of four neighbours, with their gradients removed. With more points,
    each part contains several, and their own standard deviation is used.
    """
    count, parts = by_point.shape
    if parts < 4:
        return np.repeat(by_point.std(axis=1, ddof=1)[:, None], parts, axis=1) if parts > 1 else np.zeros_like(by_point)
    if parts <= 16:
        rows, columns = grid_of(parts)
        contrast = differences(by_point)[0]  # (p, rows / 2, columns / 2)
        spread = np.broadcast_to((np.abs(contrast) / 2)[:, :, None, :, None], (count, rows // 2, 2, columns // 2, 2))
        return spread.reshape(count, parts).astype(np.float32)
    (rows, columns), (down, across) = grid_of(parts), (4, 4)
    part = by_point.reshape(count, down, rows // down, across, columns // across)
    spread = part.std(axis=(2, 4), keepdims=True, ddof=1)
    return np.broadcast_to(spread, part.shape).reshape(count, parts).astype(np.float32)


def differences(by_point):
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
    rows, columns = grid_of(by_point.shape[1])
    square = by_point.reshape(len(by_point), rows // 2, 2, columns // 2, 2)
    a, b, c, d = (square[:, :, row, :, column] for row in (0, 1) for column in (0, 1))
    return a - b - c + d, (a - b + c - d) / 2, (a + b - c - d) / 2
