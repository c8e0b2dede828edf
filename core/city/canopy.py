"""How much light passes through crowns, and which rays end in leaves.

   sun
     \\   entry            A crown is a volume of leaves of equal density. Of light on a way of length L inside, the
      (~~\\~~)             share exp(-k · LAD · L) passes (Beer-Lambert law): k is the extinction coefficient, LAD the
       (~~\\~) exit        leaf area density. Densities of crowns that overlap add up. Leaves reflect nothing; trunks
          | \\             are opaque.
          |  \\ patch

Light is not weighted but rays are stopped: a ray passes with the probability of the transmittance. Means are the same,
and all that counts rays (sky, form factors, visible suns, photons) stays as it is. Random numbers of the rays of one
patch are evenly spread, so that little noise is added.

Both states of the leaves send the same rays from a patch, with the same random numbers, and bare crowns stop none that
crowns in leaf let pass. So one sum over the crossings of a ray tells for both: which rays end without leaves is kept
until the bare state is traced. What is not kept, such as rays from ground that is seen only in one state, is traced
again.

References
----------
Monsi and Saeki (1953), doi:10.1093/aob/mci052 (English, 2005). Nilson (1971), doi:10.1016/0002-1571(71)90092-6.
"""

from dataclasses import dataclass, field

import numpy as np

from ..rays.random_numbers import GOLDEN, mix
from ..rays.ray_scene import RayScene
from .crossing_loops import build_hierarchy, sum_crossings

LARGEST = 1 << 28  # [bytes] that are kept at most, a bit for each ray
OPAQUE = 1e6  # optical depth of a trunk
MARGIN = 1e-9  # of optical depth, more than rounding
GOLDEN_RATIO = 0.6180339887498949


class CrownShapes:
    """Crowns and trunks for finding rays that meet them and their crossings, the same with leaves and without.

    Parameters
    ----------
    crowns : Crowns
    """

    def __init__(self, crowns):
        self.ray_scene = RayScene(crowns.vertices, crowns.triangles)
        corners = crowns.vertices[crowns.triangles]
        *self.hierarchy, self.order = build_hierarchy(corners, 2 * crowns.tree + crowns.trunk)
        filled = np.where(self.order[..., None, None] >= 0, corners[self.order], 0.0)
        self.corners = np.ascontiguousarray(np.moveaxis(filled, 1, -1))  # (l, 3, 3, LEAF)


