"""Which share of each patch sees each sun."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from ..errors import InputError
from .check_arrays import UNIT, check_array
from .find_covered import enclosed_cells
from .hemisphere_rays import HALF, fraction
from .random_numbers import mix, uniform
from .ray_scene import map_in_order
from .sample_points import DIGITS, cell_corners, cell_of_point, cells_inside, grid_of, points_of_grid

POINTS_PER_TASK = 1 << 14
MOST_CELLS = 16  # bits that say which cells of a patch see a sun
EDGE_ON = np.float32(1e-6)  # cosine of incidence up to which a patch is seen from its edge and receives nothing
NOTHING = np.float32(0)


@dataclass
class SunLight:
    """What p patches receive of s suns at first hit."""

    visible_share: np.ndarray  # (p, s) float32; 0 where the sun stands behind the patch
    seen: np.ndarray  # (p, s) uint16, bit c is set where the sun is visible from the point of cell c
    by_point: np.ndarray  # (p, m) float32, sum over the suns of weight times what each point receives
    speakers: np.ndarray  # (p, cells) uint, which point speaks for each cell
    ray_count: int


def trace_suns(ray_scene, patches, traced, closed, covered, *, point_count, suns, behind, threads, progress):
    """Look from points of every traced patch to each sun that stands in front of it.

    Parameters
    ----------
    ray_scene : RayScene
    patches : Patches
    traced : (p,) bool
        Patches that need shadow rays.
    closed : (p,) bool
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
    for name, values in (("traced", traced), ("closed", closed)):
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
        speakers=np.zeros((count, cells_of_light(point_count)), np.min_scalar_type(point_count - 1)),
        ray_count=0,
    )
    free = np.flatnonzero(closed)
    aoi_projection = projection_in_front(patches.normal[free], directions)
    found.visible_share[free] = aoi_projection > 0
    found.seen[free] = np.where(aoi_projection > 0, (1 << cells_of_light(point_count)) - 1, 0)
    found.by_point[free] = (aoi_projection @ suns[1].astype(np.float32))[:, None]

    rows = np.flatnonzero(traced)
    step = max(1, POINTS_PER_TASK // point_count)
    tasks = [rows[start : start + step] for start in range(0, len(rows), step)]

    def look(chosen):
        points = shadow_points(patches, chosen, covered[chosen], point_count)
        return look_at_suns(ray_scene, patches, chosen, points, (directions, suns[1]), behind=behind, found=found)

    done = 0
    for chosen, ray_count in zip(tasks, map_in_order(look, tasks, threads), strict=True):
        found.ray_count += ray_count
        done += len(chosen)
        progress(done / len(rows), found.ray_count)
    return found


def points_above(count):
    """The smallest power of two not below `count`: so many points lie evenly."""
    return 1 << (count - 1).bit_length()


def cells_of_light(point_count):
    """Into how many cells the light of a patch with so many points is resolved: 1, 4 or 16, no more than points."""
    return next(cells for cells in (MOST_CELLS, 4, 1) if cells <= point_count)


@njit(nogil=True, cache=True)
def projection_in_front(normal, directions):
    """Cosine of the angle of incidence, 0 where the sun stands behind or exactly at the edge.

    Parameters
    ----------
    normal : (c, 3) float32
    directions : (s, 3) float32

    Returns
    -------
    (c, s) float32
    """
    aoi_projection = np.empty((len(normal), len(directions)), np.float32)
    east, north, up = directions[:, 0].copy(), directions[:, 1].copy(), directions[:, 2].copy()
    for patch in range(len(normal)):
        x, y, z = normal[patch]
        for sun in range(len(east)):
            cosine = x * east[sun] + y * north[sun] + z * up[sun]
            aoi_projection[patch, sun] = cosine if cosine >= EDGE_ON else NOTHING
    return aoi_projection


def look_at_suns(ray_scene, patches, chosen, points, suns, *, behind, found):
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
    free = ray_scene.look_at_suns(position, wanted, directions)
    light = found.visible_share, found.seen, found.by_point
    found.speakers[chosen] = points[1]
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
    (open_points, speakers), (aoi_projection, weights), (visible_share, seen, by_point) = points, suns, light
    point_count, cells = open_points.shape[1], speakers.shape[1]
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
                point = speakers[patch, cell]
                bits |= int(free[patch, sun, point] & open_points[patch, point]) << cell
            visible_share[row, sun], seen[row, sun] = np.float32(visible) / np.float32(point_count), bits


def shadow_points(patches, chosen, covered, point_count):
    """Points that lie evenly on some patches.

    They are the first of Sobol's sequence, whose digits are turned over at random for each patch. So they lie evenly in
    all bands along its edges too, where shadows like to run.

    Parameters
    ----------
    covered : (c, cells) bool
        Cells of these patches that lie inside or under something.

    Returns
    -------
    position : (c, m, 3) float32 [m]
    open_points : (c, m) bool
        False where the point lies deep inside something.
    speakers : (c, cells_of_light(m)) uint
        The point that speaks for each cell.
    """
    turned = (uniform(mix(patches.key[chosen] ^ np.uint64(0x5EED)), 2) * (1 << DIGITS)).astype(np.uint32)
    start = patches.corner[chosen] + patches.offset[chosen, None] * patches.normal[chosen]
    places = np.empty((2, len(chosen), point_count), np.float32)
    position = np.empty((len(chosen), point_count, 3), np.float32)
    place_points(turned, (points_of_grid(point_count), grid_of(point_count)), places)
    lay_points(places, start, patches.edges[chosen], position)
    cell = cell_of_point(*places, round(np.sqrt(covered.shape[1])))
    dark, mute = (
        np.take_along_axis(cells, cell.astype(np.intp), axis=1) for cells in (enclosed_cells(covered), covered)
    )
    speakers = np.empty((len(chosen), cells_of_light(point_count)), np.min_scalar_type(point_count - 1))
    middles = cell_corners(round(np.sqrt(speakers.shape[1]))).mean(axis=1)
    lost = cover_whole_cells(covered, len(middles))
    choose_speakers(places, (mute, lost), middles, speakers)
    return position, ~dark, speakers


def cover_whole_cells(covered, cells):
    """Which larger cells are covered all over: (c, cells) bool; none where `covered` knows no smaller ones."""
    finer = covered.shape[1]
    if finer < cells:
        return np.zeros((len(covered), cells), bool)
    inside = cells_inside(round(np.sqrt(finer)), round(np.sqrt(cells)))
    members = np.argsort(inside, kind="stable").reshape(cells, -1)
    return covered[:, members].all(axis=2)


@njit(nogil=True, cache=True)
def place_points(turned, net, places):
    """Barycentric weights of points, one for each rectangle of the square, in their order.

    Parameters
    ----------
    turned : (c, 2) uint32
        Digits to turn over.
    net : tuple of (m, 2) uint32 and tuple of int
        Of `points_of_grid` and `grid_of`.
    places : (2, c, m) float32
        Written.
    """
    digits, (rows, columns) = net
    for patch in range(len(turned)):
        turn = turned[patch]
        # Turned over, the leading digits take each point to the rectangle whose point is sought.
        column_turn, row_turn = (turn[0] * columns) >> DIGITS, (turn[1] * rows) >> DIGITS
        for point in range(len(digits)):
            row, column = point // columns ^ row_turn, point % columns ^ column_turn
            found = digits[row * columns + column]
            u, v = fraction(found[0] ^ turn[0]), fraction(found[1] ^ turn[1])
            places[0, patch, point] = u * HALF if v > u else u - v * HALF
            places[1, patch, point] = v - u * HALF if v > u else v * HALF


@njit(nogil=True, cache=True)
def lay_points(places, start, edges, position):
    """Where points given by barycentric weights, (2, c, m), lie: written into (c, m, 3)."""
    for patch in range(len(start)):
        for point in range(places.shape[2]):
            b1, b2 = places[0, patch, point], places[1, patch, point]
            for axis in range(3):
                position[patch, point, axis] = (
                    start[patch, axis] + b1 * edges[patch, 0, axis] + b2 * edges[patch, 1, axis]
                )


@njit(nogil=True, cache=True)
def choose_speakers(places, silent, middles, speakers):
    """The point nearest to the middle of each cell of light, but no point that lies inside or under something.

    Unless the cell lies there all over: who sees it looks around in there, and is to find it dark.

    Parameters
    ----------
    places : (2, c, m) float32
    silent : tuple of (c, m) and (c, cells) bool
        Points, and whole cells, that lie inside or under something.
    middles : (cells, 2) float32
        Barycentric weights.
    speakers : (c, cells) uint
        Written.
    """
    mute, lost = silent
    for patch in range(len(mute)):
        for cell in range(len(middles)):
            nearest, chosen = np.float32(np.inf), 0
            for point in range(mute.shape[1]):
                x, y = places[0, patch, point] - middles[cell, 0], places[1, patch, point] - middles[cell, 1]
                away = x * x + x * y + y * y  # squared, on a triangle of equal sides
                if away < nearest and (lost[patch, cell] or not mute[patch, point]):
                    nearest, chosen = away, point
            speakers[patch, cell] = chosen
