"""Take meshes: convert objects of the Blender scene into a City, and show its mesh."""

import bpy

from .import_city import show_import, triangulate_import
from .in_place import mark_taken, write_sources
from .read_mesh import find_items, join_meshes, read_meshes
from .read_settings import read_settings
from .run_step import Step
from .select_faces import leave_edit_mode
from .session import find_city
from .watch_edits import remember_shape


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
        taken = []
        content = read_meshes(*find_items(context), context, taken)
        return content, taken, read_settings(context.scene.citypv)

    @staticmethod
    def work(task, progress):
        """Repair them like files."""
        content, taken, request = task
        return taken, triangulate_import(join_meshes(content, request.orient), request, progress)

    def finish(self, context, result):
        """Remember what was taken; the objects stay as they are."""
        taken, (city, scene, findings) = result
        text = show_import(context, city, scene, findings, taken=[item for item, _ in taken])
        item, _ = find_city(context.scene)
        mark_taken(item, taken, scene.site, context.scene.unit_settings.scale_length)
        write_sources(item, scene.surfaces.surface_id)
        remember_shape(item)
        return text
