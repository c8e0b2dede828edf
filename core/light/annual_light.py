"""Direct light of patches as the sum over all suns by their weights, and what it brings to the
surfaces.

    shadow points ─► light at each ─► mean of the patch, its elements, and their errors ─►
    `solve_light`

Further rounds add points, in the same sequence for each patch: where they complete a larger net,
their error is told from it as a whole.
"""

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from ..rays.random_numbers import mix
from ..rays.sample_points import DIGITS, HEMISPHERE_REPLICATES
from .direct_errors import deviations_of_spread, spread_of_elements, variance_of_points
from .merge_transfers import blend, blend_variance
from .shadow_points import grid_of, points_of_grid, shift_points
from .solve_light import solve_light
from .sun_visibility import projection_in_front, work_in_slices
from .traced import FirstLight


class _Net(NamedTuple):
    """Light at the points of a digital net on each of k patches."""

    before: int  # points of the sequence before it
    light: np.ndarray  # (k, m) float32, in the order of `points_of_grid`


@dataclass
class Annual:
    """Light of p patches without reflections."""

    # (p, m) float32, at the points of the first round; 0 where it does not count
    by_point: np.ndarray
    elements: np.ndarray | None  # (p, elements) float32; None where no further round needs them
    spread: np.ndarray | None  # (p, elements) float32, standard error of the former; likewise
    light: np.ndarray  # (p,) float64
    variance: np.ndarray  # (p,) float64, of the former; NaN: one point gives none
    unshaded: np.ndarray  # (p,) float64, light where nothing shades
    lit_ground: float  # radiosity of the far ground
    sent: np.ndarray  # (p,) bool, patches that sent shadow rays
    suns: int  # that they were sent to
    # (k,) int, patches whose points go on in one net, ascending; None: all
    rows: np.ndarray | None = None
    nets: list = field(default_factory=list)  # of Net, of these; empty after the first round


def light_unshaded(patches, suns, threads):
    """Light of some suns, a SunBlock, on patches if nothing stood in the way: (p,) float64."""
    (directions, weights), normal = suns, patches.normal
    facing = work_in_slices(
        lambda rows: projection_in_front(normal[rows], directions).astype(float) @ weights,
        len(normal),
        threads,
    )
    return np.concatenate([np.zeros(0), *facing])


def sum_suns(context, traced, watch, by_point, suns, *, unshaded):
    """Annual light.

    Parameters
    ----------
    context : GatherContext
    traced : Traced
    watch : SunWatch
    by_point : (p, m) float32
        Light at the points that this looked from. Set to 0 where it does not count.
    suns : SunBlock
        All that are in it.
    unshaded : (p,) float64
        Of `light_unshaded`.

    Returns
    -------
    Annual
    """
    # Light of all suns of a year: of points, elements and patches, with its variance, and what
    # level ground passes on.
    directions, weights = suns
    # Elements get the light of the point that stands for each, with its error.
    elements, spread = np.zeros((2, len(by_point), context.elements), np.float32)
    if context.bounces and watch.points is not None:
        points = watch.points.representative_points
        elements = np.take_along_axis(by_point, points.astype(np.intp), axis=1)
        spread = spread_of_elements(by_point, points, traced.covered)
    # Points without room for modules do not count for the surface, though they reflect.
    if context.left_out is not None and watch.points is not None:
        rows = np.flatnonzero(context.left_out)
        by_point[rows] = np.where(watch.points.find_dark(rows), 0, by_point[rows])
    variance = variance_of_points([by_point], context.dark_share(traced), unshaded)
    albedo = context.ground_albedo if context.plan.far_ground else 0.0
    return Annual(
        by_point=by_point,
        elements=elements,
        spread=spread,
        light=by_point.mean(axis=1, dtype=float),
        variance=np.where(watch.traced, variance, 0),  # else known exactly
        unshaded=unshaded,
        lit_ground=albedo * float(weights @ np.maximum(directions[:, 2], 0)),
        sent=watch.traced,
        suns=len(weights),
    )


