"""Select faces of an object, and switch Blender's modes."""

import bpy
import numpy as np

from ..core.settings.errors import InputError
from .attributes import PREFIX
from .in_place import FACE, OBJECT, is_in_place, is_seen, list_taken
from .write_attributes import read_face_attribute

HIGHLIGHT = PREFIX + "highlight"  # property of the object: its selected faces are drawn over


def select_faces(context, item, chosen):
    """Select only these faces of an object, and highlight them; in edit mode (Tab) they are the selection.

    Parameters
    ----------
    context : bpy.types.Context
    item : bpy.types.Object
    chosen : (f,) bool

    Raises
    ------
    InputError
        The object is not to be seen.
    """
    leave_edit_mode(context)
    if not is_seen(item):
        raise InputError(item.name, "it is hidden", "unhide it and select again")
    for other in context.selected_objects:
        other.select_set(False)
    select_objects(context, item, chosen)
    _mark(item.data, chosen)
    context.tool_settings.mesh_select_mode = (False, False, True)
    item[HIGHLIGHT] = True


def select_objects(context, item, chosen):
    """Select a city; where it was taken from objects of the user, those with chosen faces, and these faces of them."""
    if not is_in_place(item):
        item.select_set(True)
        context.view_layer.objects.active = item
        return
    number, face = (read_face_attribute(item.data, name)[chosen] for name in (OBJECT, FACE))
    for place, own, building in list_taken(item):
        faces = face[number == place]
        if building and len(faces) and faces.max() < len(own.data.polygons) and own.visible_get():
            _mark(own.data, np.isin(np.arange(len(own.data.polygons)), faces))
            own.select_set(True)
            context.view_layer.objects.active = own


def gather_selection(context, item):
    """Faces of a city that the user has selected, (f,) bool; edit mode is left.

    Of objects that the city was taken from: the faces selected in edit mode; else those that are highlighted; else all
    faces of the selected objects.
    """
    edited = set(context.objects_in_mode) if context.mode == "EDIT_MESH" else set()
    leave_edit_mode(context)
    if not is_in_place(item) or (item.get(HIGHLIGHT) and not edited):
        return read_selection(item.data)
    number, face = (read_face_attribute(item.data, name) for name in (OBJECT, FACE))
    chosen = np.zeros(len(number), bool)
    for place, own, building in list_taken(item):
        if not building or not (own in edited if edited else own.select_get()):
            continue
        rows = np.flatnonzero(number == place)
        chosen[rows] = read_selection(own.data)[face[rows]] if edited else True
    return chosen


def deselect_faces(item):
    """Deselect all faces of an object in object mode, and end their highlight."""
    _mark(item.data, np.zeros(len(item.data.polygons), dtype=bool))
    if HIGHLIGHT in item:
        del item[HIGHLIGHT]


def leave_edit_mode(context):
    """Switch to object mode, in which meshes can be read and written."""
    if context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


def read_selection(mesh):
    """Faces that are selected, in object mode: (f,) bool."""
    chosen = np.empty(len(mesh.polygons), dtype=bool)
    mesh.polygons.foreach_get("select", chosen)
    return chosen


def _mark(mesh, chosen):
    # In face mode Blender derives edge and vertex selection from faces; selected hidden faces are shown again.
    hidden = np.empty(len(mesh.polygons), dtype=bool)
    mesh.polygons.foreach_get("hide", hidden)
    mesh.polygons.foreach_set("hide", hidden & ~chosen)
    mesh.vertices.foreach_set("select", np.zeros(len(mesh.vertices), dtype=bool))
    mesh.edges.foreach_set("select", np.zeros(len(mesh.edges), dtype=bool))
    mesh.polygons.foreach_set("select", np.ascontiguousarray(chosen))
    mesh.update()
