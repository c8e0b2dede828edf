"""Classify: build the Scene of a City on its ground, with kind and orientation on every face."""

import bpy

from .build_meshes import build_meshes, remove_city, show_objects
from .colour_faces import colour_faces, show_exact_colours
from .keep_report import keep_report
from .read_materials import remember_materials
from .read_mesh import find_items, join_meshes, read_meshes
from .read_settings import read_settings
from .run_step import Step
from .select_faces import leave_edit_mode
from .session import Session, find_city, find_session, open_session
from .show_city import show_city
from .write_attributes import write_classes


class ClassifyCity(Step, bpy.types.Operator):
    """Classify surfaces as facades, roofs and others by tilt and orientation, and put the city on its ground.

    Without an imported city, meshes are used: those of the chosen collection, else the selected ones"""

    bl_idname = "citypv.classify"
    bl_label = "Classify surfaces"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """There is a city in this session, or meshes to build one from."""
        cls.poll_message_set("Import a city first (one from an opened file must be imported again), or select meshes")
        return find_session(find_city(context.scene)[0]) is not None or _has_mesh(context)

    def prepare(self, context):
        """Take the imported city, or meshes."""
        session = find_session(find_city(context.scene)[0])
        leave_edit_mode(context)
        if session is not None:
            remember_materials(*find_city(context.scene), session)
            return session.city, None, read_settings(context.scene.citypv)
        return None, read_meshes(*find_items(context), context), read_settings(context.scene.citypv)

    @staticmethod
    def work(task, progress):
        """Put the city on its ground (local axes, triangles, kinds), and find covered surfaces."""
        from ..core.results.list_findings import list_findings
        from ..core.study import stand_city

        city, meshes, request = task
        city = city or join_meshes(meshes)
        progress("classifying", 0, len(city), "polygons")
        scene = stand_city(city, request)
        progress("finding interior surfaces", 0, len(city), "polygons")
        return city, scene, list_findings(scene)

    def finish(self, context, result):
        """Show the scene in place of the imported mesh, coloured by kind."""
        city, scene, findings = result
        old = find_city(context.scene)
        before = find_session(old[0])
        remove_city(*old)
        item, ground = build_meshes(scene)
        write_classes(item, ground, scene.surfaces)
        show_objects(context.scene, item, ground)
        given = before.ground_material if before is not None else ""
        open_session(item, Session(city=city, scene=scene, ground_material=given))
        keep_report(item, scene, findings)
        colour_faces(item, ground, "kind")
        show_exact_colours(context.scene)
        show_city(None if old[0] is not None else scene.vertices)
        eligible = scene.surfaces.eligible.sum()
        return f"{len(scene.surfaces)} surfaces, {eligible} of them eligible for photovoltaics"


def _has_mesh(context):
    return any(item.type == "MESH" for item in find_items(context)[1])
