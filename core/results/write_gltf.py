"""Write city.glb: the scene as binary glTF 2.0, coloured by full load hours."""

import numpy as np

from ..city.building_facts import BuildingFacts
from ..settings.progress import silent
from .colour_map import GROUND, MODULES, choose_range, linear_light, srgb_colour
from .glb import (
    ARRAY,
    COLOUR_MAP,
    ELEMENTS,
    FLOAT,
    UINT16,
    UINT32,
    Buffer,
    colour_hours,
    pack_glb,
    plain_material,
    turn_axes,
)


def write_gltf(path, run, progress=silent):
    """Write a scene with its full load hours as colours.

    Axes are glTF's: x east, y up, z south; metres from the scene's origin, which `asset.extras`
    names together with the scale of the colours. Each building is a node of its own (all together
    where there are more than 2,000), with what its file tells and the sums of its modules in
    `extras`, the ground another, and all modules one more. The material is unlit, so that colours
    show as they are; viewers without that extension light a rough surface. Ground and surfaces
    without full load hours are grey.

    Parameters
    ----------
    path : path-like
    run : RunResults
    progress : callable, optional
        See `core.settings.progress`.
    """
    stage = "writing city.glb"
    _, scene, transfer, energy, weather = run
    progress(stage, 0, 2, "steps")
    # Colours are full load hours between the limits of the scale; corners are not shared, so that
    # each face has its own.
    level = choose_range(energy.full_load_hours, scene.surfaces.area)
    names, sums, node = _group_triangles(scene, energy, transfer.facts or BuildingFacts())
    corners = np.asarray(scene.vertices, float)[scene.triangles]  # (t, 3, 3) [m]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    # Generated ground, undersides and edges of racks have index -1: the last.
    hours = np.append(energy.full_load_hours, np.nan)[scene.triangle_surface]
    colours = colour_hours(hours, level, np.isfinite(hours))
    colours[scene.surface_of_triangle < 0] = linear_light(srgb_colour(GROUND))
    looks = np.round(65535 * np.column_stack([colours, np.ones(len(colours))])).astype("<u2")
    # A mesh for each building: places, normals and colours of its triangles, one buffer for all.
    buffer, meshes = Buffer(), []
    members = np.split(np.argsort(node, kind="stable"), np.cumsum(np.bincount(node))[:-1])
    for name, own in zip(names, members, strict=True):
        attributes = {
            "POSITION": buffer.place(corners[own].reshape(-1, 3)),
            "NORMAL": buffer.access(
                turn_axes(normal[own]).repeat(3, axis=0).astype("<f4"), FLOAT, "VEC3", ARRAY
            ),
            "COLOR_0": buffer.access(
                looks[own].repeat(3, axis=0), UINT16, "VEC4", ARRAY, normalized=True
            ),
        }
        meshes.append(
            {
                "name": name,
                "primitives": [{"attributes": attributes, "material": 0, "mode": 4}],
            }
        )
    progress(stage, 1, 2, "steps")
    nodes = [
        {"name": name, "mesh": k, "extras": own}
        for k, (name, own) in enumerate(zip(names, sums, strict=True))
    ]
    # All modules are one mesh more, which a viewer may hide.
    materials = [plain_material((1, 1, 1), name="full load hours")]
    if energy.layout is not None and len(energy.layout):
        attributes = {"POSITION": buffer.place(energy.layout.corners().reshape(-1, 3))}
        corners = energy.layout.triangles().astype("<u4").ravel()
        indices = buffer.access(corners, UINT32, "SCALAR", ELEMENTS)
        shape = {"attributes": attributes, "indices": indices, "material": 1, "mode": 4}
        nodes.append({"name": "modules", "mesh": len(meshes)})
        meshes.append({"name": "modules", "primitives": [shape]})
        materials.append(plain_material(linear_light(srgb_colour(MODULES)), name="modules"))
    # What the colours mean, and where on Earth the model lies.
    extras = {
        "shows": "full load hours",
        "unit": "h per year",
        "weather": weather.label,
        "colour_map": COLOUR_MAP,
        **dict(zip(("low", "high"), level, strict=True)),
        "origin": scene.site.grid.to_files(np.array([scene.site.origin]), "xy")[0].tolist(),
        "north": "true north is -z",
        **{
            name: getattr(scene.site, name)
            for name in ("crs", "convergence", "latitude", "longitude")
        },
    }
    document = {
        "asset": {"extras": extras},
        "extensionsUsed": ["KHR_materials_unlit"],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
    }
    path.write_bytes(pack_glb(document, buffer))
    progress(stage, 2, 2, "steps")


def _group_triangles(scene, energy, facts):
    """Names of the nodes, what is told of each and sums of its modules, and the node of each
    triangle (t,).
    """
    surface = scene.surface_of_triangle
    names, building = np.unique(
        np.array(scene.surfaces.building_id, dtype=object).astype(str), return_inverse=True
    )
    # Viewers become slow with more nodes.
    if len(names) > 2000:
        names, building = ["buildings"], np.zeros(len(building), np.int64)
    node = np.append(building.reshape(-1), len(names))[surface]
    used, node = np.unique(node, return_inverse=True)
    # What the modules of a building are and yield; the ground has none.
    kwp = energy.kwp_of_hours(scene.surfaces.area)
    numbers = {name: getattr(energy, name) for name in ("module_count", "module_area", "kwp")}
    numbers["mwh_per_year"] = np.nan_to_num(kwp * energy.full_load_hours) / 1000
    sums = {
        name: np.bincount(building.reshape(-1), values, len(names)).tolist()
        for name, values in numbers.items()
    }
    words = facts.of(names)
    told = [
        {name: own[k] for name, own in words.items() if own[k]}
        | {name: own[k] for name, own in sums.items()}
        for k in range(len(names))
    ]
    names, told = [*map(str, names), "ground"], [*told, {}]
    return [names[k] for k in used], [told[k] for k in used], node.reshape(-1)
