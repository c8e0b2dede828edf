"""Loops that fill ray packets, call Embree and read the results (compiled by numba).

A packet is Embree's RTCRayHit of `width` rays: 12 rows for the rays, 9 for the hits, each as wide
as the packet.
"""

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

# rows of a packet
ORIGIN, NEAR, DIRECTION, FAR, MASK = 0, 3, 4, 8, 9
B1, B2, TRIANGLE, MESH, INSTANCE, ROWS = 15, 16, 17, 18, 19, 24
NONE = -1


@intrinsic
def _call_embree(_, function, valid, scene, packet, arguments):
    """Call `function(valid, scene, packet, arguments)`, all given as addresses."""

    def generate(context, builder, _, values):
        word = ir.IntType(64)
        pointer = builder.inttoptr(
            values[0], ir.FunctionType(ir.VoidType(), [word] * 4).as_pointer()
        )
        builder.call(pointer, values[1:])
        return context.get_dummy_value()

    return types.void(*[types.intp] * 5), generate


def make_packet(width):
    """Room for a packet of `width` rays, aligned to 64 bytes as Embree wants it: (ROWS · width,)
    float32, the same memory as int32, and (width,) int32, which rays are valid.
    """
    whole = np.zeros((ROWS + 1) * width + 16, np.float32)
    skipped = (-(whole.ctypes.data // 4)) % 16
    packet = whole[skipped : skipped + (ROWS + 1) * width]
    words = packet.view(np.int32)
    words[MASK * width : (MASK + 1) * width] = -1
    return packet, words, words[ROWS * width :]


@njit(nogil=True, cache=True)
def trace_closest(tree, room, rays, found):
    """Closest hits of rays.

    Parameters
    ----------
    tree : tuple of int
        Addresses of Embree's function, scene and arguments, and the packet width.
    room : tuple of array
        Of `make_packet`.
    rays : tuple of (3, n) and (3, n) float32
        Origins and directions.
    found : tuple of (n,) int32, (n,) and (n,) float32
        Output: triangle, -1 for none, and barycentric coordinates of the hit.
    """
    function, scene, arguments, width = tree
    (packet, words, valid), (origins, directions), (hit, b1, b2) = room, rays, found
    count = len(hit)
    for first in range(0, count, width):
        lanes = min(width, count - first)
        # A packet of rays side by side; lanes beyond the last ray are not valid.
        for lane in range(width):
            valid[lane] = -1 if lane < lanes else 0
            ray = first + min(lane, lanes - 1)
            for axis in range(3):
                packet[(ORIGIN + axis) * width + lane] = origins[axis, ray]
                packet[(DIRECTION + axis) * width + lane] = directions[axis, ray]
            packet[FAR * width + lane] = np.inf
            words[MESH * width + lane] = NONE
            words[INSTANCE * width + lane] = NONE
        _call_embree(function, valid.ctypes.data, scene, packet.ctypes.data, arguments)
        for lane in range(lanes):
            met = words[MESH * width + lane] != NONE
            hit[first + lane] = words[TRIANGLE * width + lane] if met else NONE
            b1[first + lane] = packet[B1 * width + lane]
            b2[first + lane] = packet[B2 * width + lane]


@njit(nogil=True, cache=True)
def trace_shadow_rays(tree, room, asked, directions, free):
    """Which points of each patch see each requested sun.

    Where a patch has fewer points than a packet has rays, neighbouring patches share packets.

    Parameters
    ----------
    tree, room
        As of `trace_closest`.
    asked : tuple of (c, m, 3) float32 and (c, s) bool
        Points of each patch, and which suns it looks at.
    directions : (s, 3 · width) float32
        Each as three rows of a packet.
    free : (c, s, m) bool
        Output, for requested pairs only.
    """
    function, scene, arguments, width = tree
    (packet, _, valid), (position, wanted) = room, asked
    point_count = position.shape[1]
    lanes = min(width, point_count)  # of one patch
    together = width // lanes  # patches in a packet
    for patch in range(0, len(position), together):
        members = min(together, len(position) - patch)
        for first in range(0, point_count, lanes):
            # The origins stay in the packet; only the direction changes from sun to sun.
            block = patch, members, first, min(lanes, point_count - first)
            _load_origins(packet, width, position, block)
            for sun in range(len(directions)):
                if not _choose_lanes(valid, wanted, sun, block):
                    continue
                for place in range(3 * width):
                    packet[DIRECTION * width + place] = directions[sun, place]
                for lane in range(width):
                    packet[FAR * width + lane] = np.inf
                _call_embree(function, valid.ctypes.data, scene, packet.ctypes.data, arguments)
                _read_free(packet, valid, free, sun, block)


@njit(nogil=True, cache=True, inline="always")
def _load_origins(packet, width, position, block):
    """Write the points of some patches into a packet; rays beyond them repeat the last one.

    A `block` is the first patch and their number, and the first point of each and their number.
    Here and below whole arrays are passed: slices of them take numba longer to compile.
    """
    patch, members, first, lanes = block
    for lane in range(width):
        used = min(lane, members * lanes - 1)
        member = used // lanes
        point = first + used - member * lanes
        for axis in range(3):
            packet[(ORIGIN + axis) * width + lane] = position[patch + member, point, axis]


@njit(nogil=True, cache=True, inline="always")
def _choose_lanes(valid, wanted, sun, block):
    """Write which rays of a packet are traced, for patches that want the sun; return whether any
    is.
    """
    patch, members, _, lanes = block
    some = False
    for lane in range(len(valid)):
        valid[lane] = 0
    for member in range(members):
        if wanted[patch + member, sun]:
            some = True
            for lane in range(lanes):
                valid[member * lanes + lane] = -1
    return some


@njit(nogil=True, cache=True, inline="always")
def _read_free(packet, valid, free, sun, block):
    """Write which of the rays of a packet that were traced are free."""
    patch, members, first, lanes = block
    far = FAR * len(valid)
    for member in range(members):
        if valid[member * lanes]:
            for lane in range(lanes):
                free[patch + member, sun, first + lane] = packet[far + member * lanes + lane] > 0
