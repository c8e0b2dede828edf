"""Single rays through embreex (github.com/trimesh/embreex), which is touched in this file only."""

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene


class RayTree:
    """Embree's tree over triangles, asked ray by ray. Methods as of `RayScene`, for arrays that are known to be good.

    Parameters
    ----------
    vertices : (v, 3) float32 [m]
    triangles : (t, 3) int32
    """

    def __init__(self, vertices, triangles):
        self._scene = EmbreeScene(robust=True)
        TriangleMesh(self._scene, vertices, triangles)
        # The first call builds the tree; it must be over before threads share the scene.
        self._scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))

    def trace_closest(self, origins, directions):
        """First triangle on each ray: (n,) int32, -1 for none."""
        return self._scene.run(np.ascontiguousarray(origins), np.ascontiguousarray(directions))

    def trace_places(self, origins, directions):
        """First triangle on each ray and the barycentric weights of the place: (n,) int32, (n,) and (n,) float32."""
        found = self._scene.run(np.ascontiguousarray(origins), np.ascontiguousarray(directions), output=1)
        return found["primID"], found["u"], found["v"]

    def trace_blocked(self, origins, direction):
        """Whether anything stands on each ray of one direction, (1, 3): (n,) bool."""
        return self._scene.run(np.ascontiguousarray(origins), direction, query="OCCLUDED") == 0

    def trace_shadow_rays(self, position, wanted, directions):
        """Which points of patches, (c, m, 3), see the suns that are wanted, (c, s): (c, s, m) bool."""
        free = np.zeros((*wanted.shape, position.shape[1]), bool)
        for sun in range(len(directions)):
            chosen = np.flatnonzero(wanted[:, sun])
            if len(chosen):
                blocked = self.trace_blocked(position[chosen].reshape(-1, 3), directions[sun : sun + 1])
                free[chosen, sun] = ~blocked.reshape(len(chosen), -1)
        return free
