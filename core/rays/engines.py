"""Embree, called in packets of rays if a self-test passes, else ray by ray.

embreex (github.com/trimesh/embreex) traces one ray at a time. The Embree library bundled with its
wheel traces packets of rays with one direction several times as fast; its C interface
(github.com/RenderKit/embree, version 4) is called here through ctypes, without a compiler.
"""

import ctypes
import functools
import os
from importlib import metadata

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from ..settings.errors import InputError
from . import packet_loops

POINTER = ctypes.c_void_p
# C functions used: result type, argument types.
PROTOTYPES = {
    "rtcNewDevice": (POINTER, [ctypes.c_char_p]),
    "rtcGetDeviceProperty": (ctypes.c_ssize_t, [POINTER, ctypes.c_int]),
    "rtcGetDeviceError": (ctypes.c_int, [POINTER]),
    "rtcNewScene": (POINTER, [POINTER]),
    "rtcSetSceneFlags": (None, [POINTER, ctypes.c_int]),
    "rtcNewGeometry": (POINTER, [POINTER, ctypes.c_int]),
    "rtcSetSharedGeometryBuffer": (
        None,
        [POINTER, ctypes.c_int, ctypes.c_uint, ctypes.c_int, POINTER, *[ctypes.c_size_t] * 3],
    ),
    "rtcCommitGeometry": (None, [POINTER]),
    "rtcAttachGeometry": (ctypes.c_uint, [POINTER, POINTER]),
    "rtcReleaseGeometry": (None, [POINTER]),
    "rtcCommitScene": (None, [POINTER]),
    "rtcReleaseScene": (None, [POINTER]),
    "rtcReleaseDevice": (None, [POINTER]),
}


class _Arguments(ctypes.Structure):
    """RTCIntersectArguments, and RTCOccludedArguments, which has the same fields."""

    _fields_ = (
        ("flags", ctypes.c_int),
        ("feature_mask", ctypes.c_int),
        ("context", POINTER),
        ("filter", POINTER),
        ("function", POINTER),
        ("reserved", POINTER * 2),
    )


class LibraryError(Exception):
    """The library is missing, or does not behave as expected."""


@functools.cache
def load_library():
    """Load the library bundled with embreex.

    Returns
    -------
    library : ctypes.CDLL
    device : int
        Device handle, kept for the lifetime of the process.
    width : int
        Widest packet that this processor traces natively.

    Raises
    ------
    LibraryError
        With the reason.
    """
    import embreex.rtcore_scene  # noqa: F401, loads the library's own dependencies

    # The library lies among the files of the package.
    paths = [
        entry.locate()
        for entry in metadata.files("embreex") or ()
        if "embree4" in entry.name.lower()
    ]
    if not paths:
        raise LibraryError("embreex has no Embree 4 library bundled")
    # Functions with the types of their arguments, so that a wrong call fails here and not in
    # memory.
    try:
        library = ctypes.CDLL(str(paths[0]))
        for name, (result, arguments) in PROTOTYPES.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
    except (OSError, AttributeError) as error:
        raise LibraryError(f"its library cannot be loaded ({error})") from error
    # It must be the right version, on a processor that it can use.
    device = library.rtcNewDevice(None)
    if not device:
        raise LibraryError("Embree cannot create a device")
    # Property 1 of a device is the major version.
    if library.rtcGetDeviceProperty(device, 1) != 4:
        raise LibraryError("its library is not Embree 4")
    # Properties 34, 33 and 32 of a device: whether packets of 16, 8 and 4 rays are native.
    widths = [
        width
        for width, number in ((16, 34), (8, 33), (4, 32))
        if library.rtcGetDeviceProperty(device, number)
    ]
    if not widths:
        raise LibraryError("this processor has no native support for ray packets")
    return library, device, max(widths)


def _build_tree(library, device, vertices, triangles, *, row=12):
    """Handle of a committed triangle scene; the arrays must outlive it, `vertices` needs one spare
    row at the end.
    """
    # Geometry of type 0: triangles.
    scene, mesh = library.rtcNewScene(device), library.rtcNewGeometry(device, 0)
    # Flag of a scene whose edges are watertight: robust.
    library.rtcSetSceneFlags(scene, 1 << 2)
    share = library.rtcSetSharedGeometryBuffer
    # `row`: [bytes] stride of three integers or floats.
    share(mesh, 1, 0, 0x9003, vertices.ctypes.data, 0, row, len(vertices) - 1)
    # Buffers of type 0 hold indices, three 32-bit words a row; of type 1 vertices, three floats a
    # row.
    share(mesh, 0, 0, 0x5003, triangles.ctypes.data, 0, row, len(triangles))
    library.rtcCommitGeometry(mesh)
    library.rtcAttachGeometry(scene, mesh)
    library.rtcReleaseGeometry(mesh)  # the scene holds it
    library.rtcCommitScene(scene)
    if error := library.rtcGetDeviceError(device):
        library.rtcReleaseScene(scene)
        raise LibraryError(f"Embree could not build its BVH (error {error})")
    return scene


