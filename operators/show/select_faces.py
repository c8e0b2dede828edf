"""Select faces of a city: by groups of the report, by buildings; they are drawn over the city in
object mode.
"""

import bpy
import numpy as np

from ...core.settings.errors import InputError, count_of, list_some
from ..city import source_objects
from ..city.attributes import read_array, read_face_attribute
from ..city.keys import Key
from ..city.run_step import Action, OfCity, leave_edit_mode
from ..city.session import find_city
from . import colour_user_meshes
from .keep_report import describe_row, find_faces, read_rows


def select_faces(context, item, chosen):
    """Select only these faces of an object, and highlight them; in edit mode (Tab) they are the
    selection.

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
    if not source_objects.is_seen(item):
        raise InputError(item.name, "it is hidden", "unhide it and select again")
    for other in context.selected_objects:
        other.select_set(False)
    # Where it was taken from objects of the user: those with chosen faces are selected, and these
    # faces of them.
    parts = [(item, chosen)]
    if source_objects.is_in_place(item):
        parts = [
            (own, np.isin(np.arange(len(own.data.polygons)), faces[chosen[rows]]))
            for own, building, rows, faces in colour_user_meshes.list_worn(item)
            if building
        ]
    for own, faces in parts:
        if faces.any() and (own == item or own.visible_get()):
            _mark_faces(own.data, faces)
            own.select_set(True)
            context.view_layer.objects.active = own
    _mark_faces(item.data, chosen)
    context.tool_settings.mesh_select_mode = (False, False, True)
    item[Key.HIGHLIGHT] = True


def gather_selection(context, item):
    """Faces of a city that the user has selected, (f,) bool; edit mode is left.

    Of objects that the city was taken from: the faces selected in edit mode; else those that are
    highlighted; else all faces of the selected objects.
    """
    edited = set(context.objects_in_mode) if context.mode == "EDIT_MESH" else set()
    leave_edit_mode(context)
    if not source_objects.is_in_place(item) or (item.get(Key.HIGHLIGHT) and not edited):
        return read_selection(item.data)
    chosen = np.zeros(len(item.data.polygons), bool)
    for own, building, rows, faces in colour_user_meshes.list_worn(item):
        if building and (own in edited if edited else own.select_get()):
            chosen[rows] = read_selection(own.data)[faces] if edited else True
    return chosen


def read_selection(mesh):
    """Faces that are selected, in object mode: (f,) bool."""
    return read_array(mesh.polygons, "select", dtype=bool)


def _mark_faces(mesh, chosen):
    """Select these faces only of a mesh, in object mode."""
    # In face mode Blender derives edge and vertex selection from faces; selected hidden faces are
    # shown again.
    mesh.polygons.foreach_set("hide", read_array(mesh.polygons, "hide", dtype=bool) & ~chosen)
    mesh.vertices.foreach_set("select", np.zeros(len(mesh.vertices), dtype=bool))
    mesh.edges.foreach_set("select", np.zeros(len(mesh.edges), dtype=bool))
    mesh.polygons.foreach_set("select", np.ascontiguousarray(chosen))
    mesh.update()


class SelectGroup(OfCity, Action, bpy.types.Operator):
    """Select and highlight the faces of a group of the report"""

    bl_idname, bl_label = "citypv.select_group", "Select group"

    group: bpy.props.StringProperty(
        name="Group",
        description="Heading/name as in the report, such as kind/roof; or building/ID",
        search=lambda self, context, text: [
            row["key"]
            for row in read_rows(find_city(context.scene)[0] or {})
            if text.lower() in row["key"].lower()
        ],
    )

    @classmethod
    def description(cls, context, properties):
        """Tooltip: full reason, count and first ids."""
        for row in read_rows(find_city(context.scene)[0] or {}):
            if row["key"] == properties.group:
                return (
                    f"Select and highlight: {row['name']} ({describe_row(row)}). Tab edits, "
                    "Deselect clears"
                )
        return cls.__doc__

    def act(self, context, city, ground):
        """Select, and report the number of surfaces."""
        leave_edit_mode(context)
        chosen = find_faces(city, self.group)
        select_faces(context, city, chosen)
        count = len(np.unique(read_face_attribute(city.data, "surface")[chosen]))
        return f"{count_of(count, 'surface')} selected: {self.group.partition('/')[2]}"


class DeselectFaces(OfCity, Action, bpy.types.Operator):
    """Deselect all faces of the city, and end the highlight"""

    bl_idname, bl_label = "citypv.deselect", "Deselect"

    def act(self, context, city, ground):
        """Deselect."""
        leave_edit_mode(context)
        _mark_faces(city.data, np.zeros(len(city.data.polygons), dtype=bool))
        city.pop(Key.HIGHLIGHT, None)


class SelectBuildings(OfCity, Action, bpy.types.Operator):
    """Extend the face selection to whole buildings, and report which they are"""

    bl_idname, bl_label = "citypv.select_buildings", "Whole buildings"

    def act(self, context, city, ground):
        """Select, and name the buildings."""
        selected = gather_selection(context, city)
        building = read_face_attribute(city.data, "building")
        wanted = np.unique(building[selected]) if building is not None else ()
        if not len(wanted):
            raise InputError(city.name, "no faces are selected", "select faces in edit mode")
        select_faces(context, city, np.isin(building, wanted))
        names = list_some([city[Key.BUILDINGS][k] for k in wanted.tolist()])
        return f"{count_of(len(wanted), 'building')}: {names}"