def solve_annual(context, traced, annual, report=lambda done: None):
    """Light of surfaces under all suns by their weights, reflections included: Light, per DNI.

    `report` is as in `solve_light`.
    """
    patches = context.patches
    keys = patches.key ^ mix(patches.points_before.astype(np.uint64))
    light = np.repeat(annual.light[:, None].astype(np.float32), HEMISPHERE_REPLICATES, axis=1)
    first = FirstLight(light, annual.elements, *deviations_of_spread(annual.spread.copy(), keys))
    # One point of a patch that sees one of the suns otherwise.
    count = max([annual.by_point.shape[1], sum(net.light.shape[1] for net in annual.nets)])
    look = np.where(annual.sent, annual.unshaded, 0) / (count * max(annual.suns, 1))
    how = {"points": annual.variance, "look": look * (context.dark_share(traced) < 1)}
    return solve_light(context, traced, first, annual.lit_ground, **how, report=report)


def add_points(one, new, share, *, keys, before, whole, covered):
    """Annual of all points so far.

    Parameters
    ----------
    one, new : Annual
        Of the points before, and of further ones.
    share : (p,) float64
        Of the new points in all of each patch; 0 where there are none.
    keys : (p,) uint64
        Of the patches' random numbers.
    before : int
        Points of the sequence before the new ones.
    whole : (p,) bool
        Patches that look at all suns from each point, so that their points go on in one net.
    covered : (p,) float
        Covered share.
    """
    rows = np.flatnonzero(whole & new.sent)
    # Points of a patch that go on in one net are judged as one net: it is more even than its parts.
    nets = _join_nets(
        keys[rows], [*(one.nets or [_Net(0, one.by_point[rows])]), _Net(before, new.by_point[rows])]
    )
    variance = blend_variance(one.variance, new.variance, share)
    variance[rows] = variance_of_points(
        [net.light for net in nets], covered[rows], one.unshaded[rows]
    )
    spread = np.sqrt(blend_variance(one.spread**2, new.spread**2, share[:, None])).astype(
        np.float32
    )
    return replace(
        one,
        elements=blend(one.elements, new.elements, share),
        spread=spread,
        light=blend(one.light, new.light, share),
        variance=variance,
        rows=rows,
        nets=nets,
    )


def _join_nets(keys, nets):
    """Nets, joined where one continues another: list of Net."""
    joined = []
    for net in nets:
        joined.append(net)
        while len(joined) > 1:
            one, other = joined[-2:]
            count = one.light.shape[1]
            # Two nets of the same size, one right after the other at a multiple of both, are halves
            # of a larger one.
            halves = count == other.light.shape[1] and other.before == one.before + count
            # Larger nets stay apart.
            if not halves or one.before % (2 * count) or 2 * count > 1024:
                break
            shifts = tuple(
                shift_points(keys, np.full(len(keys), half.before)) for half in (one, other)
            )
            joined[-2:] = [_Net(one.before, _merge_nets(shifts, (one.light, other.light)))]
    return joined


def _merge_nets(shifts, halves):
    """Values at the points of two halves of a net with digital shifts, in the order of
    `points_of_grid`.

    Parameters
    ----------
    shifts : tuple of (c, 2) uint32 and (c, 2) uint32
        Digital shifts of each half.
    halves : tuple of (c, m) float32 and (c, m) float32
        In the order of `points_of_grid(m)`.

    Returns
    -------
    (c, 2 m) float32
    """
    count, points = halves[0].shape
    (rows, columns), (finer_rows, finer_columns) = grid_of(points), grid_of(2 * points)
    row, column = np.divmod(np.arange(points), columns)
    whole = np.empty((count, 2 * points), np.float32)
    for shift, values in zip(shifts, halves, strict=True):
        # As in `place_points`: which point lies in each rectangle, and then in which of the finer
        # grid.
        along, across = shift.astype(np.int64).T[:, :, None]
        place = (row ^ (across * rows >> DIGITS)) * columns + (column ^ (along * columns >> DIGITS))
        u, v = np.moveaxis(points_of_grid(points).astype(np.int64)[place], -1, 0) ^ np.stack(
            [along, across]
        )
        finer = (v * finer_rows >> DIGITS) * finer_columns + (u * finer_columns >> DIGITS)
        np.put_along_axis(whole, finer, values, axis=1)
    return whole
