"""Select faces by groups of the report, or by whole buildings."""

import bpy
import numpy as np

from ..core.settings.errors import InputError
from .keep_report import BUILDINGS, NAMES_SHOWN, describe_row, find_faces, find_row, read_rows
from .run_step import redraw_panels
from .select_faces import deselect_faces, gather_selection, leave_edit_mode, select_faces
from .session import find_city
from .write_attributes import read_face_attribute


def _suggest(self, context, text):
    return [row["key"] for row in read_rows(find_city(context.scene)[0]) if text.lower() in row["key"].lower()]


class OfCity:
    """Base of operators that only need a city."""

    @classmethod
    def poll(cls, context):
        """There is a city."""
        cls.poll_message_set("Import a city first")
        return find_city(context.scene)[0] is not None


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
