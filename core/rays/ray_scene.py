"""Ray queries on a triangle scene: closest hits and shadow rays with Embree.

Packets of rays go directly to the Embree library if its self-test passes (`choose_engine`), else
single rays go through embreex (github.com/trimesh/embreex). Both give the same results.
"""

import threading
import time
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from ..settings.errors import InputError, check_array, check_triangles
from .engines import TREES, choose_engine


class RayScene:
    """Triangles for ray queries.

    Parameters
    ----------
    vertices : (v, 3) float
        [m], finite, relative to a local origin.
    triangles : (t, 3) int
    engine : str, optional
        A key of `choose_engine.TREES`; by default the faster one that works here.

    Raises
    ------
    InputError
        If an array has the wrong shape, a vertex index is out of range or a number is not finite,
        which Embree does not check.
    """

    canopy = None  # city.canopy.Canopy of scenes with trees
    # of a part of a city: its tree, patches of all triangles, and which of these the part has
    whole = None

    def __init__(self, vertices, triangles, engine=None):
        vertices, triangles = check_triangles(vertices, triangles)
        self.triangle_count = len(triangles)
        self.thread_seconds = 0.0  # spent in Embree, summed over the threads
        self._lock = threading.Lock()
        self.engine = engine or choose_engine()[0]
        if self.triangle_count:
            self._tree = TREES[self.engine](vertices.astype(np.float32), triangles.astype(np.int32))

    @property
    def _shadow_tree(self):
        """The tree that shadow rays pass, where they need not know which triangle blocks them."""
        return self._tree

    @property
    def states(self):
        """States of trees: in leaf and bare where some lose their leaves, else one."""
        return self.canopy.states if self.canopy else 1

    def trace_closest(self, ray_origins, ray_directions):
        """First triangle hit by each ray.

        Parameters
        ----------
        ray_origins, ray_directions : (n, 3) float32

        Returns
        -------
        hit_triangles : (n,) int32
            -1 if the ray hits nothing.
        """
        return self.trace_as_drawn(ray_origins, ray_directions).triangle

    def trace_places(self, ray_origins, ray_directions):
        """First triangle hit by each ray, and the position of the hit.

        Parameters
        ----------
        ray_origins, ray_directions : (n, 3) float32

        Returns
        -------
        HitPlaces
            n, of int32 and float32.
        """
        ray_origins = _usable_rays("ray_origins", ray_origins)
        ray_directions = _usable_rays("ray_directions", ray_directions)
        if len(ray_origins) != len(ray_directions):
            raise InputError(
                "ray_directions",
                f"{len(ray_directions)} rows for {len(ray_origins)} ray_origins",
                "give one direction per ray",
            )
        if not self.triangle_count or not len(ray_origins):
            nowhere = np.zeros(len(ray_origins), np.float32)
            return HitPlaces(np.full(len(ray_origins), -1, np.int32), nowhere, nowhere)
        with self._timed():
            return HitPlaces(*self._tree.trace_places(ray_origins, ray_directions))

    trace_as_drawn = trace_places  # the same where a kind of scene assigns hits to other faces

    def trace_blocked(self, ray_origins, ray_direction):
        """Whether each ray is blocked.

        Parameters
        ----------
        ray_origins : (n, 3) float32
        ray_direction : (3,) float32
            One direction for all rays.

        Returns
        -------
        blocked : (n,) bool
        """
        ray_origins = _usable_rays("ray_origins", ray_origins)
        ray_direction = _usable_rays("ray_direction", np.asarray(ray_direction)[None])
        if not self.triangle_count or not len(ray_origins):
            return np.zeros(len(ray_origins), bool)
        position, wanted = (
            np.ascontiguousarray(ray_origins)[:, None],
            np.ones((len(ray_origins), 1), bool),
        )
        with self._timed():
            return ~self._shadow_tree.trace_shadow_rays(position, wanted, ray_direction)[:, 0, 0]

    def trace_shadow_rays(self, position, wanted, directions):
        """Which points of patches see which suns.

        Parameters
        ----------
        position : (c, m, 3) float32
            Points of each patch.
        wanted : (c, s) bool
            Suns requested for each patch.
        directions : (s, 3) float32

        Returns
        -------
        free : (c, s, m) bool
            False for suns that were not requested.
        """
        _usable_rays("position", position.reshape(-1, 3))
        directions = _usable_rays("directions", directions)
        if not self.triangle_count:
            return np.repeat(wanted[:, :, None], position.shape[1], axis=2)
        with self._timed():
            return self._shadow_tree.trace_shadow_rays(position, wanted, directions)

    def trace_shadow_states(self, position, wanted, directions):
        """Trace shadow rays in each state of trees: (states, c, s, m) bool."""
        return self.trace_shadow_rays(position, wanted, directions)[None]

    @contextmanager
    def _timed(self):
        started = time.perf_counter()
        yield
        with self._lock:
            self.thread_seconds += time.perf_counter() - started


def _usable_rays(name, rays):
    """Ray origins or directions for the engines: (n, 3) float32, finite, contiguous in C or Fortran
    order.
    """
    rays = np.asarray(check_array(name, rays, ("n", 3)), np.float32)
    return (
        rays if rays.flags.c_contiguous or rays.flags.f_contiguous else np.ascontiguousarray(rays)
    )


class HitPlaces(NamedTuple):
    """Points on triangles, or on the patches that are these triangles."""

    triangle: np.ndarray  # (m,) int, -1 for none
    b1: np.ndarray  # (m,) float, barycentric coordinate for the second vertex; undefined for none
    b2: np.ndarray  # (m,) float, for the third vertex

    def take(self, chosen):
        """Some of them, or all in another shape: HitPlaces."""
        return HitPlaces(*(part[chosen] for part in self))
