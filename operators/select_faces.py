"""Select faces of an object, and switch Blender's modes."""

import bpy
import numpy as np

from ..core.errors import InputError
from .attributes import PREFIX

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
    if not item.visible_get(view_layer=context.view_layer):
        raise InputError(item.name, "it is hidden", "unhide it and select again")
    for other in context.selected_objects:
        other.select_set(False)
    item.select_set(True)
    context.view_layer.objects.active = item
    _mark(item.data, chosen)
    context.tool_settings.mesh_select_mode = (False, False, True)
    item[HIGHLIGHT] = True


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
