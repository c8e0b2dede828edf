"""Trace single rays with embreex (github.com/trimesh/embreex), which is used in this file only."""

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene


class RayTree:
    """Embree's BVH over triangles, traced ray by ray. Methods as in `RayScene`, without input checks.

    Parameters
    ----------
    vertices : (v, 3) float32 [m]
    triangles : (t, 3) int32
    """

    def __init__(self, vertices, triangles):
        self._scene = EmbreeScene(robust=True)
        TriangleMesh(self._scene, vertices, triangles)
        # The first call builds the BVH; it must finish before threads share the scene.
        self._scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))

    def trace_closest(self, origins, directions):
        """First triangle hit by each ray: (n,) int32, -1 for none."""
        return self._scene.run(np.ascontiguousarray(origins), np.ascontiguousarray(directions))

    def trace_places(self, origins, directions):
        """First triangle hit by each ray and barycentric coordinates of the hit: (n,) int32, (n,) and (n,) float32."""
        found = self._scene.run(np.ascontiguousarray(origins), np.ascontiguousarray(directions), output=1)
        return found["primID"], found["u"], found["v"]

    def trace_blocked(self, origins, direction):
        """Whether each ray is blocked, for one direction (1, 3): (n,) bool."""
        return self._scene.run(np.ascontiguousarray(origins), direction, query="OCCLUDED") == 0

    def trace_shadow_rays(self, position, wanted, directions):
        """Which points of patches, (c, m, 3), see the requested suns, (c, s): (c, s, m) bool."""
        free = np.zeros((*wanted.shape, position.shape[1]), bool)
        for sun in range(len(directions)):
            chosen = np.flatnonzero(wanted[:, sun])
            if len(chosen):
                blocked = self.trace_blocked(position[chosen].reshape(-1, 3), directions[sun : sun + 1])
                free[chosen, sun] = ~blocked.reshape(len(chosen), -1)
        return free
