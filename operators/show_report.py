"""Export the report as text: all of it, or the ids of a group."""

import bpy

from ..core.settings.errors import InputError
from .keep_report import find_row, write_out
from .select_group import OfCity
from .session import find_city

TEXT = "CityPV report"


class ShowReport(OfCity, bpy.types.Operator):
    """Write the complete report with hours, weather, albedos and all ids to the text "CityPV report", and open it"""

    bl_idname = "citypv.show_report"
    bl_label = "Report as text"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """Write the text and show it."""
        text = bpy.data.texts.get(TEXT) or bpy.data.texts.new(TEXT)
        text.from_string(write_out(find_city(context.scene)[0]))
        editors = find_editors(context) or open_editor(context)
        for editor in editors:
            editor.text, editor.top = text, 0
        where = "shown in the text editor" if editors else "open it in a text editor"
        self.report({"INFO"}, f'{len(text.lines)} lines in the text "{TEXT}": {where}')
        return {"FINISHED"}


def find_editors(context):
    """Text editors that are open: list of bpy.types.SpaceTextEditor."""
    areas = [area for window in context.window_manager.windows for area in window.screen.areas]
    return [area.spaces.active for area in areas if area.type == "TEXT_EDITOR"]


def open_editor(context):
    """Open a text editor in a window of its own; none where Blender runs without windows: list of SpaceTextEditor."""
    if bpy.app.background:
        return []
    windows = list(context.window_manager.windows)
    bpy.ops.wm.window_new()
    opened = [window for window in context.window_manager.windows if window not in windows]
    for window in opened:
        max(window.screen.areas, key=lambda area: area.width * area.height).type = "TEXT_EDITOR"
    return find_editors(context)


class CopyGroup(OfCity, bpy.types.Operator):
    """Copy the ids of a group of the report to the clipboard"""

    bl_idname = "citypv.copy_group"
    bl_label = "Copy ids"

    group: bpy.props.StringProperty(name="Group", description="Heading/name as in the report")

    def execute(self, context):
        """Copy, one id per line."""
        try:
            row = find_row(find_city(context.scene)[0], self.group)
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        context.window_manager.clipboard = row["ids"]
        self.report({"INFO"}, f"{row['count']} ids copied: {row['name']}")
        return {"FINISHED"}
