"""How much light passes through crowns, and which rays end in leaves.

   sun
     \\   entry            A crown is a volume of leaves of equal density. Of light on a way of length L inside, the
      (~~\\~~)             share exp(-k · LAD · L) passes (Beer-Lambert law): k is the extinction
                           coefficient, LAD the
       (~~\\~) exit        leaf area density. Densities of crowns that overlap add up. Leaves
                           reflect nothing; trunks
          | \\             are opaque.
          |  \\ patch

Light is not weighted but rays are stopped: a ray passes with the probability of the transmittance.
Means are the same, and all that counts rays (sky, form factors, visible suns, photons) stays as it
is. Random numbers of the rays of one patch are evenly spread, so that little noise is added.

Of trees that lose their leaves, one sum over the crossings of a ray tells for both states: bare
crowns stop no ray that crowns in leaf let pass.

References
----------
Monsi and Saeki (1953), doi:10.1093/aob/mci052 (English, 2005). Nilson (1971),
doi:10.1016/0002-1571(71)90092-6.
"""

import numpy as np

from ..rays.random_numbers import GOLDEN, mix
from ..rays.ray_scene import RayScene
from .crossing_loops import build_hierarchy, sum_crossings


class Canopy:
    """Crowns and trunks for attenuating rays, in leaf and bare.

    Parameters
    ----------
    crowns : Crowns
    per_metre : (k,) float64
        Optical depth per metre in each crown, k · LAD [m⁻¹].
    per_crossing : (k,) float64
        Optical depth of crossing each crown once.
    without_leaves : (k,) float64, optional
        Share of these optical depths that stays without leaves, at most 1; None: one state all
        year.
    """

    def __init__(self, crowns, per_metre, per_crossing, without_leaves=None):
        self.vertices = crowns.vertices
        self.ray_scene = RayScene(crowns.vertices, crowns.triangles)
        self.states = 1 if without_leaves is None else 2
        corners = crowns.vertices[crowns.triangles]
        *hierarchy, order = build_hierarchy(corners, 2 * crowns.tree + crowns.trunk)
        filled = np.where(order[..., None, None] >= 0, corners[order], 0.0)
        # (l, 3, 3, LEAF)
        self._bodies = (
            tuple(hierarchy),
            np.ascontiguousarray(np.moveaxis(filled, 1, -1)),
        )
        tree, trunk = crowns.tree[order], crowns.trunk[order]
        # A crossing of a crown is an entry and an exit: half each.
        costs = (
            np.where(trunk, 0.0, per_metre[tree]),
            # A trunk has an optical depth of a million: nothing passes.
            np.where(trunk, 1e6, per_crossing[tree] / 2),
        )
        share = np.ones(len(per_metre)) if without_leaves is None else without_leaves
        # the triangles of a leaf are of one body
        self._costs = (
            *costs,
            np.where(trunk[:, 0], 1.0, share[tree[:, 0]]),
        )

    def transmittance(self, ray_origins, ray_directions, reach=None, least=None):
        """Share of light that passes along rays.

        Parameters
        ----------
        ray_origins, ray_directions : (n, 3) float
            Directions of unit length.
        reach : (n,) float, optional
            Length of each ray [m]; infinite if not given.
        least : (n,) float, optional
            Transmittance from which on it is wanted: of rays with less, any value below it is
            returned.

        Returns
        -------
        (2, n) float64
            In each state; the second counts where there are two.
        """
        passed = np.ones((2, len(ray_origins)))
        met = np.flatnonzero(self.ray_scene.trace_closest(ray_origins, ray_directions) >= 0)
        ends = np.full(len(met), 1e30) if reach is None else np.asarray(reach, float)[met]
        rays = (np.ascontiguousarray(part[met], float) for part in (ray_origins, ray_directions))
        # A billionth of optical depth is more than rounding.
        enough = np.full(len(met), np.inf) if least is None else 1e-9 - np.log(least[met])
        depth = np.empty((2, len(met)))
        sum_crossings(*self._bodies, self._costs, (*rays, ends, enough), depth)
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
        (states, c, r) bool
        """
        shape = ray_origins.shape[:2]
        numbers = _draw_numbers(ray_origins[:, 0], ray_directions[:, 0], shape[1]).reshape(-1)
        rays = ray_origins.reshape(-1, 3), ray_directions.reshape(-1, 3)
        passed = self.transmittance(*rays, None if reach is None else reach.reshape(-1), numbers)
        return (passed[: self.states] < numbers).reshape(-1, *shape)

    def stop_shadow_rays(self, position, free, directions):
        """Which shadow rays that nothing else stops pass all crowns.

        Parameters
        ----------
        position : (c, m, 3) float32
            Points of each patch.
        free : (c, s, m) bool
            Which points see which suns without crowns.
        directions : (s, 3) float32

        Returns
        -------
        (states, c, s, m) bool
        """
        # Which rays meet crowns at all; only these are followed through them.
        wanted = free.any(axis=2)
        shaded = free & ~self.ray_scene.trace_shadow_rays(position, wanted, directions)
        row, sun = np.nonzero(shaded.any(axis=2))
        free_rays = np.repeat(free[None], self.states, axis=0)
        # A ray passes with the probability of its transmittance: a random number below it lets it
        # through, the same in both states of trees.
        if len(row):
            passed = np.ones((2, len(row), position.shape[1]))
            pair, point = np.nonzero(shaded[row, sun])
            numbers = _draw_numbers(position[row, 0], directions[sun], position.shape[1])
            rays = position[row[pair], point], directions[sun[pair]]
            passed[:, pair, point] = self.transmittance(*rays, least=numbers[pair, point])
            free_rays[:, row, sun] &= passed[: self.states] >= numbers
        return free_rays


def _draw_numbers(ray_origins, ray_directions, count):
    """Numbers in (0, 1], evenly spread in each row and shifted by chance: (n, count) float64.

    The chance follows from one ray of each row, (n, 3), so that it does not depend on the order of
    rows.
    """
    words = np.zeros(len(ray_origins), np.uint64)
    for values in (ray_origins, ray_directions):
        for axis in range(3):
            bits = (
                np.ascontiguousarray(values[:, axis], np.float32).view(np.uint32).astype(np.uint64)
            )
            words = mix((words ^ bits) + GOLDEN)
    start = (words >> np.uint64(11)).astype(float)[:, None] * 2.0**-53
    # Steps by the golden ratio are spread evenly, however many there are.
    return 1 - (start + np.arange(count) * 0.6180339887498949) % 1.0


class LeafyScene(RayScene):
    """Triangles for ray queries, with crowns that may stop rays.

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

    def trace_shadow_states(self, position, wanted, directions):
        """As of `RayScene`."""
        free = super().trace_shadow_states(position, wanted, directions)
        return (
            free
            if self.canopy is None
            else self.canopy.stop_shadow_rays(position, free[0], directions)
        )
