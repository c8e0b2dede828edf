"""Select faces of an object, and switch Blender's modes."""

import bpy
import numpy as np

from ...core.errors import InputError
from ..attributes import PREFIX, read_face_attribute
from ..in_place import FACE, OBJECT, is_in_place, is_seen, list_taken
from ..run_step import OfCity, leave_edit_mode, redraw_panels
from ..session import find_city
from .keep_report import BUILDINGS, NAMES_SHOWN, describe_row, find_faces, find_row, read_rows

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


def _suggest(self, context, text):
    return [row["key"] for row in read_rows(find_city(context.scene)[0]) if text.lower() in row["key"].lower()]


class SelectGroup(OfCity, bpy.types.Operator):
    """Select and highlight the faces of a group of the report"""

    bl_idname = "citypv.select_group"
    bl_label = "Select group"
    bl_options = {"REGISTER", "UNDO"}

    group: bpy.props.StringProperty(
        name="Group", description="Heading/name as in the report, such as kind/roof; or building/ID", search=_suggest
    )

    @classmethod
    def description(cls, context, properties):
        """Tooltip: full reason, count and first ids."""
        try:
            row = find_row(find_city(context.scene)[0], properties.group)
        except (InputError, AttributeError):
            return cls.__doc__
        return f"Select and highlight: {row['name']} ({describe_row(row)}). Tab edits, Deselect clears"

    def execute(self, context):
        """Select, and report the number of surfaces."""
        city, _ = find_city(context.scene)
        leave_edit_mode(context)
        try:
            chosen = find_faces(city, self.group)
            select_faces(context, city, chosen)
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        count = len(np.unique(read_face_attribute(city.data, "surface")[chosen]))
        redraw_panels(context, views=True)
        self.report({"INFO"}, f"{count} surfaces selected: {self.group.partition('/')[2]}")
        return {"FINISHED"}


class DeselectFaces(OfCity, bpy.types.Operator):
    """Deselect all faces of the city, and end the highlight"""

    bl_idname = "citypv.deselect"
    bl_label = "Deselect"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """Deselect."""
        city, _ = find_city(context.scene)
        leave_edit_mode(context)
        deselect_faces(city)
        redraw_panels(context, views=True)
        return {"FINISHED"}


class SelectBuildings(OfCity, bpy.types.Operator):
    """Extend the face selection to whole buildings, and report which they are"""

    bl_idname = "citypv.select_buildings"
    bl_label = "Whole buildings"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """Select, and name the buildings."""
        city, _ = find_city(context.scene)
        selected = gather_selection(context, city)
        building = read_face_attribute(city.data, "building")
        wanted = np.unique(building[selected]) if building is not None else ()
        try:
            if not len(wanted):
                raise InputError(city.name, "no faces are selected", "select faces in edit mode")
            select_faces(context, city, np.isin(building, wanted))
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        redraw_panels(context, views=True)
        names = ", ".join(city[BUILDINGS][k] for k in wanted[:NAMES_SHOWN].tolist())
        self.report({"INFO"}, f"{len(wanted)} buildings: {names}{' …' if len(wanted) > NAMES_SHOWN else ''}")
        return {"FINISHED"}
