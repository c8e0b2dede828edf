"""Visible share of each patch for each sun, by shadow rays."""

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
    """Light of s suns on p patches, before reflections."""

    visible_share: np.ndarray  # (p, s) float32; 0 where the sun is behind the patch
    visible_elements: np.ndarray  # (p, s) uint16, bit c is set where the sun is visible from the point of cell c
    by_point: np.ndarray  # (p, m) float32, irradiance of each point, weighted sum over the suns
    representative_points: np.ndarray  # (p, cells) uint, the point that represents each cell
    ray_count: int


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
    elements=None,
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
    elements : int, optional
        Cells of a patch by which its light is resolved; by default as many as the points allow.

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
    elements = elements or count_elements(point_count)
    found = SunLight(
        visible_share=np.zeros((count, len(directions)), np.float32),
        visible_elements=np.zeros((count, len(directions)), np.uint16),
        by_point=np.zeros((count, point_count), np.float32),
        representative_points=np.zeros((count, elements), np.min_scalar_type(point_count - 1)),
        ray_count=0,
    )
    free = np.flatnonzero(unobstructed)
    aoi_projection = projection_in_front(patches.normal[free], directions)
    found.visible_share[free] = aoi_projection > 0
    found.visible_elements[free] = np.where(aoi_projection > 0, (1 << elements) - 1, 0)
    found.by_point[free] = (aoi_projection @ suns[1].astype(np.float32))[:, None]

    rows = np.flatnonzero(traced)
    step = max(1, min(POINTS_PER_TASK // point_count, -(-len(rows) // threads)))
    tasks = [rows[start : start + step] for start in range(0, len(rows), step)]

    def trace_rows(chosen):
        points = shadow_points(patches, chosen, covered[chosen], point_count, elements)
        return trace_shadow_rays(ray_scene, patches, chosen, points, suns, behind=behind, found=found)

    done = 0
    for chosen, ray_count in zip(tasks, map_in_order(trace_rows, tasks, threads), strict=True):
        found.ray_count += ray_count
        done += len(chosen)
        progress(done / len(rows), found.ray_count)
    return found


def put_in(light, rows, seen, copies):
    """Write the light of some patches, each of their points standing for as many as `copies`, into that of all."""
    light.visible_share[rows], light.visible_elements[rows] = seen.visible_share, seen.visible_elements
    light.by_point[rows] = np.repeat(seen.by_point, copies, axis=1)
    light.representative_points[rows] = seen.representative_points * copies
    light.ray_count += seen.ray_count


def trace_shadow_rays(ray_scene, patches, chosen, points, suns, *, behind, found):
    """Shadow rays from the points of some patches to all suns.

    Parameters
    ----------
    chosen : (c,) int
        The patches.
    points : tuple of (c, m, 3) float32, (c, m) bool and (c, cells) int
        Of `shadow_points`.
    suns : SunBlock
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
    light = found.visible_share, found.visible_elements, found.by_point
    found.representative_points[chosen] = points[1]
    add_points(free, tuple(points), (aoi_projection, weights.astype(np.float32)), chosen, light)
    return int(wanted.sum()) * position.shape[1]


@njit(nogil=True, cache=True)
def add_points(free, points, suns, chosen, light):
    """Add up the light at the points of each patch.

    Parameters
    ----------
    free : (c, s, m) bool
    points : tuple of (c, m) bool and (c, cells) int
        Which points are open, and which of them represent the cells.
    suns : tuple of (c, s) float32 and (s,) float32
        Cosine of incidence of each sun, 0 where it is behind the patch, and its weight.
    chosen : (c,) int
        Rows of `light` that belong to the patches.
    light : tuple of (p, s) float32, (p, s) uint16 and (p, m) float32
        Written: the first three fields of `SunLight`.
    """
    (open_points, representative_points), (aoi_projection, weights), (visible_share, visible_elements, by_point) = (
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
                visible_share[row, sun], visible_elements[row, sun] = 1, (1 << cells) - 1
                continue
            for point in range(point_count):
                if free[patch, sun, point] & open_points[patch, point]:
                    by_point[row, point] += weighted
            bits = 0
            for cell in range(cells):
                point = representative_points[patch, cell]
                bits |= int(free[patch, sun, point] & open_points[patch, point]) << cell
            visible_share[row, sun], visible_elements[row, sun] = np.float32(visible) / np.float32(point_count), bits