class Canopy:
    """Crowns and trunks for attenuating rays.

    Parameters
    ----------
    crowns : Crowns
    per_metre : (k,) float64
        Optical depth per metre in each crown, k · LAD [m⁻¹].
    per_crossing : (k,) float64
        Optical depth of crossing each crown once.
    shapes : CrownShapes, optional
        Of these crowns, where they are known already.
    without_leaves : (k,) float64, optional
        Share of these optical depths that stays without leaves, at most 1: `kept` then takes what stops rays there.
    kept : KeptRays, optional
        If `without_leaves` is not given: what is known from the state in leaf.
    """

    def __init__(self, crowns, per_metre, per_crossing, shapes=None, *, without_leaves=None, kept=None):
        self.vertices = crowns.vertices
        self._shapes = shapes or CrownShapes(crowns)
        self.ray_scene = self._shapes.ray_scene
        tree, trunk = crowns.tree[self._shapes.order], crowns.trunk[self._shapes.order]
        self._both, self._kept = without_leaves is not None, kept
        # A crossing of a crown is an entry and an exit: half each.
        costs = np.where(trunk, 0.0, per_metre[tree]), np.where(trunk, OPAQUE, per_crossing[tree] / 2)
        share = np.ones(len(per_metre)) if without_leaves is None else without_leaves
        self._costs = *costs, np.where(trunk[:, 0], 1.0, share[tree[:, 0]])  # the triangles of a leaf are of one body

    def transmittance(self, ray_origins, ray_directions, reach=None, least=None):
        """Share of light that passes along rays.

        Parameters
        ----------
        ray_origins, ray_directions : (n, 3) float
            Directions of unit length.
        reach : (n,) float, optional
            Length of each ray [m]; infinite if not given.
        least : (n,) float, optional
            Transmittance from which on it is wanted: of rays with less, any value below it is returned.

        Returns
        -------
        (n,) float64
        """
        return self._pass(ray_origins, ray_directions, reach, least)[0]

    def _pass(self, ray_origins, ray_directions, reach=None, least=None):
        """The same, and without leaves: (2, n) float64."""
        passed = np.ones((2, len(ray_origins)))
        met = np.flatnonzero(self.ray_scene.trace_closest(ray_origins, ray_directions) >= 0)
        ends = np.full(len(met), 1e30) if reach is None else np.asarray(reach, float)[met]
        rays = (np.ascontiguousarray(part[met], float) for part in (ray_origins, ray_directions))
        enough = np.full(len(met), np.inf) if least is None else MARGIN - np.log(least[met])
        depth = np.empty((2, len(met)))
        sum_crossings(tuple(self._shapes.hierarchy), self._shapes.corners, self._costs, (*rays, ends, enough), depth)
        passed[:, met] = np.exp(-np.maximum(depth, 0))
        return passed

    def stop_rays(self, ray_origins, ray_directions, reach=None):
        """Which rays end in crowns or at trunks.

        Parameters
        ----------
        ray_origins, ray_directions : (c, r, 3) float32
            Rays in c rows; within a row the random numbers are evenly spread.
        reach : (c, r) float, optional
            Length of each ray [m].

        Returns
        -------
        (c, r) bool
        """
        words = hash_rays(ray_origins[:, 0], ray_directions[:, 0])
        if self._kept is None or ray_origins.shape[1] == 1:  # such as photons, which differ between the states
            return self._stop_rays(ray_origins, ray_directions, reach, words)[0]
        names, count = words ^ mix(hash_rays(ray_origins[:, -1], ray_directions[:, -1])), ray_origins.shape[1]

        def stop_some(rows):
            ends = None if reach is None else reach[rows]
            return self._stop_rays(ray_origins[rows], ray_directions[rows], ends, words[rows])

        return self._answer(count, names, (count,), stop_some)

    def _answer(self, common, words, shape, trace):
        """Answers to rows of rays by `trace(rows)`, kept in leaf and recalled without leaves: (c, *shape) bool."""
        if self._both:
            answer, without_leaves = trace(slice(None))
            keep_rays(self._kept, common, words, without_leaves)
            return answer
        answer, known = recall_rays(self._kept, common, words, shape)
        rest = np.flatnonzero(~known)
        if len(rest):
            answer[rest] = trace(rest)[0]
        return answer

    def _stop_rays(self, ray_origins, ray_directions, reach, words):
        """The same, and without leaves: (2, c, r) bool."""
        shape = ray_origins.shape[:2]
        numbers = spread_numbers(words, shape[1]).reshape(-1)
        rays = ray_origins.reshape(-1, 3), ray_directions.reshape(-1, 3)
        reach = None if reach is None else reach.reshape(-1)
        return (self._pass(*rays, reach, numbers) < numbers).reshape(2, *shape)

    def stop_shadow_rays(self, position, free, directions):
        """Stop shadow rays in crowns.

        Parameters
        ----------
        position : (c, m, 3) float32
            Points of each patch.
        free : (c, s, m) bool
            Which points see which suns; changed in place.
        directions : (s, 3) float32

        Returns
        -------
        (c, s, m) bool
            The same without leaves.
        """
        wanted = free.any(axis=2)
        shaded = free & ~self.ray_scene.trace_shadow_rays(position, wanted, directions)
        row, sun = np.nonzero(shaded.any(axis=2))
        bare = free.copy() if self._both else free
        if not len(row):
            return bare
        passed = np.ones((2, len(row), position.shape[1]))
        pair, point = np.nonzero(shaded[row, sun])
        numbers = spread_numbers(hash_rays(position[row, 0], directions[sun]), position.shape[1])
        rays = position[row[pair], point], directions[sun[pair]]
        passed[:, pair, point] = self._pass(*rays, least=numbers[pair, point])
        free[row, sun] &= passed[0] >= numbers
        if self._both:
            bare[row, sun] &= passed[1] >= numbers
        return bare

    def trace_shadow_rays(self, trace, position, wanted, directions):
        """Shadow rays that crowns may stop, as of `RayScene`; `trace(position, wanted, directions)` has no crowns."""

        def trace_rows(rows):
            free = trace(position[rows], wanted[rows], directions)
            return free, self.stop_shadow_rays(position[rows], free, directions)

        if self._kept is None or position.shape[1] == 0:
            return trace_rows(slice(None))[0]
        words = hash_rays(position[:, 0], position[:, -1])
        for bits in np.packbits(wanted, axis=1).T:
            words = mix(words ^ bits)
        shape = len(directions), position.shape[1]
        return self._answer((*shape, directions.tobytes()), words, shape, trace_rows)


