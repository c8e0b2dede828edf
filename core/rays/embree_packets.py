"""Trace packets of rays with the Embree library."""

import ctypes

import numpy as np

from . import packet_loops
from .embree_library import COHERENT, Arguments, address_of, build_tree, load_library


class PacketTree:
    """Embree's BVH over triangles, traced in packets. Methods as in `RayScene`, without input checks.

    Parameters
    ----------
    vertices : (v, 3) float32 [m]
    triangles : (t, 3) int32

    Raises
    ------
    LibraryError
    """

    def __init__(self, vertices, triangles):
        self._library, device, self._width = load_library()
        # Embree reads each vertex as four floats: a spare row keeps the last read inside the array.
        self._vertices = np.zeros((len(vertices) + 1, 3), np.float32)
        self._vertices[:-1] = vertices
        self._triangles = np.ascontiguousarray(triangles, np.uint32)
        self._scene = build_tree(self._library, device, self._vertices, self._triangles)
        # Shadow rays of a packet are coherent, hemisphere rays are not.
        self._arguments = Arguments(feature_mask=-1), Arguments(flags=COHERENT, feature_mask=-1)
        incoherent, coherent = map(ctypes.addressof, self._arguments)
        self._closest = (address_of(self._library, f"rtcIntersect{self._width}"), self._scene, incoherent, self._width)
        self._blocked = (address_of(self._library, f"rtcOccluded{self._width}"), self._scene, coherent, self._width)

    def __del__(self):
        if getattr(self, "_scene", None):
            self._library.rtcReleaseScene(self._scene)
            self._scene = None

    def trace_closest(self, origins, directions):
        """First triangle hit by each ray: (n,) int32, -1 for none."""
        return self.trace_places(origins, directions)[0]

    def trace_places(self, origins, directions):
        """First triangle hit by each ray and barycentric coordinates of the hit: (n,) int32, (n,) and (n,) float32."""
        rays = np.ascontiguousarray(origins.T), np.ascontiguousarray(directions.T)
        hit = np.empty(len(origins), np.int32)
        b1, b2 = np.empty((2, len(origins)), np.float32)
        packet_loops.trace_closest(self._closest, rays, (hit, b1, b2))
        return hit, b1, b2

    def trace_blocked(self, origins, direction):
        """Whether each ray is blocked, for one direction (1, 3): (n,) bool."""
        position, wanted = np.ascontiguousarray(origins)[:, None], np.ones((len(origins), 1), bool)
        return ~self.trace_shadow_rays(position, wanted, direction)[:, 0, 0]

    def trace_shadow_rays(self, position, wanted, directions):
        """Which points of patches, (c, m, 3), see the requested suns, (c, s): (c, s, m) bool."""
        free = np.zeros((*wanted.shape, position.shape[1]), bool)
        spread = np.repeat(directions, self._width, axis=1)
        packet_loops.trace_shadow_rays(self._blocked, position, wanted, spread, free)
        return free
