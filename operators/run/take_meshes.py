"""Take meshes: convert objects of the Blender scene into a City, and show its mesh."""

from collections import Counter

import bpy
import numpy as np

from ...core.city.city import FileContent, Polygon, Tree
from ...core.settings.errors import InputError
from ..city.attributes import read_array, read_corners
from ..city.keys import Key
from ..city.read_materials import name_face_materials
from ..city.read_settings import read_settings
from ..city.run_step import Step, leave_edit_mode
from ..city.source_objects import is_single
from ..show.colour_user_meshes import own_modifiers
from .ask_place import ask_place
from .import_city import show_import, triangulate_import
from .members import find_objects
from .worn_faces import name_faces

LARGEST_COORDINATE = 1e8  # [m] larger than any coordinate on Earth
OTHER_SHAPES = ("CURVE", "SURFACE", "META", "FONT", "CURVES", "POINTCLOUD", "VOLUME")


class TakeMeshes(Step, bpy.types.Operator):
    """Use the meshes of the chosen collection, else the selected ones, as buildings"""

    bl_idname, bl_label = "citypv.take_meshes", "Take meshes"

    @classmethod
    def poll(cls, context):
        """There are objects to use."""
        cls.poll_message_set("Select meshes, or choose a collection")
        return bool(_find_items(context)[1])

    def invoke(self, context, event):
        """Start in the background; meshes have no place, so it is asked for."""
        if Step.current is None and ask_place(context, "take_meshes"):
            return {"CANCELLED"}
        return super().invoke(context, event)

    def prepare(self, context):
        """Read the meshes in Blender's thread."""
        leave_edit_mode(context)
        return *read_meshes(*_find_items(context), context), read_settings(context.scene.citypv)

    @staticmethod
    def work(task, progress):
        """Repair them like files."""
        from ...core.city.join_contents import join_contents

        content, taken, request = task
        return *triangulate_import(
            join_contents([content], orient=request.orient), request, progress
        ), taken

    def finish(self, context, result):
        """Show the city; the objects stay as they are."""
        *imported, taken = result
        there = find_objects(uid for uid, _ in taken)
        if len(there) < len(taken):
            raise InputError(
                "Objects", "some were deleted while they were read", "take the meshes again"
            )
        return show_import(context, *imported, [(there[uid], building) for uid, building in taken])


