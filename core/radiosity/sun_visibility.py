"""Which share of each patch sees each sun."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from ..check_arrays import UNIT, check_array
from ..errors import InputError
from ..threads import map_in_order
from ..transfer.incidence import projection_in_front
from .shadow_points import count_elements, shadow_points

POINTS_PER_TASK = 1 << 14


@dataclass
class SunLight:
    """What p patches receive of s suns at first hit."""

    visible_share: np.ndarray  # (p, s) float32; 0 where the sun stands behind the patch
    seen: np.ndarray  # (p, s) uint16, bit c is set where the sun is visible from the point of cell c
    by_point: np.ndarray  # (p, m) float32, sum over the suns of weight times what each point receives
    representative_points: np.ndarray  # (p, cells) uint, which point speaks for each cell
    ray_count: int


def sun_visibility(ray_scene, patches, traced, unobstructed, covered, *, point_count, suns, behind, threads, progress):
    """Look from points of every traced patch to each sun that stands in front of it.

    Parameters
    ----------
    ray_scene : RayScene
    patches : Patches
    traced : (p,) bool
        Patches that need shadow rays.
    unobstructed : (p,) bool
        Patches with nothing in front of them: they see every sun in front of them, without a ray.
    covered : (p, c) bool
        Cells of each patch that lie inside or under something: points deep in those see no sun.
    point_count : int
        Points per patch, a power of two.
    suns : tuple of (s, 3) float32 and (s,) float32
        Unit vectors towards the suns, and the weight of each in `by_point`.
    behind : bool
        Look for suns behind a patch as well (they are never seen; it costs time only).
    threads : int
    progress : callable
        Called with the number of patches done.

    Returns
    -------
    SunLight

    Raises
    ------
    InputError
        If an array or a number cannot be used.
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
    found = SunLight(
        visible_share=np.zeros((count, len(directions)), np.float32),
        seen=np.zeros((count, len(directions)), np.uint16),
        by_point=np.zeros((count, point_count), np.float32),
        representative_points=np.zeros((count, count_elements(point_count)), np.min_scalar_type(point_count - 1)),
        ray_count=0,
    )
    free = np.flatnonzero(unobstructed)
    aoi_projection = projection_in_front(patches.normal[free], directions)
    found.visible_share[free] = aoi_projection > 0
    found.seen[free] = np.where(aoi_projection > 0, (1 << count_elements(point_count)) - 1, 0)
    found.by_point[free] = (aoi_projection @ suns[1].astype(np.float32))[:, None]

    rows = np.flatnonzero(traced)
    step = max(1, POINTS_PER_TASK // point_count)
    tasks = [rows[start : start + step] for start in range(0, len(rows), step)]

    def look(chosen):
        points = shadow_points(patches, chosen, covered[chosen], point_count)
        return trace_shadow_rays(ray_scene, patches, chosen, points, (directions, suns[1]), behind=behind, found=found)

    done = 0
    for chosen, ray_count in zip(tasks, map_in_order(look, tasks, threads), strict=True):
        found.ray_count += ray_count
        done += len(chosen)
        progress(done / len(rows), found.ray_count)
    return found


def trace_shadow_rays(ray_scene, patches, chosen, points, suns, *, behind, found):
    """Shadow rays from the points of some patches to all suns.

    Parameters
    ----------
    chosen : (c,) int
        The patches.
    points : tuple of (c, m, 3) float32, (c, m) bool and (c, cells) int
        Of `shadow_points`.
    suns : tuple of (s, 3) float32 and (s,) float32
        Directions and weights.
    behind : bool
    found : SunLight
        Written: the rows of these patches.

    Returns
    -------
    int
        Number of rays.
    """
    (position, *points), (directions, weights) = points, suns
    aoi_projection = projection_in_front(patches.normal[chosen], directions)
    wanted = np.ones(aoi_projection.shape, bool) if behind else aoi_projection > 0
    free = ray_scene.trace_shadow_rays(position, wanted, directions)
    light = found.visible_share, found.seen, found.by_point
    found.representative_points[chosen] = points[1]
    add_points(free, tuple(points), (aoi_projection, weights.astype(np.float32)), chosen, light)
    return int(wanted.sum()) * position.shape[1]


@njit(nogil=True, cache=True)
def add_points(free, points, suns, chosen, light):
    """Add up what the points of each patch see.

    Parameters
    ----------
    free : (c, s, m) bool
    points : tuple of (c, m) bool and (c, cells) int
        Which points are open, and which of them speak for the cells.
    suns : tuple of (c, s) float32 and (s,) float32
        Cosine of incidence of each sun, 0 where it stands behind, and its weight.
    chosen : (c,) int
        Rows of `light` that belong to the patches.
    light : tuple of (p, s) float32, (p, s) uint16 and (p, m) float32
        Written: as the first three of `SunLight`.
    """
    (open_points, representative_points), (aoi_projection, weights), (visible_share, seen, by_point) = (
        points,
        suns,
        light,
    )
    point_count, cells = open_points.shape[1], representative_points.shape[1]
    for patch in range(len(free)):
        row = chosen[patch]
        for sun in range(free.shape[1]):
            if aoi_projection[patch, sun] <= 0:
                continue
            visible = 0
            for point in range(point_count):
                visible += free[patch, sun, point] & open_points[patch, point]
            if visible == 0:
                continue
            weighted = weights[sun] * aoi_projection[patch, sun]
            if visible == point_count:
                for point in range(point_count):
                    by_point[row, point] += weighted
                visible_share[row, sun], seen[row, sun] = 1, (1 << cells) - 1
                continue
            for point in range(point_count):
                if free[patch, sun, point] & open_points[patch, point]:
                    by_point[row, point] += weighted
            bits = 0
            for cell in range(cells):
                point = representative_points[patch, cell]
                bits |= int(free[patch, sun, point] & open_points[patch, point]) << cell
            visible_share[row, sun], seen[row, sun] = np.float32(visible) / np.float32(point_count), bits
