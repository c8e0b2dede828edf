"""Trace a city of an opened file again, from the files or meshes that it was made of."""

import os
from pathlib import Path

import bpy

from .in_place import is_in_place, list_taken
from .keep_report import FILES
from .session import find_city


class Retrace(bpy.types.Operator):
    """Import the files of this city again and run all steps; a city of meshes is taken from them again"""

    bl_idname = "citypv.retrace"
    bl_label = "Import and trace again"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """There is a city whose origin is known."""
        cls.poll_message_set("Import a city first")
        city, _ = find_city(context.scene)
        return city is not None and bool(city.get(FILES))

    def execute(self, context):
        """Run the steps."""
        city, _ = find_city(context.scene)
        way = "EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT"
        if is_in_place(city):
            for item in context.selected_objects:
                item.select_set(False)
            for _, item, _ in list_taken(city):
                item.hide_set(False)
                item.select_set(True)
            context.scene.citypv.collection = None
            return bpy.ops.citypv.take_meshes(way)
        paths = [Path(path) for path in city[FILES]]
        folder = os.path.commonpath([path.parent for path in paths])
        files = [{"name": str(path.relative_to(folder))} for path in paths]
        return bpy.ops.citypv.solar_city(way, files=files, directory=folder)
