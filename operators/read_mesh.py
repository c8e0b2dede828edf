"""Read evaluated Blender meshes into a FileContent, as file readers do."""

from collections import Counter

import numpy as np

from ..core.city.polygon import FileContent, Polygon
from ..core.city.tree import Tree
from ..core.settings.errors import InputError
from .attributes import PREFIX
from .in_place import has_own_faces
from .read_materials import name_face_materials

LARGEST_COORDINATE = 1e8  # [m] larger than any coordinate on Earth
TREE_COLLECTIONS = ("tree", "trees", "vegetation")
OTHER_SHAPES = ("CURVE", "SURFACE", "META", "FONT", "CURVES", "POINTCLOUD", "VOLUME")


def find_items(context):
    """Candidate objects: those of the chosen collection and its children, else the selected ones.

    Returns
    -------
    name : str
        What they are called together.
    items : list of bpy.types.Object
        Without those that CityPV made.
    """
    chosen = context.scene.citypv.collection
    items = context.selected_objects if chosen is None else chosen.all_objects
    name = "Selected objects" if chosen is None else f"Collection {chosen.name}"
    return name, [item for item in items if not item.get(PREFIX + "part")]


def read_meshes(name, items, context, taken=None):
    """Read objects as buildings: a mesh (after its modifiers) is a building, a face of it a surface.

    Instances that an object makes (of a collection, by geometry nodes) are buildings as well. World axes are taken as
    x east, y north, z up, in the scene's unit; the place on Earth has to be given by hand.

    Parameters
    ----------
    name : str
        What the objects are called together.
    items : list of bpy.types.Object
    context : bpy.types.Context
        For modifiers, instances and the scene's unit.
    taken : list, optional
        It gets what was read: (object, name of its building), the name "" where the faces are not those of its mesh.

    Returns
    -------
    FileContent

    Raises
    ------
    InputError
        There is no face.
    """
    metres, chosen, met, drawn = context.scene.unit_settings.scale_length, set(items), set(), set()
    content, names, own = FileContent(name), Counter(), {}
    for instance in context.evaluated_depsgraph_get().object_instances:
        item = instance.object.original
        owner = instance.parent.original if instance.is_instance else item
        if owner not in chosen or instance.object.type != "MESH":
            continue
        met.add(owner)
        if not len(instance.object.data.polygons):
            continue
        drawn.add(owner)
        if is_tree(item) or is_tree(owner):
            _add_tree(content, item.name, instance.object, np.array(instance.matrix_world), metres)
            continue
        building = f"{owner.name}/{item.name}" if instance.is_instance else item.name
        names[building] += 1
        if names[building] > 1:
            building += f"~{names[building]}"
        _add_building(content, building, instance.object, np.array(instance.matrix_world), metres)
        single = not instance.is_instance and has_own_faces(item, instance.object.data)
        own[owner] = building if single and owner not in own else ""
    _tell_left_out(content, chosen - drawn, met)
    if taken is not None:
        taken += sorted(own.items(), key=lambda pair: pair[0].name)
    if not content.polygons:
        raise InputError(name, "they have no faces", "select meshes with faces, or a collection of such meshes")
    return content


def is_tree(item):
    """Whether an object is marked as a tree: by a custom property `tree`, or a collection called Trees or Vegetation.

    The property counts on the object itself, its mesh, or a collection that it is in.
    """
    holders = [item, item.data, *item.users_collection]
    marks = [holder.get("tree") for holder in holders if holder is not None]
    known = [mark for mark in marks if mark is not None]
    if known:
        return bool(known[0])
    return any(group.name.partition(".")[0].lower() in TREE_COLLECTIONS for group in item.users_collection)


def _add_tree(content, name, item, matrix, metres):
    tree = Tree(name, content.path, 0, evergreen=bool(item.original.get("evergreen", False)))
    for ring in _read_rings(item.data, matrix, metres):
        if not (np.abs(ring) <= LARGEST_COORDINATE).all():  # also true for NaN
            content.skip("tree with coordinates that are not finite or beyond the Earth", name)
            return
        tree.polygons.append(Polygon("", 0, 0, "", "", "surface", [ring]))
    content.trees.append(tree)


def join_meshes(content, orient="auto"):
    """City from meshes, with the same repairs as for files."""
    from ..core.city.join_contents import join_contents

    return join_contents([content], orient=orient)


def _add_building(content, building, item, matrix, metres):
    content.buildings.append(building)
    rings, materials = _read_rings(item.data, matrix, metres), name_face_materials(item, item.data)
    for face, (ring, material) in enumerate(zip(rings, materials, strict=True)):
        # Repeat the first point: an open ring would count as repaired.
        rings = [np.concatenate([ring, ring[:1]])]
        if not (np.abs(ring) <= LARGEST_COORDINATE).all():  # also true for NaN
            content.skip("coordinates that are not finite or beyond the Earth", f"{building}/{face}")
            continue
        number = len(content.buildings) - 1
        content.polygons.append(
            Polygon(f"{building}/{face}", number, 0, "", "", "surface", rings, face, material=material)
        )


def _read_rings(mesh, matrix, metres):
    """Corners of each face in world coordinates: list of (k, 3) float64 [m]; mirrored objects keep their outside."""
    points = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    corners = np.empty(len(mesh.loops), dtype=np.int32)
    start = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.vertices.foreach_get("co", points)
    mesh.loops.foreach_get("vertex_index", corners)
    mesh.polygons.foreach_get("loop_start", start)
    with np.errstate(invalid="ignore", over="ignore"):  # of points that are left out later
        places = metres * (points.reshape(-1, 3).astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3])
    rings = np.split(places[corners], start[1:])
    return [ring[::-1] for ring in rings] if np.linalg.det(matrix[:3, :3]) < 0 else rings


def _tell_left_out(content, items, met):
    for item in sorted(items, key=lambda item: item.name):
        if item.type == "MESH":
            content.skip("mesh without faces" if item in met else "hidden in the viewport", item.name)
        elif item.type in OTHER_SHAPES:
            content.skip("no mesh: convert it to one", item.name)
