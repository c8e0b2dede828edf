"""Load the Embree library bundled with the embreex wheel, and call its C interface directly.

embreex traces one ray at a time. The same library traces packets of rays with one direction several times as fast; its
C interface (github.com/RenderKit/embree, version 4) is called here through ctypes, without a compiler.
"""

import ctypes
import functools
from importlib import metadata

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
VERSION_MAJOR, NATIVE_PACKETS = 1, {16: 34, 8: 33, 4: 32}  # device properties
TRIANGLES, INDICES, VERTICES = 0, 0, 1  # geometry and buffer types
THREE_WORDS, THREE_FLOATS = 0x5003, 0x9003  # buffer formats
ROBUST = 1 << 2
COHERENT = 1 << 16  # hint that the rays of a packet are coherent
ROW = 12  # [bytes] stride of three integers or floats


class Arguments(ctypes.Structure):
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

    paths = [entry.locate() for entry in metadata.files("embreex") or () if "embree4" in entry.name.lower()]
    if not paths:
        raise LibraryError("embreex has no Embree 4 library bundled")
    try:
        library = ctypes.CDLL(str(paths[0]))
        for name, (result, arguments) in PROTOTYPES.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
    except (OSError, AttributeError) as error:
        raise LibraryError(f"its library cannot be loaded ({error})") from error
    device = library.rtcNewDevice(None)
    if not device:
        raise LibraryError("Embree cannot create a device")
    if library.rtcGetDeviceProperty(device, VERSION_MAJOR) != 4:
        raise LibraryError("its library is not Embree 4")
    widths = [width for width, number in NATIVE_PACKETS.items() if library.rtcGetDeviceProperty(device, number)]
    if not widths:
        raise LibraryError("this processor has no native support for ray packets")
    return library, device, max(widths)


def build_tree(library, device, vertices, triangles):
    """Handle of a committed triangle scene; the arrays must outlive it, `vertices` needs one spare row at the end."""
    scene, mesh = library.rtcNewScene(device), library.rtcNewGeometry(device, TRIANGLES)
    library.rtcSetSceneFlags(scene, ROBUST)
    share = library.rtcSetSharedGeometryBuffer
    share(mesh, VERTICES, 0, THREE_FLOATS, vertices.ctypes.data, 0, ROW, len(vertices) - 1)
    share(mesh, INDICES, 0, THREE_WORDS, triangles.ctypes.data, 0, ROW, len(triangles))
    library.rtcCommitGeometry(mesh)
    library.rtcAttachGeometry(scene, mesh)
    library.rtcReleaseGeometry(mesh)  # the scene holds it
    library.rtcCommitScene(scene)
    if error := library.rtcGetDeviceError(device):
        library.rtcReleaseScene(scene)
        raise LibraryError(f"Embree could not build its BVH (error {error})")
    return scene


def address_of(library, name):
    """Address of a C function."""
    try:
        return ctypes.cast(getattr(library, name), POINTER).value
    except AttributeError as error:
        raise LibraryError(f"the library has no {name}") from error
