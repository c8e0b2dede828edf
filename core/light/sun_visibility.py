"""Visible share of each patch for each sun, by shadow rays: one bit for each shadow point
and sun.
"""

from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from ..patches.patches import Patches
from ..rays.ray_scene import RayScene
from ..settings.errors import UNIT, InputError, check_array
from ..settings.threads import map_in_order
from .shadow_points import WORD, KnownPoints, count_elements, find_points, shadow_points

NOTHING = np.float32(0)
POINTS_PER_TASK = 1 << 14


@dataclass
class SunWatch:
    """From which of their points p patches look at the suns."""

    ray_scene: RayScene
    patches: Patches
    traced: np.ndarray  # (p,) bool, patches that need shadow rays
    # (p,) bool, patches with nothing in front: every sun in front is visible, without a ray
    unobstructed: np.ndarray
    # (p, c) bool, cells inside or under something: no sun is visible from points deep inside them
    covered: np.ndarray
    point_count: int  # points per patch, a power of two
    # trace rays to suns behind a patch as well (never visible; this only costs time)
    behind: bool = False
    threads: int = 1
    points: KnownPoints | None = None  # the same for all suns: found with the first
    # of each patch, at most one for a point; None: as many as there can be
    elements: int | None = None
    left_out: np.ndarray | None = None  # (p,) uint64, as of `RayCity`


@dataclass
class Shadows:
    """Which points of p patches see each of s suns."""

    # (p, words, s) uint16, bit k of word w: point WORD · w + k does; 0 where the sun is behind
    bits: np.ndarray
    points: KnownPoints
    weight: np.ndarray  # (p,) float32, part of the visible share that each bit stands for
    ray_count: int
    light: np.ndarray | None = None  # of `light_of_points`, once it is known

    @property
    def visible_share(self):
        """Visible share of each sun, from the points that count: (p, s) float32."""
        share = np.empty((len(self.bits), self.bits.shape[2]), np.float32)
        count_visible(self.bits, self.points.counted, self.weight, share)
        return share

    def light_of_points(self, normal, suns, threads=1):
        """Irradiance of each point without reflections, weighted sum over the suns: (p, m) float32.

        `normal` has the patches' normals, (p, 3) float32; `suns` is the SunBlock.
        """
        if self.light is not None:
            return self.light
        points = self.points.open_points.shape[1]
        self.light = light = np.zeros((len(normal), points), np.float32)

        def add(rows):
            aoi_projection = projection_in_front(normal[rows], suns[0])
            _add_points(self.bits[rows], aoi_projection, suns[1].astype(np.float32), light[rows])
            light[rows] *= self.weight[rows, None] * np.float32(points)

        work_in_slices(add, len(normal), threads)
        return light

    def among(self, traced):
        """Place the shadows among more suns, (n,) bool, none visible but the traced
        ones: Shadows.
        """
        wide = np.zeros((*self.bits.shape[:2], len(traced)), np.uint16)
        wide[:, :, traced] = self.bits
        return replace(self, bits=wide)


@njit(nogil=True, cache=True)
def projection_in_front(normal, directions):
    """Cosine of the angle of incidence, 0 if the sun is behind the patch or edge-on.

    Parameters
    ----------
    normal : (c, 3) float32
    directions : (s, 3) float32

    Returns
    -------
    (c, s) float32
    """
    count = len(directions)
    aoi_projection, along = (
        np.empty((len(normal), count), np.float32),
        np.empty((3, count), np.float32),
    )
    for sun in range(count):
        for axis in range(3):
            along[axis, sun] = directions[sun, axis]
    for patch in range(len(normal)):
        x, y, z = normal[patch, 0], normal[patch, 1], normal[patch, 2]
        for sun in range(count):
            cosine = x * along[0, sun] + y * along[1, sun] + z * along[2, sun]
            # Edge-on to the sun, below a cosine of a millionth, a patch receives nothing.
            aoi_projection[patch, sun] = cosine if cosine >= np.float32(1e-6) else NOTHING
    return aoi_projection


