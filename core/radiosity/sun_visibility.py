"""Visible share of each patch for each sun, by shadow rays.

Patches that only pass light on look at each sun from some of their points, in turn: four suns on, or sixteen where
they are hardly seen, each point has looked at one of them. So their light is resolved by as many cells as any.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numba import njit

from ..patches.patches import order_nearby
from ..rays.random_numbers import mix
from ..settings.errors import UNIT, InputError, check_array
from ..settings.threads import map_in_order
from ..transfer.incidence import projection_in_front
from .shadow_points import KnownPoints, ShadowPoints, count_elements, shadow_points, split_net, unknown_points
from .sun_blocks import SunBlock

POINTS_PER_TASK = 1 << 14
NONE, ONE = np.float32(0), np.float32(1)


@dataclass
class SunLight:
    """Light of s suns on p patches, before reflections."""

    visible_share: np.ndarray  # (p, s) float32; 0 where the sun is behind the patch
    visible_elements: np.ndarray  # (p, s) uint16, bit c is set where the sun is visible from the point of cell c
    point_weight: np.ndarray  # (p,) float32, number of cells that one of which a bit may be set for a sun stands for
    by_point: np.ndarray  # (p, m) float32, irradiance of each point, weighted sum over the suns
    known: KnownPoints
    ray_count: int

    def among(self, traced):
        """The same among more suns, (n,) bool, none of which is visible but those that were traced: SunLight."""
        wide = [np.zeros((len(part), len(traced)), part.dtype) for part in (self.visible_share, self.visible_elements)]
        wide[0][:, traced], wide[1][:, traced] = self.visible_share, self.visible_elements
        return replace(self, visible_share=wide[0], visible_elements=wide[1])


class SunsInTurns(NamedTuple):
    """Suns of a block, each of which is looked at from one in `turns` of the points."""

    block: SunBlock
    before: int  # number of suns before this block
    turns: int  # a power of two


class SunsOfTurn(NamedTuple):
    """Suns that are looked at from the same points."""

    directions: np.ndarray  # (s, 3) float32
    weights: np.ndarray  # (s,) float32
    columns: np.ndarray  # (s,) int, of `SunLight.visible_share`


def sun_visibility(
    ray_scene,
    patches,
    traced,
    unobstructed,
    covered,
    *,
    point_count,
    suns,
    behind,
    threads,
    progress,
    turns=None,
    first_sun=0,
    known=None,
):
    """Trace shadow rays from points of every traced patch to each sun in front of it.

    Parameters
    ----------
    ray_scene : RayScene
    patches : Patches
    traced : (p,) bool
        Patches that need shadow rays.
    unobstructed : (p,) bool
        Patches with nothing in front of them: every sun in front of them is visible, without a ray.
    covered : (p, c) bool
        Cells of each patch that lie inside or under something: no sun is visible from points deep inside them.
    point_count : int
        Points per patch, a power of two.
    suns : SunBlock
        With their weights in `by_point`.
    behind : bool
        Trace rays to suns behind a patch as well (they are never visible; this only costs time).
    threads : int
    progress : callable
        Called with the share of patches done and the number of rays traced.
    turns : (p,) int, optional
        Patches look at each sun from one in so many of their points, a power of two; from all if not given.
    first_sun : int
        Number of suns before this block.
    known : KnownPoints, optional
        Of the same patches, from an earlier block.

    Returns
    -------
    SunLight

    Raises
    ------
    InputError
        If an array or a number is invalid.
    """
    count = len(patches)
    directions = check_array("directions of the suns", suns[0], ("s", 3), least=-1 - UNIT, most=1 + UNIT)
    check_array("weights of the suns", suns[1], (len(directions),), least=0, most=1 + UNIT)
    for name, values in (("traced", traced), ("unobstructed", unobstructed)):
        check_array(name, values, (count,), kind="b")
    cells = check_array("covered", covered, (count, "c"), kind="b").shape[1]
    if point_count < 1 or point_count.bit_count() > 1:
        raise InputError("point_count", f"{point_count} is not a power of two", "give 1, 2, 4, 8, 16 …")
    if cells < 1 or round(np.sqrt(cells)) ** 2 != cells:
        raise InputError("cells of covered", f"{cells} is not a square number", "give 1, 4, 9, 16 …")
    elements = count_elements(point_count)
    found = SunLight(
        visible_share=np.zeros((count, len(directions)), np.float32),
        visible_elements=np.zeros((count, len(directions)), np.uint16),
        point_weight=np.ones(count, np.float32),
        by_point=np.zeros((count, point_count), np.float32),
        known=known or unknown_points(count, point_count),
        ray_count=0,
    )
    free = np.flatnonzero(unobstructed)
    aoi_projection = projection_in_front(patches.normal[free], directions)
    open_share = 1 - covered[free].mean(axis=1, dtype=np.float32)  # below 1 only where shadow rays are switched off
    found.visible_share[free] = (aoi_projection > 0) * open_share[:, None]
    found.visible_elements[free] = np.where(aoi_projection > 0, (1 << elements) - 1, 0)
    found.by_point[free] = (open_share * (aoi_projection @ suns[1].astype(np.float32)))[:, None]

    turns = np.ones(count, int) if turns is None else np.where(traced, turns, 1)
    found.point_weight[:] = turns
    step = max(1, min(POINTS_PER_TASK // point_count, -(-int(traced.sum()) // threads)))
    tasks = []
    for many in np.unique(turns[traced]):
        rows = np.flatnonzero(traced & (turns == many))
        # Several patches share a packet of rays then, and should lie side by side.
        rows = rows if many == 1 else rows[order_nearby(patches.corner[rows])]
        tasks += [(rows[start : start + step], int(many)) for start in range(0, len(rows), step)]

    def trace_rows(task):
        chosen, turns = task
        points = shadow_points(patches, chosen, covered[chosen], point_count, known and known.take(chosen))
        if known is None:
            found.known.put(chosen, points)
        in_turns = SunsInTurns(suns, first_sun, turns)
        return trace_in_turns(ray_scene, patches, chosen, points, in_turns, behind=behind, found=found)

    done, whole = 0, sum(len(chosen) / turns for chosen, turns in tasks)
    for (chosen, turns), ray_count in zip(tasks, map_in_order(trace_rows, tasks, threads), strict=True):
        found.ray_count += ray_count
        done += len(chosen) / turns
        progress(done / whole, found.ray_count)
    return found


def trace_in_turns(ray_scene, patches, chosen, points, suns, *, behind, found):
    """Shadow rays from the points of some patches to all suns.

    Parameters
    ----------
    chosen : (c,) int
        The patches.
    points : ShadowPoints
    suns : SunsInTurns
    behind : bool
    found : SunLight
        Written: the rows of these patches.

    Returns
    -------
    int
        Number of rays.
    """
    (directions, weights), before, turns = suns
    parts = split_net(points.open_points.shape[1], turns)
    begun = mix(patches.key[chosen] ^ np.uint64(0x7142)) % np.uint64(turns)
    ray_count = 0
    for turn in range(turns):
        first = (turn - before) % turns
        taken = parts[(turn + begun.astype(int)) % turns]
        some = points if turns == 1 else take_points(points, taken)
        columns = np.arange(first, len(directions), turns)
        part = SunsOfTurn(directions[first::turns], turns * weights[first::turns], columns)
        ray_count += trace_shadow_rays(ray_scene, patches, chosen, some, part, taken=taken, behind=behind, found=found)
    return ray_count


def take_points(points, taken):
    """Some points of each patch, (c, k) int: ShadowPoints, where representatives that are not among them are -1."""
    place = np.full(points.open_points.shape, -1)
    np.put_along_axis(place, taken, np.arange(taken.shape[1])[None], axis=1)
    return ShadowPoints(
        np.take_along_axis(points.position, taken[:, :, None], axis=1),
        np.take_along_axis(points.open_points, taken, axis=1),
        np.take_along_axis(place, points.representative_points.astype(int), axis=1),
    )


def trace_shadow_rays(ray_scene, patches, chosen, points, suns, *, taken, behind, found):
    """Shadow rays from the points of some patches to some suns; as `trace_in_turns`.

    Parameters
    ----------
    suns : SunsOfTurn
    taken : (c, k) int
        Columns of `found.by_point`.
    """
    aoi_projection = projection_in_front(patches.normal[chosen], suns.directions)
    wanted = np.ones(aoi_projection.shape, bool) if behind else aoi_projection > 0
    free = ray_scene.trace_shadow_rays(points.position, wanted, suns.directions)
    light = found.visible_share, found.visible_elements, found.by_point
    lit = aoi_projection, suns.weights.astype(np.float32), suns.columns
    add_points(free, (points.open_points, points.representative_points, taken), lit, chosen, light)
    return int(np.count_nonzero(wanted)) * points.position.shape[1]


@njit(nogil=True, cache=True, fastmath={"reassoc"})
def add_points(free, points, suns, chosen, light):
    """Add up the light at the points of each patch.

    Parameters
    ----------
    free : (c, s, m) bool
    points : tuple of (c, m) bool, (c, cells) int and (c, m) int
        Which points are open, which of them represents each cell (negative: none), and their columns.
    suns : tuple of (c, s) float32, (s,) float32 and (s,) int
        Cosine of incidence of each sun, 0 where it is behind the patch, its weight, and its column.
    chosen : (c,) int
        Rows of `light` that belong to the patches.
    light : tuple of (p, s) float32, (p, s) uint16 and (p, m) float32
        Written: the first fields of `SunLight`.
    """
    open_points, representative_points, taken = points
    (aoi_projection, weights, columns), (visible_share, visible_elements, by_point) = suns, light
    point_count, cells = open_points.shape[1], representative_points.shape[1]
    total = np.empty(point_count, np.float32)
    for patch in range(len(free)):
        row, every, is_open = chosen[patch], 0, open_points[patch]
        for cell in range(cells):
            every |= int(representative_points[patch, cell] >= 0) << cell
        for point in range(point_count):
            total[point] = by_point[row, taken[patch, point]]
        for sun in range(free.shape[1]):
            if aoi_projection[patch, sun] <= 0:
                continue
            weighted, visible, seen = weights[sun] * aoi_projection[patch, sun], NONE, free[patch, sun]
            for point in range(point_count):
                lit = seen[point] & is_open[point]
                visible += ONE if lit else NONE
                total[point] += weighted if lit else NONE
            if visible == 0:
                continue
            bits = every
            if visible < point_count:
                bits = 0
                for cell in range(cells):
                    point = representative_points[patch, cell]
                    if point >= 0:
                        bits |= int(seen[point] & is_open[point]) << cell
            visible_share[row, columns[sun]] = visible / np.float32(point_count)
            visible_elements[row, columns[sun]] = bits
        for point in range(point_count):
            by_point[row, taken[patch, point]] = total[point]
