"""Binary glTF 2.0 (ISO/IEC 12113:2022): a header, a JSON chunk, and a chunk of numbers with its
views and accessors.

This takes less code than the use of a library. Axes are glTF's: x east, y up, z south.
"""

import json
import struct
from dataclasses import dataclass, field

import numpy as np

from .colour_map import MAPS, MISSING, linear_light, mix_stops, srgb_colour

FLOAT, UINT8, UINT16, UINT32, ARRAY, ELEMENTS = 5126, 5121, 5123, 5125, 34962, 34963
COLOUR_MAP = "viridis"


@dataclass
class Buffer:
    """The binary chunk while it grows, with its views."""

    data: bytearray = field(default_factory=bytearray)
    views: list = field(default_factory=list)
    accessors: list = field(default_factory=list)

    def add(self, data, target=None):
        """Number of a new view of some bytes, which begins at a multiple of 8."""
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)}
        self.views.append(view if target is None else view | {"target": target})
        self.data += data + b"\0" * (-len(data) % 8)
        return len(self.views) - 1

    def access(self, array, kind, shape, target, **more):
        """Number of a new accessor of an array."""
        accessor = {
            "bufferView": self.add(array.tobytes(), target),
            "componentType": kind,
            "type": shape,
        }
        self.accessors.append(
            accessor | {"count": array.size // (1 if array.ndim == 1 else array.shape[1])} | more
        )
        return len(self.accessors) - 1

    def place(self, corners):
        """Number of a new accessor of the places of corners, (m, 3) [m] with x east, y
        north, z up.
        """
        places = turn_axes(corners).astype("<f4")
        bounds = {"min": places.min(axis=0).tolist(), "max": places.max(axis=0).tolist()}
        return self.access(places, FLOAT, "VEC3", ARRAY, **bounds)


def turn_axes(vectors):
    """From x east, y north, z up to x east, y up, z south: (m, 3)."""
    return vectors[:, [0, 2, 1]] * [1.0, 1.0, -1.0]


def colour_hours(hours, level, known):
    """Colours of full load hours between two levels, grey where they are not known: (n, 3) linear
    light in 0–1.
    """
    colours = np.tile(linear_light(srgb_colour(MISSING)), (len(hours), 1))
    stops, (low, high) = np.array([srgb_colour(text) for text in MAPS[COLOUR_MAP].split()]), level
    colours[known] = mix_stops(stops, np.clip((hours[known] - low) / (high - low), 0, 1))
    return colours


def plain_material(colour, **more):
    """Unlit, so that colours show as they are, and seen from both sides."""
    look = {
        "baseColorFactor": [*map(float, colour), 1.0],
        "metallicFactor": 0.0,
        "roughnessFactor": 1.0,
    }
    extensions = {"KHR_materials_unlit": {}}
    return {**more, "doubleSided": True, "pbrMetallicRoughness": look, "extensions": extensions}


def pack_glb(document, buffer):
    """Bytes of a file: the document, all of whose nodes are its scene, with the views of the
    buffer, and the buffer.
    """
    document["asset"] |= {"version": "2.0", "generator": "CityPV"}
    document |= {"scene": 0, "scenes": [{"nodes": list(range(len(document["nodes"])))}]}
    document |= {"accessors": buffer.accessors, "bufferViews": buffer.views}
    document |= {"buffers": [{"byteLength": len(buffer.data)}]}
    text = json.dumps(document, ensure_ascii=False, separators=(",", ":")).encode("utf-8")
    # so that the binary chunk's content begins at a multiple of 8
    text += b" " * (-len(text) % 8 + 4)
    head = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(buffer.data))
    chunks = (
        struct.pack("<I4s", len(text), b"JSON")
        + text
        + struct.pack("<I4s", len(buffer.data), b"BIN\0")
    )
    return head + chunks + bytes(buffer.data)