def sun_visibility(watch, suns, report=lambda share, rays: None):
    """Trace shadow rays from points of patches to each sun in front of them.

    Parameters
    ----------
    watch : SunWatch
    suns : SunBlock
    report : callable
        Called with the share of patches done and the number of rays traced.

    Returns
    -------
    list of Shadows
        In each state of trees, by the same rays.

    Raises
    ------
    InputError
        If an array or a number is invalid.
    """
    _check_watch(watch, suns)
    patches, directions, m = watch.patches, suns[0], watch.point_count
    # Points of each patch that lie in the open, unless they are known already.
    if watch.points is None:
        wanted = watch.traced | watch.unobstructed
        elements = watch.elements or count_elements(m)
        watch.points = find_points(
            patches, watch.covered, (m, elements), wanted, watch.threads, left_out=watch.left_out
        )
    # A bit for each point and sun: set without rays where nothing is in the way, else by a shadow
    # ray.
    bits = np.zeros(
        (watch.ray_scene.states, len(patches), -(-m // WORD), len(directions)), np.uint16
    )
    see_all(watch, np.flatnonzero(watch.unobstructed), directions, bits)
    ray_count, every = 0, np.ones((1, len(directions)), bool)
    step = max(1, min(POINTS_PER_TASK // m, -(-int(watch.traced.sum()) // watch.threads)))
    rows = np.flatnonzero(watch.traced)
    tasks = [rows[start : start + step] for start in range(0, len(rows), step)]
    traced_parts = map_in_order(
        lambda chosen: trace_points(watch, chosen, suns, bits, every), tasks, watch.threads
    )
    done = 0
    for chosen, sent in zip(tasks, traced_parts, strict=True):
        ray_count += sent
        done += len(chosen)
        report(done / len(rows), ray_count)
    weight = weigh_points(watch)
    return [Shadows(own, watch.points, weight, ray_count) for own in bits]


def weigh_points(watch):
    """Part of the visible share that each point stands for: (p,) float32."""
    weight = np.full(len(watch.patches), 1 / watch.point_count, np.float32)
    # Where nothing stands in front every sun is visible, from the open part of the patch.
    free = np.flatnonzero(watch.unobstructed)
    weight[free] *= 1 - watch.covered[free].mean(axis=1, dtype=np.float32)
    return weight


def see_all(watch, rows, directions, bits):
    """Set the bits, (states, p, words, s), of some patches for all suns in front of them."""
    aoi_projection = projection_in_front(watch.patches.normal[rows], directions)
    bits[:, rows] = np.where(aoi_projection > 0, (1 << min(watch.point_count, WORD)) - 1, 0)[
        :, None
    ]


def _check_watch(watch, suns):
    """Refuse arrays and numbers of `sun_visibility` that are invalid.

    Raises
    ------
    InputError
    """
    count = len(watch.patches)
    directions = check_array(
        "directions of the suns", suns[0], ("s", 3), least=-1 - UNIT, most=1 + UNIT
    )
    check_array("weights of the suns", suns[1], (len(directions),), least=0, most=1 + UNIT)
    for name in ("traced", "unobstructed"):
        check_array(name, getattr(watch, name), (count,), kind="b")
    cells, points = (
        check_array("covered", watch.covered, (count, "c"), kind="b").shape[1],
        watch.point_count,
    )
    if points < 1 or points.bit_count() > 1:
        raise InputError("point_count", f"{points} is not a power of two", "give 1, 2, 4, 8, 16 …")
    if cells < 1 or round(np.sqrt(cells)) ** 2 != cells:
        raise InputError(
            "cells of covered", f"{cells} is not a square number", "give 1, 4, 9, 16 …"
        )


def trace_points(watch, chosen, suns, bits, asked):
    """Shadow rays from the points of some patches to all suns.

    Parameters
    ----------
    watch : SunWatch
    chosen : (c,) int
        The patches.
    suns : SunBlock
    bits : (states, p, words, s) uint16
        Written: the rows of these patches.
    asked : (c, s) or (1, s) bool
        Which suns each of them looks at.

    Returns
    -------
    int
        Number of rays.
    """
    directions, _ = suns
    position = shadow_points(watch.patches, chosen, watch.point_count)
    in_front = projection_in_front(watch.patches.normal[chosen], directions) > 0
    wanted = (in_front | watch.behind) & asked
    free = watch.ray_scene.trace_shadow_states(position, wanted, directions)
    for state, own in zip(free, bits, strict=True):
        _set_bits(state, watch.points.open_points[chosen], wanted & in_front, chosen, own)
    return int(np.count_nonzero(wanted)) * watch.point_count


@njit(nogil=True, cache=True)
def _set_bits(free, open_points, wanted, chosen, bits):
    """Write which points of patches see which suns.

    Parameters
    ----------
    free : (c, s, m) bool
    open_points : (c, m) bool
    wanted : (c, s) bool
        Which suns each patch looks at.
    chosen : (c,) int
        Rows of `bits` that belong to the patches.
    bits : (p, words, s) uint16
        Written.
    """
    bit_words = np.empty(bits.shape[1], np.int64)
    for patch in range(len(free)):
        for sun in range(free.shape[1]):
            if not wanted[patch, sun]:
                continue
            for word in range(len(bit_words)):
                bit_words[word] = 0
            for point in range(open_points.shape[1]):
                seen = free[patch, sun, point] & open_points[patch, point]
                bit_words[point >> 4] |= np.int64(seen) << (point & 15)
            for word in range(len(bit_words)):
                bits[chosen[patch], word, sun] = bit_words[word]


@njit(nogil=True, cache=True, fastmath={"reassoc"})
def _add_points(bits, aoi_projection, weights, light):
    """Add (s,) weights times (c, s) cosines of suns to the light, (c, m) float32, of points whose
    bits are set.
    """
    points = light.shape[1]
    for patch in range(len(bits)):
        for sun in range(bits.shape[2]):
            weighted = weights[sun] * aoi_projection[patch, sun]
            for word in range(bits.shape[1]):
                seen = np.int64(bits[patch, word, sun])
                if seen and weighted > 0:
                    for bit in range(min(WORD, points - WORD * word)):
                        light[patch, WORD * word + bit] += (
                            weighted if (seen >> bit) & 1 else NOTHING
                        )


@njit(nogil=True, cache=True)
def count_visible(bits, counted, weight, share):
    """Number of bits that are set, of (p, words, s) uint16, and count, (p, words) uint16, times
    weights, (p,), written into (p, s) float32.
    """
    for patch in range(len(bits)):
        for sun in range(bits.shape[2]):
            count = np.uint32(0)
            for word in range(bits.shape[1]):
                pairs = np.uint32(bits[patch, word, sun] & counted[patch, word])
                pairs = pairs - ((pairs >> np.uint32(1)) & np.uint32(0x5555))
                fours = (pairs & np.uint32(0x3333)) + ((pairs >> np.uint32(2)) & np.uint32(0x3333))
                eights = (fours + (fours >> np.uint32(4))) & np.uint32(0x0F0F)
                count += (eights + (eights >> np.uint32(8))) & np.uint32(0x1F)
            share[patch, sun] = weight[patch] * np.float32(count)


def work_in_slices(work, count, threads, *, rows_per_slice=1 << 11):
    """Results of `work(rows)` for consecutive slices of `count` rows, in order, for any number of
    threads.
    """
    # `rows_per_slice`: with some hundred columns, a slice fits into the processor's cache.
    starts = range(0, count, rows_per_slice)
    return list(
        map_in_order(
            work, (slice(start, min(start + rows_per_slice, count)) for start in starts), threads
        )
    )