def hash_rays(ray_origins, ray_directions):
    """Random word of each ray, from its own numbers, so that it does not depend on the order of rays: (n,) uint64."""
    words = np.zeros(len(ray_origins), np.uint64)
    for values in (ray_origins, ray_directions):
        for axis in range(3):
            bits = np.ascontiguousarray(values[:, axis], np.float32).view(np.uint32).astype(np.uint64)
            words = mix((words ^ bits) + GOLDEN)
    return words


def spread_numbers(words, count):
    """Evenly spread numbers in (0, 1], shifted by chance in each row: (n, count) float64."""
    start = (words >> np.uint64(11)).astype(float)[:, None] * 2.0**-53
    return 1 - (start + np.arange(count) * GOLDEN_RATIO) % 1.0


class LeafyScene(RayScene):
    """Triangles for ray queries, with shadow rays that crowns may stop.

    Parameters
    ----------
    vertices, triangles
        As of `RayScene`.
    canopy : Canopy, optional
        None: no trees; nothing differs from `RayScene`.
    """

    def __init__(self, vertices, triangles, canopy=None):
        super().__init__(vertices, triangles)
        self.canopy = canopy

    def trace_shadow_rays(self, position, wanted, directions):
        """As of `RayScene`."""
        trace = super().trace_shadow_rays
        if self.canopy is None:
            return trace(position, wanted, directions)
        return self.canopy.trace_shadow_rays(trace, position, wanted, directions)


@dataclass
class KeptRays:
    """Answers to rows of rays."""

    parts: dict = field(default_factory=dict)  # what the rows have in common -> list of (c,) uint64 and (c, b) uint8
    size: int = 0  # [bytes]


def forget_rays(kept):
    """Empty what was kept."""
    kept.parts.clear()
    kept.size = 0


def keep_rays(kept, common, words, answer):
    """Keep the answers to rows of rays, while there is room.

    Parameters
    ----------
    kept : KeptRays
    common : hashable
        What the rows have in common.
    words : (c,) uint64
        Of each row, by its rays.
    answer : (c, ...) bool
    """
    packed = np.packbits(answer.reshape(len(words), -1), axis=1)
    if len(words) and kept.size + packed.nbytes + words.nbytes <= LARGEST:
        kept.parts.setdefault(common, []).append((words, packed))
        kept.size += packed.nbytes + words.nbytes


def recall_rays(kept, common, words, shape):
    """What is known of rows of rays.

    Parameters
    ----------
    kept : KeptRays
    common, words
        As of `keep_rays`.
    shape : tuple of int
        Of the answer to one row.

    Returns
    -------
    answer : (c, *shape) bool
    known : (c,) bool
        Rows that were kept.
    """
    parts = kept.parts.get(common)
    if not parts or not len(words):
        return np.zeros((len(words), *shape), bool), np.zeros(len(words), bool)
    if len(parts) > 1:
        every, packed = (np.concatenate(part) for part in zip(*parts, strict=True))
        order = np.argsort(every)
        parts = kept.parts[common] = [(every[order], packed[order])]
    every, packed = parts[0]
    order = np.arange(len(every)) if (every[1:] >= every[:-1]).all() else np.argsort(every)
    place = order[np.minimum(np.searchsorted(every, words, sorter=order), len(every) - 1)]
    answer = np.unpackbits(packed[place], axis=1, count=int(np.prod(shape)))
    return answer.astype(bool).reshape(len(words), *shape), every[place] == words