def _find_items(context):
    """Candidate objects: all of the chosen collection and its children, else the selected ones.

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
    return name, [item for item in items if not item.get(Key.PART)]


def read_meshes(name, items, context, *, named=None, frame=None):
    """Read objects as buildings: a mesh (after its modifiers) is a building, a face of it a
    surface.

    Instances that an object makes (of a collection, by geometry nodes) are buildings as well. World
    axes are taken as x east, y north, z up; the place on Earth has to be given by hand.

    Parameters
    ----------
    name : str
        What the objects are called together.
    items : list of bpy.types.Object
    context : bpy.types.Context
        For modifiers and instances.
    named : dict, optional
        Names of the objects' buildings, where they are not called as the objects.
    frame : (4, 4) float, optional
        Turns world coordinates into metres; by default by the scene's unit.

    Returns
    -------
    content : FileContent
    taken : list of (int, str)
        `session_uid` of what was read, with the name of its building, "" where the faces are not
        its mesh's own.

    Raises
    ------
    InputError
        There is no face.
    """
    # World coordinates become metres.
    if frame is None:
        frame = np.diag([*3 * [context.scene.unit_settings.scale_length], 1.0])
    content, chosen, met, drawn = FileContent(name), set(items), set(), set()
    names, own = Counter(), {}
    # Everything that Blender would show of the objects, with its modifiers applied and instances
    # spread.
    for instance in context.evaluated_depsgraph_get().object_instances if items else ():
        item = instance.object.original
        owner = instance.parent.original if instance.is_instance else item
        # Other objects, letters and curves are left out.
        if owner not in chosen or instance.object.type != "MESH" or _is_outline(item):
            continue
        met.add(owner)
        if not len(instance.object.data.polygons):
            continue
        drawn.add(owner)
        matrix = frame @ np.array(instance.matrix_world)
        # A tree becomes a crown; all else is a building, with a name of its own for each instance.
        if _is_tree(item) or _is_tree(owner):
            _add_tree(content, item.name, instance.object, matrix)
            continue
        called = (named or {}).get(owner, owner.name)
        building = f"{called}/{item.name}" if instance.is_instance else called
        names[building] += 1
        if names[building] > 1:
            building += f"~{names[building]}"
        # Its faces are its mesh's where the mesh has no other user, and no modifier adds or removes
        # faces.
        meshes = item.data, instance.object.data
        same = (
            not instance.is_instance
            and is_single(item.data)
            and np.array_equal(*map(read_corners, meshes))
        )
        same = same and len(meshes[0].polygons) == len(meshes[1].polygons)
        own[owner] = building if same and owner not in own else ""
        ids = name_faces(owner, building) if own[owner] else None
        _add_building(content, building, instance.object, matrix, ids)
    # What has no faces to show is told.
    for item in sorted(chosen - drawn, key=lambda item: item.name):
        if item.type == "MESH":
            content.skip(
                "mesh without faces" if item in met else "hidden in the viewport", item.name
            )
        elif item.type in OTHER_SHAPES:
            content.skip("no mesh: convert it to one", item.name)
    if not content.polygons:
        raise InputError(
            name, "they have no faces", "select meshes with faces, or a collection of such meshes"
        )
    return content, [
        (item.session_uid, own[item]) for item in sorted(own, key=lambda item: item.name)
    ]


def _is_outline(item):
    """Whether the mesh that Blender makes of an object is no building but letters or a curve."""
    return item.type in OTHER_SHAPES and all(
        modifier.type != "NODES" for modifier in item.modifiers
    )


def _is_tree(item):
    """Whether an object is marked as a tree: by a custom property `tree`, or a collection called
    Trees or Vegetation.

    The property counts on the object itself, its mesh, or a collection that it is in.
    """
    for holder in (item, item.data, *item.users_collection):
        if holder is not None and holder.get("tree") is not None:
            return bool(holder["tree"])
    return any(
        group.name.partition(".")[0].lower() in ("tree", "trees", "vegetation")
        for group in item.users_collection
    )


def _add_tree(content, name, item, matrix):
    tree = Tree(name, content.path, 0, evergreen=bool(item.original.get("evergreen", False)))
    rings = _read_rings(item.data, matrix)
    if not (np.abs(np.concatenate(rings)) <= LARGEST_COORDINATE).all():  # also true for NaN
        content.skip("tree with coordinates that are not finite or beyond the Earth", name)
        return
    tree.polygons += [Polygon("", 0, 0, "", ("",), "surface", [ring]) for ring in rings]
    content.trees.append(tree)


def _add_building(content, building, item, matrix, ids):
    content.buildings.append(building)
    # The colours that it may show hide the user's materials, which its own mesh has.
    own = item.original
    worn = own if len(own_modifiers(own)) < len(own.modifiers) else item
    rings, materials = _read_rings(item.data, matrix), name_face_materials(worn, worn.data)
    for face, (ring, material) in enumerate(zip(rings, materials, strict=True)):
        # Repeat the first point: an open ring would count as repaired.
        rings = [np.concatenate([ring, ring[:1]])]
        if not (np.abs(ring) <= LARGEST_COORDINATE).all():  # also true for NaN
            content.skip(
                "coordinates that are not finite or beyond the Earth", f"{building}/{face}"
            )
            continue
        name, number = ids[face] if ids else f"{building}/{face}", len(content.buildings) - 1
        content.polygons.append(
            Polygon(name, number, 0, "", ("",), "surface", rings, face, material=material)
        )


def _read_rings(mesh, matrix):
    """Corners of each face by a matrix, (4, 4): list of (k, 3) float64 [m]; mirrored objects keep
    their outside.
    """
    points, start = (
        read_array(mesh.vertices, "co", 3),
        read_array(mesh.polygons, "loop_start", dtype=np.int32),
    )
    with np.errstate(invalid="ignore", over="ignore"):  # of points that are left out later
        places = points.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    rings = np.split(places[read_corners(mesh)], start[1:])
    return [ring[::-1] for ring in rings] if np.linalg.det(matrix[:3, :3]) < 0 else rings
