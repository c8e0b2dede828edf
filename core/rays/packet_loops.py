"""Loops that fill ray packets, call Embree and read the results (compiled by numba).

A packet is Embree's RTCRayHit of `width` rays: 12 rows for the rays, 9 for the hits, each as wide
as the packet.
"""

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

ORIGIN, NEAR, DIRECTION, TIME, FAR, MASK, NUMBER, FLAGS = (
    0,
    3,
    4,
    7,
    8,
    9,
    10,
    11,
)  # rows of a packet
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


@njit(nogil=True, cache=True)
def aligned(count):
    """Float32 zeros, aligned to 64 bytes."""
    whole = np.zeros(count + 16, np.float32)
    skipped = (-(whole.ctypes.data // 4)) % 16
    return whole[skipped : skipped + count]


@njit(nogil=True, cache=True)
def trace_closest(tree, rays, found):
    """Closest hits of rays.

    Parameters
    ----------
    tree : tuple of int
        Addresses of Embree's function, scene and arguments, and the packet width.
    rays : tuple of (3, n) and (3, n) float32
        Origins and directions.
    found : tuple of (n,) int32, (n,) and (n,) float32
        Output: triangle, -1 for none, and barycentric coordinates of the hit.
    """
    function, scene, arguments, width = tree
    (origins, directions), (hit, b1, b2) = rays, found
    packet, valid = aligned(ROWS * width), aligned(width).view(np.int32)
    words = packet.view(np.int32)
    words[MASK * width : (MASK + 1) * width] = -1
    count = len(hit)
    for first in range(0, count, width):
        lanes = min(width, count - first)
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
def trace_shadow_rays(tree, position, wanted, directions, free):
    """Which points of each patch see each requested sun.

    Where a patch has fewer points than a packet has rays, neighbouring patches share packets.

    Parameters
    ----------
    position : (c, m, 3) float32
    wanted : (c, s) bool
    directions : (s, 3 · width) float32
        Each as three rows of a packet.
    free : (c, s, m) bool
        Output, for requested pairs only.
    """
    function, scene, arguments, width = tree
    packet, valid = aligned(ROWS * width), aligned(width).view(np.int32)
    packet.view(np.int32)[MASK * width : (MASK + 1) * width] = -1
    towards, far = (
        packet[DIRECTION * width : (DIRECTION + 3) * width],
        packet[FAR * width : (FAR + 1) * width],
    )
    point_count = position.shape[1]
    lanes = min(width, point_count)  # of one patch
    together = width // lanes  # patches in a packet
    for patch in range(0, len(position), together):
        members = min(together, len(position) - patch)
        for first in range(0, point_count, lanes):
            # The origins stay in the packet; only the direction changes from sun to sun.
            _load_origins(packet, width, position[patch : patch + members, first : first + lanes])
            traced = min(lanes, point_count - first)
            for sun in range(len(directions)):
                if not _choose_lanes(valid, wanted[patch : patch + members, sun], traced):
                    continue
                for place in range(3 * width):
                    towards[place] = directions[sun, place]
                for lane in range(width):
                    far[lane] = np.inf
                _call_embree(function, valid.ctypes.data, scene, packet.ctypes.data, arguments)
                _read_free(far, valid, free[patch : patch + members, sun, first : first + traced])


@njit(nogil=True, cache=True)
def _load_origins(packet, width, position):
    """Write the points of some patches, (members, lanes, 3), into a packet; rays beyond them repeat
    the last one.
    """
    members, lanes = position.shape[:2]
    for lane in range(width):
        used = min(lane, members * lanes - 1)
        member = used // lanes
        for axis in range(3):
            packet[(ORIGIN + axis) * width + lane] = position[member, used - member * lanes, axis]


@njit(nogil=True, cache=True)
def _choose_lanes(valid, wanted, lanes):
    """Write which rays of a packet are traced, for members that are `wanted`; return whether any
    is.
    """
    valid[:] = 0
    some = False
    for member in range(len(wanted)):
        if wanted[member]:
            some = True
            valid[member * lanes : (member + 1) * lanes] = -1
    return some


@njit(nogil=True, cache=True)
def _read_free(far, valid, free):
    """Write which of the rays that were traced, whose ends are given, are free: (members, lanes)
    bool.
    """
    members, lanes = free.shape
    for member in range(members):
        if valid[member * lanes]:
            for lane in range(lanes):
                free[member, lane] = far[member * lanes + lane] > 0
