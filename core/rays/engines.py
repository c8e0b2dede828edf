"""Trace packets of rays with the Embree library."""

import ctypes
import functools
import os

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from ..errors import InputError
from . import packet_loops
from .embree_library import COHERENT, Arguments, LibraryError, address_of, build_tree, load_library


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


TREES = {"packets": PacketTree, "rays": RayTree}
VARIABLE = "CITYPV_ENGINE"  # environment variable that forces one engine
PROOF_RAYS = 1000


def choose_engine():
    """Choose the engine of this process.

    Returns
    -------
    engine : str
        A key of `TREES`.
    reason : str

    Raises
    ------
    InputError
        The environment variable names an unknown engine, or packets where they do not work.
    """
    asked = os.environ.get(VARIABLE)
    if asked and asked not in TREES:
        raise InputError(VARIABLE, f"{asked!r} is not an engine", f"set it to {' or '.join(TREES)}, or unset it")
    if asked == "rays":
        return "rays", f"requested by {VARIABLE}"
    fault = fault_of_packets()
    if fault and asked:
        raise InputError(VARIABLE, f"packets do not work here: {fault}", "set it to rays, or unset it")
    return ("rays", f"no packets: {fault}") if fault else ("packets", "they agree with single rays on a test scene")


@functools.cache
def fault_of_packets():
    """Why packets cannot be used in this process, "" if they agree with single rays on a small test scene."""
    vertices, triangles, origins, directions = scene_of_proof()
    try:
        packets, rays = PacketTree(vertices, triangles), RayTree(vertices, triangles)
    except LibraryError as error:
        return str(error)
    for name in ("trace_places", "trace_closest"):
        found, true = (np.array(getattr(tree, name)(origins, directions)) for tree in (packets, rays))
        met = true[0] >= 0 if found.ndim == 2 else slice(None)
        if not np.allclose(found[..., met], true[..., met], atol=1e-5):
            return f"{name} differs from single rays"
    wanted = np.ones((len(origins) // 10, 3), bool)
    position = origins.reshape(-1, 10, 3)
    found, true = (tree.trace_shadow_rays(position, wanted, directions[:3]) for tree in (packets, rays))
    blocked = [tree.trace_blocked(origins, directions[:1]) for tree in (packets, rays)]
    if (found != true).any() or (blocked[0] != blocked[1]).any():
        return "shadows differ from those of single rays"
    return ""


def scene_of_proof():
    """Test scene: a few hundred random triangles in a box, and rays through them.

    Returns
    -------
    vertices : (v, 3) float32
    triangles : (t, 3) int32
    origins, directions : (PROOF_RAYS, 3) float32
    """
    generator = np.random.default_rng(1)
    middles = generator.uniform(-10, 10, (300, 1, 3))
    vertices = (middles + generator.normal(size=(300, 3, 3))).reshape(-1, 3).astype(np.float32)
    triangles = np.arange(900, dtype=np.int32).reshape(-1, 3)
    origins, directions = generator.normal(size=(2, PROOF_RAYS, 3)).astype(np.float32)
    return vertices, triangles, 5 * origins, directions