class PacketTree:
    """Embree's BVH over triangles, traced in packets. Methods as in `RayScene`, without input
    checks.

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
        self._scene = _build_tree(self._library, device, self._vertices, self._triangles)
        # Shadow rays of a packet are coherent, hemisphere rays are not.
        self._arguments = _Arguments(feature_mask=-1), _Arguments(flags=1 << 16, feature_mask=-1)
        self._closest, self._blocked = (
            (
                ctypes.cast(self._library[name + str(self._width)], POINTER).value,
                self._scene,
                how,
                self._width,
            )
            for name, how in zip(
                ("rtcIntersect", "rtcOccluded"), map(ctypes.addressof, self._arguments), strict=True
            )
        )

    def __del__(self):
        if getattr(self, "_scene", None):
            self._library.rtcReleaseScene(self._scene)
            self._scene = None

    def trace_places(self, origins, directions):
        """First triangle hit by each ray and barycentric coordinates of the hit: (n,) int32, (n,)
        and (n,) float32.
        """
        rays = np.ascontiguousarray(origins.T), np.ascontiguousarray(directions.T)
        hit = np.empty(len(origins), np.int32)
        b1, b2 = np.empty((2, len(origins)), np.float32)
        room = packet_loops.make_packet(self._width)
        packet_loops.trace_closest(self._closest, room, rays, (hit, b1, b2))
        return hit, b1, b2

    def trace_shadow_rays(self, position, wanted, directions):
        """Which points of patches, (c, m, 3), see the requested suns, (c, s): (c, s, m) bool."""
        free = np.zeros((*wanted.shape, position.shape[1]), bool)
        spread = np.repeat(directions, self._width, axis=1)
        room = packet_loops.make_packet(self._width)
        packet_loops.trace_shadow_rays(self._blocked, room, (position, wanted), spread, free)
        return free


class _RayTree:
    """Embree's BVH over triangles, traced ray by ray. Methods as in `RayScene`, without input
    checks.

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

    def trace_places(self, origins, directions):
        """First triangle hit by each ray and barycentric coordinates of the hit: (n,) int32, (n,)
        and (n,) float32.
        """
        found = self._scene.run(
            np.ascontiguousarray(origins), np.ascontiguousarray(directions), output=1
        )
        return found["primID"], found["u"], found["v"]

    def trace_shadow_rays(self, position, wanted, directions):
        """Which points of patches, (c, m, 3), see the requested suns, (c, s): (c, s, m) bool."""
        free = np.zeros((*wanted.shape, position.shape[1]), bool)
        for sun in range(len(directions)):
            chosen = np.flatnonzero(wanted[:, sun])
            if len(chosen):
                origins = np.ascontiguousarray(position[chosen].reshape(-1, 3))
                met = self._scene.run(origins, directions[sun : sun + 1], query="OCCLUDED")
                free[chosen, sun] = (met != 0).reshape(len(chosen), -1)
        return free


TREES = {"packets": PacketTree, "rays": _RayTree}
VARIABLE = "CITYPV_ENGINE"  # environment variable that forces one engine


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
        raise InputError(
            VARIABLE, f"{asked!r} is not an engine", f"set it to {' or '.join(TREES)}, or unset it"
        )
    if asked == "rays":
        return "rays", f"requested by {VARIABLE}"
    fault = fault_of_packets()
    if fault and asked:
        raise InputError(
            VARIABLE, f"packets do not work here: {fault}", "set it to rays, or unset it"
        )
    return (
        ("rays", f"no packets: {fault}")
        if fault
        else ("packets", "they agree with single rays on a test scene")
    )


@functools.cache
def fault_of_packets():
    """Why packets cannot be used in this process, "" if they agree with single rays on a small test
    scene.
    """
    generator = np.random.default_rng(1)  # a few hundred triangles in a box, and rays through them
    middles = generator.uniform(-10, 10, (300, 1, 3))
    vertices = (middles + generator.normal(size=(300, 3, 3))).reshape(-1, 3).astype(np.float32)
    triangles = np.arange(900, dtype=np.int32).reshape(-1, 3)
    origins, directions = generator.normal(size=(2, 1000, 3)).astype(np.float32) * np.float32(
        [[[5]], [[1]]]
    )
    try:
        packets, rays = PacketTree(vertices, triangles), _RayTree(vertices, triangles)
    except (LibraryError, AttributeError) as error:
        return str(error)
    found, true = (np.array(tree.trace_places(origins, directions)) for tree in (packets, rays))
    met = true[0] >= 0
    if (found[0] != true[0]).any() or not np.allclose(found[:, met], true[:, met], atol=1e-5):
        return "hits differ from those of single rays"
    wanted = np.ones((len(origins) // 10, 3), bool)
    position = origins.reshape(-1, 10, 3)
    found, true = (
        tree.trace_shadow_rays(position, wanted, directions[:3]) for tree in (packets, rays)
    )
    if (found != true).any():
        return "shadows differ from those of single rays"
    return ""
