"""Write city.glb: the scene as binary glTF 2.0, coloured by full load hours.

glTF 2.0 is ISO/IEC 12113:2022. A file is a header, a JSON chunk and a binary chunk, which takes less code than the use
of a library.
"""

import json
import struct

import numpy as np

from ..city.scene import surface_of_triangles
from ..settings.progress import silent
from .colour_map import GROUND, MAPS, MISSING, choose_range, linear_light, mix_stops, srgb_colour

STAGE = "writing city.glb"
MOST_NODES = 2000  # largest number of nodes; viewers become slow with more
COLOUR_MAP = "viridis"
FLOAT, UNSIGNED_SHORT, ARRAY_BUFFER, TRIANGLES = 5126, 5123, 34962, 4
LAYOUT = (  # attribute, component type, number of components, bytes per vertex
    ("POSITION", FLOAT, "VEC3", 12),
    ("NORMAL", FLOAT, "VEC3", 12),
    ("COLOR_0", UNSIGNED_SHORT, "VEC4", 8),
)


def write_gltf(path, scene, energy, *, label, progress=silent):
    """Write a scene with its full load hours as colours.

    Axes are those of glTF: x east, y up, z south; metres from the scene's origin, which `asset.extras` names together
    with the scale of the colours. Each building is a node of its own (all together where there are more than 2,000),
    the ground another. The material is unlit, so that colours show as they are; viewers without that extension light a
    rough surface. Ground and surfaces without full load hours are grey.

    Parameters
    ----------
    path : path-like
    scene : Scene
    energy : Energy
        Of its surfaces.
    label : str
        Of the weather.
    progress : callable, optional
        See `core.progress`.
    """
    progress(STAGE, 0, 3, "steps")
    surface = surface_of_triangles(scene)
    # Generated ground, undersides and edges of racks have index -1: the last.
    hours = np.append(energy.full_load_hours, np.nan)[scene.triangle_surface]
    low, high = choose_range(energy.full_load_hours, scene.surfaces.area)
    names, node = group_triangles(scene)
    order = np.argsort(node, kind="stable")
    # From x east, y north, z up to x east, y up, z south.
    corners = np.asarray(scene.vertices, float)[scene.triangles[order]][:, :, [0, 2, 1]] * [1.0, 1.0, -1.0]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    colours = colour_triangles(hours[order], surface[order] < 0, low, high)
    parts = (
        corners.reshape(-1, 3).astype("<f4"),
        np.repeat(normal, 3, axis=0).astype("<f4"),
        np.repeat(np.round(colours * 65535), 3, axis=0).astype("<u2"),
    )
    progress(STAGE, 1, 3, "steps")
    document = describe_scene(parts, np.bincount(node, minlength=len(names)), names)
    document["asset"]["extras"] = {
        "shows": "full load hours",
        "unit": "h per year",
        "weather": label,
        "colour_map": COLOUR_MAP,
        "low": low,
        "high": high,
        "origin": [float(value) for value in scene.site.origin],
        "north": "true north is -z",
        **{name: getattr(scene.site, name) for name in ("crs", "convergence", "latitude", "longitude")},
    }
    progress(STAGE, 2, 3, "steps")
    text = json.dumps(document, ensure_ascii=False, separators=(",", ":")).encode("utf-8")
    text += b" " * (-len(text) % 4)
    numbers = b"".join(part.tobytes() for part in parts)
    numbers += b"\0" * (-len(numbers) % 4)
    with path.open("wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(numbers)))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text)
        file.write(struct.pack("<I4s", len(numbers), b"BIN\0") + numbers)
    progress(STAGE, 3, 3, "steps")


def group_triangles(scene):
    """Names of the nodes, and the node of each triangle (t,)."""
    surface = surface_of_triangles(scene)
    names, building = np.unique(np.array(scene.surfaces.building_id, dtype=object).astype(str), return_inverse=True)
    if len(names) > MOST_NODES:
        names, building = ["buildings"], np.zeros(len(building), np.int64)
    node = np.append(building.reshape(-1), len(names))[surface]
    used, node = np.unique(node, return_inverse=True)
    names = [*map(str, names), "ground"]
    return [names[k] for k in used], node.reshape(-1)


def colour_triangles(hours, ground, low, high):
    """Colours in linear light, (t, 4) in 0–1."""
    colours = np.ones((len(hours), 4))
    colours[:, :3] = linear_light(srgb_colour(MISSING))
    known = np.isfinite(hours)
    stops = np.array([srgb_colour(text) for text in MAPS[COLOUR_MAP].split()])
    colours[known, :3] = mix_stops(stops, np.clip((hours[known] - low) / (high - low), 0, 1))
    colours[ground, :3] = linear_light(srgb_colour(GROUND))
    return colours


def describe_scene(parts, triangles, names):
    """The JSON chunk: a mesh for each node, with some `triangles` one after the other in the arrays of `LAYOUT`."""
    first = np.concatenate([[0], np.cumsum(3 * triangles)])
    views, accessors, offset = [], [], 0
    for part, (_, _, _, size) in zip(parts, LAYOUT, strict=True):
        view = {"buffer": 0, "byteOffset": offset, "byteLength": part.nbytes, "byteStride": size}
        views.append(view | {"target": ARRAY_BUFFER})
        offset += part.nbytes
    meshes = []
    for k, name in enumerate(names):
        attributes = {}
        for view, (attribute, kind, shape, size) in enumerate(LAYOUT):
            attributes[attribute] = len(accessors)
            accessors.append(
                {
                    "bufferView": view,
                    "byteOffset": int(first[k]) * size,
                    "componentType": kind,
                    "count": int(first[k + 1] - first[k]),
                    "type": shape,
                }
            )
            if attribute == "POSITION":
                points = parts[0][first[k] : first[k + 1]]
                accessors[-1] |= {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
            if kind == UNSIGNED_SHORT:
                accessors[-1]["normalized"] = True
        meshes.append({"name": name, "primitives": [{"attributes": attributes, "material": 0, "mode": TRIANGLES}]})
    return {
        "asset": {"version": "2.0", "generator": "CityPV"},
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{"nodes": list(range(len(names)))}],
        "nodes": [{"name": name, "mesh": k} for k, name in enumerate(names)],
        "meshes": meshes,
        "materials": [
            {
                "name": "full load hours",
                "doubleSided": True,
                "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0},
                "extensions": {"KHR_materials_unlit": {}},
            }
        ],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": offset}],
    }
