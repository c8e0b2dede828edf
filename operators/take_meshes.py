"""Take meshes: convert objects of the Blender scene into a City, and show its mesh."""

import bpy

from .import_city import show_import, triangulate_import
from .read_mesh import find_items, join_meshes, read_meshes
from .read_settings import read_settings
from .run_step import Step
from .select_faces import leave_edit_mode


class TakeMeshes(Step, bpy.types.Operator):
    """Use the meshes of the chosen collection, else the selected ones, as buildings"""

    bl_idname = "citypv.take_meshes"
    bl_label = "Take meshes"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """There are objects to use."""
        cls.poll_message_set("Select meshes, or choose a collection")
        return bool(find_items(context)[1])

    def prepare(self, context):
        """Read the meshes in Blender's thread."""
        leave_edit_mode(context)
        return read_meshes(*find_items(context), context), read_settings(context.scene.citypv)

    @staticmethod
    def work(task, progress):
        """Repair them like files."""
        content, request = task
        return triangulate_import(join_meshes(content, request.orient), request, progress)

    def finish(self, context, result):
        """Show the buildings."""
        return show_import(context, *result)
