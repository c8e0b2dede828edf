"""The Embree library that the embreex wheel carries, spoken to directly.

embreex hands over one ray after the other. The same library takes packets of rays with one direction several times as
fast; its C interface (github.com/RenderKit/embree, version 4) is called here through ctypes, without a compiler.
"""

import ctypes
import functools
from importlib import metadata

POINTER = ctypes.c_void_p
# The C functions in use: result, arguments.
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
VERSION_MAJOR, NATIVE_PACKETS = 1, {16: 34, 8: 33, 4: 32}  # properties of a device
TRIANGLES, INDICES, VERTICES = 0, 0, 1  # kinds of geometry and of buffers
THREE_WORDS, THREE_FLOATS = 0x5003, 0x9003  # formats of a row
ROBUST = 1 << 2
COHERENT = 1 << 16  # a hint that the rays of a packet run side by side
ROW = 12  # bytes of three words or floats


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
    """The library is not there, or does not answer as expected."""


@functools.cache
def load_library():
    """Load the library beside embreex.

    Returns
    -------
    library : ctypes.CDLL
    device : int
        Its handle, alive as long as the process.
    width : int
        Rays in the widest packet that this processor traces natively.

    Raises
    ------
    LibraryError
        With the reason in words.
    """
    import embreex.rtcore_scene  # noqa: F401, loads what the library itself depends on

    paths = [entry.locate() for entry in metadata.files("embreex") or () if "embree4" in entry.name.lower()]
    if not paths:
        raise LibraryError("embreex carries no Embree 4 library of its own")
    try:
        library = ctypes.CDLL(str(paths[0]))
        for name, (result, arguments) in PROTOTYPES.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
    except (OSError, AttributeError) as error:
        raise LibraryError(f"its library cannot be loaded ({error})") from error
    device = library.rtcNewDevice(None)
    if not device:
        raise LibraryError("Embree starts no device")
    if library.rtcGetDeviceProperty(device, VERSION_MAJOR) != 4:
        raise LibraryError("its library is not Embree 4")
    widths = [width for width, number in NATIVE_PACKETS.items() if library.rtcGetDeviceProperty(device, number)]
    if not widths:
        raise LibraryError("this processor traces no packets natively")
    return library, device, max(widths)


def build_tree(library, device, vertices, triangles):
    """Handle of a committed scene of triangles; the arrays must outlive it, `vertices` with one row to spare."""
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
        raise LibraryError(f"Embree built no tree (error {error})")
    return scene


def address_of(library, name):
    """Address of a C function."""
    try:
        return ctypes.cast(getattr(library, name), POINTER).value
    except AttributeError as error:
        raise LibraryError(f"the library has no {name}") from error
