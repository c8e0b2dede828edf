"""What a ray meets: Embree behind one small interface.

Packets of rays go straight into Embree's library where that proves itself (`choose_engine`), single rays through
embreex (github.com/trimesh/embreex) everywhere else. Both give the same answers.
"""

import threading
import time
from contextlib import contextmanager

import numpy as np

from ..check_arrays import check_array, check_triangles
from ..errors import InputError
from .choose_engine import TREES, choose_engine


class RayScene:
    """Triangles that can be asked what a ray meets.

    Parameters
    ----------
    vertices : (v, 3) float
        [m], finite, with a local origin.
    triangles : (t, 3) int
    engine : str, optional
        Of `choose_engine.TREES`; if not given, the faster one that works here.

    Raises
    ------
    InputError
        If an array has the wrong shape, names a vertex that does not exist or holds a number that is not finite:
        Embree must never see one.
    """

    def __init__(self, vertices, triangles, engine=None):
        vertices, triangles = check_triangles(vertices, triangles)
        self.triangle_count = len(triangles)
        self.thread_seconds = 0.0  # spent in Embree, summed over the threads
        self._lock = threading.Lock()
        self.engine = engine or choose_engine()[0]
        if self.triangle_count:
            self._tree = TREES[self.engine](vertices.astype(np.float32), triangles.astype(np.int32))

    def trace_closest(self, ray_origins, ray_directions):
        """First triangle on each ray.

        Parameters
        ----------
        ray_origins, ray_directions : (n, 3) float32

        Returns
        -------
        hit_triangles : (n,) int32
            -1 where the ray meets nothing.
        """
        ray_origins, ray_directions = usable_pairs(ray_origins, ray_directions)
        if not self.triangle_count or not len(ray_origins):
            return np.full(len(ray_origins), -1, np.int32)
        with self._timed():
            return self._tree.trace_closest(ray_origins, ray_directions)

    def trace_places(self, ray_origins, ray_directions):
        """First triangle on each ray, and where on it.

        Parameters
        ----------
        ray_origins, ray_directions : (n, 3) float32

        Returns
        -------
        hit_triangles : (n,) int32
            -1 where the ray meets nothing.
        b1, b2 : (n,) float32
            Barycentric weights of the second and third corner; without meaning where nothing is met.
        """
        ray_origins, ray_directions = usable_pairs(ray_origins, ray_directions)
        if not self.triangle_count or not len(ray_origins):
            nowhere = np.zeros(len(ray_origins), np.float32)
            return np.full(len(ray_origins), -1, np.int32), nowhere, nowhere
        with self._timed():
            return self._tree.trace_places(ray_origins, ray_directions)

    def trace_blocked(self, ray_origins, ray_direction):
        """Whether anything stands on each ray.

        Parameters
        ----------
        ray_origins : (n, 3) float32
        ray_direction : (3,) float32
            One direction for all rays.

        Returns
        -------
        blocked : (n,) bool
        """
        ray_origins = usable_rays("ray_origins", ray_origins)
        ray_direction = usable_rays("ray_direction", np.asarray(ray_direction)[None])
        if not self.triangle_count or not len(ray_origins):
            return np.zeros(len(ray_origins), bool)
        with self._timed():
            return self._tree.trace_blocked(ray_origins, ray_direction)

    def trace_shadow_rays(self, position, wanted, directions):
        """Which points of some patches see which suns.

        Parameters
        ----------
        position : (c, m, 3) float32
            Points of each patch.
        wanted : (c, s) bool
            Suns that each patch asks for.
        directions : (s, 3) float32

        Returns
        -------
        free : (c, s, m) bool
            False for suns that were not asked for.
        """
        usable_rays("position", position.reshape(-1, 3))
        directions = usable_rays("directions", directions)
        if not self.triangle_count:
            return np.repeat(wanted[:, :, None], position.shape[1], axis=2)
        with self._timed():
            return self._tree.trace_shadow_rays(position, wanted, directions)

    @contextmanager
    def _timed(self):
        started = time.perf_counter()
        yield
        with self._lock:
            self.thread_seconds += time.perf_counter() - started


def usable_rays(name, rays):
    """Ray origins or directions as the engines take them: (n, 3) float32, finite, row by row or column by column."""
    rays = np.asarray(check_array(name, rays, ("n", 3)), np.float32)
    return rays if rays.flags.c_contiguous or rays.flags.f_contiguous else np.ascontiguousarray(rays)


def usable_pairs(ray_origins, ray_directions):
    """Ray origins and as many directions."""
    ray_origins = usable_rays("ray_origins", ray_origins)
    ray_directions = usable_rays("ray_directions", ray_directions)
    if len(ray_origins) != len(ray_directions):
        problem = f"{len(ray_directions)} rows for {len(ray_origins)} ray_origins"
        raise InputError("ray_directions", problem, "give one direction per ray")
    return ray_origins, ray_directions
