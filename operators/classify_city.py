"""Classify: a City → its scene on the ground, with kind and orientation on every face."""

import bpy

from .attributes import PREFIX
from .build_meshes import build_meshes, remove_city, show_objects
from .colour_faces import colour_faces, show_exact_colours
from .read_mesh import read_meshes
from .read_settings import read_settings
from .run_step import Step
from .session import Session, find_city, find_session, open_session
from .show_city import show_city
from .summarise import REPORT, summarise_kinds
from .write_attributes import write_classes


class ClassifyCity(Step, bpy.types.Operator):
    """Sort the surfaces into facades, roofs and others by tilt and orientation, and stand the city on its ground.

    Without an imported city, the selected meshes are taken as they stand"""

    bl_idname = "citypv.classify"
    bl_label = "Classify surfaces"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """There is a city of this session, or meshes to make one of."""
        cls.poll_message_set("Import a city first (one from an opened file must be imported again), or select meshes")
        return find_session(find_city(context.scene)[0]) is not None or bool(_own_meshes(context))

    def prepare(self, context):
        """Take the imported city, or the meshes that are selected."""
        session = find_session(find_city(context.scene)[0])
        city = session.city if session is not None else read_meshes(_own_meshes(context), context)
        return city, read_settings(context.scene.citypv)

    @staticmethod
    def work(task, progress):
        """Build the scene: local axes, triangles, kinds, ground."""
        from ..core.geometry.build_scene import build_scene

        city, request = task
        progress("classifying", 0, len(city), "polygons")
        names = ("latitude", "longitude", "ground", "patch_size", "grid_size")
        return city, build_scene(city, **{name: getattr(request, name) for name in names})

    def finish(self, context, result):
        """Show the scene in place of the imported mesh, coloured by kind."""
        city, scene = result
        old = find_city(context.scene)
        report = list(old[0].get(REPORT, [])) if old[0] is not None else []
        remove_city(*old)
        item, ground = build_meshes(scene)
        write_classes(item, ground, scene.surfaces)
        show_objects(context.scene, item, ground)
        open_session(item, Session(city=city, scene=scene))
        item[REPORT] = report
        colour_faces(item, ground, "kind")
        show_exact_colours(context.scene)
        show_city(None if report else scene.vertices)
        return summarise_kinds(item, scene)


def _own_meshes(context):
    return [item for item in context.selected_objects if item.type == "MESH" and not item.get(PREFIX + "part")]
