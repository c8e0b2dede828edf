"""Which share of each patch sees each sun."""

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .check_arrays import UNIT, check_array
from .random_numbers import mix, uniform
from .ray_scene import map_in_order
from .sample_points import cell_of_point, neighbouring_order, stratified_points

POINTS_PER_TASK = 1 << 15
EDGE_ON = 1e-6  # cosine of incidence up to which a patch is seen from its edge and receives nothing


@dataclass
class SunLight:
    """What p patches receive of s suns at first hit."""

    visible_share: np.ndarray  # (p, s) float32; 0 where the sun stands behind the patch
    first: np.ndarray  # (p, s) float32, visible share times the cosine of the angle of incidence
    by_point: np.ndarray  # (p, m) float32, sum over the suns of weight times what each point receives
    ray_count: int


def trace_suns(ray_scene, patches, traced, closed, enclosed, *, point_count, suns, behind, threads, progress):
    """Look from points of every traced patch to each sun that stands in front of it.

    Parameters
    ----------
    ray_scene : RayScene
    patches : Patches
    traced : (p,) bool
        Patches that need shadow rays.
    closed : (p,) bool
        Patches with nothing in front of them: they see every sun in front of them, without a ray.
    enclosed : (p, c) bool
        Cells of each patch that lie deep inside something; points in them see no sun.
    point_count : int
        Points per patch, a square number.
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
    for name, values in (("traced", traced), ("closed", closed)):
        check_array(name, values, (count,), kind="b")
    cells = check_array("enclosed", enclosed, (count, "c"), kind="b").shape[1]
    for name, number in (("point_count", point_count), ("cells of enclosed", cells)):
        if number < 1 or round(np.sqrt(number)) ** 2 != number:
            raise InputError(name, f"{number} is not a square number", "give 1, 4, 9, 16 …")
    found = SunLight(
        visible_share=np.zeros((count, len(directions)), np.float32),
        first=np.zeros((count, len(directions)), np.float32),
        by_point=np.zeros((count, point_count), np.float32),
        ray_count=0,
    )
    free = np.flatnonzero(closed)
    aoi_projection = projection_in_front(patches.normal[free], directions)
    found.visible_share[free] = aoi_projection > 0
    found.first[free] = aoi_projection

    rows = np.flatnonzero(traced)
    step = max(1, POINTS_PER_TASK // point_count)
    tasks = [rows[start : start + step] for start in range(0, len(rows), step)]

    def look(chosen):
        points = shadow_points(patches, chosen, enclosed, point_count)
        return look_at_suns(ray_scene, patches.normal[chosen], points, suns, behind)

    done = 0
    for chosen, seen in zip(tasks, map_in_order(look, tasks, threads), strict=True):
        found.visible_share[chosen], found.first[chosen], found.by_point[chosen], rays = seen
        found.ray_count += rays
        done += len(chosen)
        progress(done / len(rows), found.ray_count)
    return found


def projection_in_front(normal, directions):
    """Cosine of the angle of incidence, 0 where the sun stands behind or exactly at the edge: (c, s) float32."""
    aoi_projection = normal @ directions.T
    aoi_projection[aoi_projection < EDGE_ON] = 0
    return aoi_projection


def look_at_suns(ray_scene, normal, points, suns, behind):
    """Shadow rays from the points of some patches to all suns.

    Parameters
    ----------
    normal : (c, 3) float32
    points : tuple of (c, m, 3) float32 and (c, m) bool
        Of `shadow_points`.
    suns : tuple of (s, 3) float32 and (s,) float32
        Directions and weights.
    behind : bool

    Returns
    -------
    visible_share, first : (c, s) float32
    by_point : (c, m) float32
    ray_count : int
    """
    (position, open_points), (directions, weights) = points, suns
    count, point_count = open_points.shape
    aoi_projection = projection_in_front(normal, directions)
    visible_share = np.zeros((count, len(directions)), np.float32)
    by_point = np.zeros((count, point_count), np.float32)
    ray_count = 0
    for sun, direction in enumerate(directions):
        chosen = np.arange(count) if behind else np.flatnonzero(aoi_projection[:, sun])
        blocked = ray_scene.trace_blocked(position[chosen].reshape(-1, 3), direction)
        visible = ~blocked.reshape(-1, point_count) & open_points[chosen]
        if behind:
            visible &= aoi_projection[:, sun, None] > 0
        visible_share[chosen, sun] = visible.mean(axis=1, dtype=np.float32)
        by_point[chosen] += (weights[sun] * aoi_projection[chosen, sun])[:, None] * visible
        ray_count += blocked.size
    return visible_share, aoi_projection * visible_share, by_point, ray_count


def shadow_points(patches, chosen, enclosed, point_count):
    """Stratified points on some patches: one in each of `point_count` congruent cells.

    Returns
    -------
    position : (c, m, 3) float32 [m]
    open_points : (c, m) bool
        False where the point lies deep inside something.
    """
    numbers = uniform(mix(patches.key[chosen] ^ np.uint64(0x5EED)), 2 * point_count)
    b1, b2 = stratified_points(numbers.reshape(len(chosen), point_count, 2), round(np.sqrt(point_count)))
    start = patches.corner[chosen] + patches.offset[chosen, None] * patches.normal[chosen]
    edges = patches.edges[chosen]
    position = start[:, None] + b1[..., None] * edges[:, None, 0] + b2[..., None] * edges[:, None, 1]
    cells = cell_of_point(b1, b2, round(np.sqrt(enclosed.shape[1])))
    return position, ~np.take_along_axis(enclosed[chosen], cells.astype(np.intp), axis=1)


def variance_of_cell_pairs(by_point):
    """Variance of the mean of stratified points, estimated from neighbouring cells taken together.

    What differs between the two cells of a pair counts as noise, so the estimate is conservative. With an odd number
    of cells the last three make one group.

    Parameters
    ----------
    by_point : (p, m) float32

    Returns
    -------
    (p,) float64
        NaN where there is one cell only.

    References
    ----------
    W. G. Cochran (1977), Sampling techniques, 3rd ed., 5A.12 (collapsed strata).
    """
    count = by_point.shape[1]
    if count < 2:
        return np.full(len(by_point), np.nan)
    values = by_point[:, neighbouring_order(round(np.sqrt(count)))]
    pairs = count - 3 if count % 2 else count
    first, second = values[:, 0:pairs:2], values[:, 1:pairs:2]
    variance = ((first - second).astype(float) ** 2).sum(axis=1)
    if count % 2:
        # Three cells in one group: h/(h - 1) · Σ (x - mean)².
        last = values[:, pairs:].astype(float)
        variance += 1.5 * ((last - last.mean(axis=1, keepdims=True)) ** 2).sum(axis=1)
    return variance / count**2
