"""Classify: build the Scene of a City on its ground, with kind and orientation on every face."""

from functools import partial

import bpy
import numpy as np

from ...core.settings.errors import InputError, count_of
from ...core.settings.progress import report_polygons
from ..city import edit_marks
from ..city.attributes import Faces
from ..city.build_meshes import build_meshes, remove_objects, show_objects
from ..city.job import COMPILING
from ..city.keys import Key
from ..city.panel import StepPanel
from ..city.read_materials import remember_materials
from ..city.read_settings import read_settings, remember_step
from ..city.run_step import OfCity, Step, leave_edit_mode
from ..city.session import Session, find_city
from ..city.source_objects import is_in_place
from ..show.colour_user_meshes import uncolour_user_meshes
from ..show.keep_report import draw_rows, keep_report
from ..show.show_result import show_result
from . import city_design
from .city_design import OF_CITY
from .compile_loops import compile_loops
from .edited_city import read_edited_city
from .members import find_objects, put_in_place
from .worn_faces import remember_wearers, write_sources

CLASSIFYING = "classifying"  # name of the stage


class ClassifyCity(OfCity, Step, bpy.types.Operator):
    """Classify surfaces as facades, roofs and others by shape, and put the city on its ground"""

    bl_idname, bl_label = "citypv.classify", "Classify surfaces"
    needs = "city"
    lacking = "Import a city or take meshes first (a city of an opened file must be imported again)"
    stages = {CLASSIFYING: 2, COMPILING: 1, "finding interior surfaces": 1}

    def prepare(self, context):
        """Take the city as it is seen, and the settings."""
        city, ground = find_city(context.scene)
        if city.get(Key.ADDED):
            edit_marks.check_unedited(city)
        session, request = Session.of(city), read_settings(context.scene.citypv)
        leave_edit_mode(context)
        remember_materials(city, ground, session)
        return (
            session,
            read_edited_city(context, city, session) if city_design.has_edits(city) else None,
            request,
        )

    @staticmethod
    def work(task, progress):
        """Put the city on its ground, once its place on Earth is known: axes, triangles, kinds,
        covered surfaces.
        """
        from ...core.results.list_findings import list_findings
        from ...core.run.study import make_scene

        session, seen, request = task
        if session.city.crs is None and (request.latitude is None or request.longitude is None):
            raise InputError(
                "City",
                "its location on Earth is unknown",
                "enable Own location in step Classify, and give latitude and longitude",
            )
        imported, city = seen.make() if seen else (session.imported, session.city)
        scene = make_scene(
            city, request, partial(report_polygons, progress, CLASSIFYING, len(city))
        )
        compile_loops(progress)
        return (
            session,
            Session(city, imported, scene),
            seen,
            list_findings(scene, progress=progress),
        )

    def finish(self, context, result):
        """Show the scene in place of the imported mesh, coloured by kind."""
        before, session, seen, findings = result
        show_kinds(context, before, session, findings, seen)
        remember_step(session.find_city(context.scene)[0], "classify", context.scene.citypv)
        surfaces = session.scene.surfaces
        return (
            f"{count_of(len(surfaces), 'surface')}, {surfaces.eligible.sum()} of them carry modules"
        )


def show_kinds(context, before, session, findings, seen=None):
    """Show a scene in place of the city that it was made of, coloured by kind.

    Parameters
    ----------
    context : bpy.types.Context
    before : Session
        Of the city that is replaced.
    session : Session
        With the scene; the new city gets it.
    findings : list of core.list_findings.Finding
    seen : Seen, optional
        What the city was read from, if from what is seen.
    """

    # New meshes of the scene stand where the old ones stood, though its origin may have moved.
    scene, (old, old_ground) = session.scene, before.find_city(context.scene)
    item, ground = build_meshes(scene)
    # Whether the old city is still as it was when it was read: then its design is taken anew, else
    # it is the design at the reading, so that the edit since is noted.
    same = seen is not None and city_design.describe_design(old, seen.lineage) == seen.design
    uncolour_user_meshes(old)
    earlier = scene.site if seen is None else seen.site
    shift = earlier.from_files(np.array([scene.site.origin]))[0]  # [m]
    item.location = np.array(old.location) + shift
    # What the old city remembers goes to the new one, and its name too.
    asked = filter(lambda key: key.startswith(Key.ASKED), old.keys())
    for key in (*OF_CITY, *asked):
        if key in old:
            item[key] = old[key].to_dict() if key in (Key.TAKEN, Key.WEARERS) else old[key]
    names = old.name, old_ground.name if old_ground else "Ground"
    remove_objects(old, old_ground)
    for new, name in zip((item, ground), names, strict=True):
        if new is not None:
            new.name = new.data.name = name
    # Classes of its surfaces, and what it was read from.
    Faces(item, ground).write_classes(scene.surfaces)
    show_objects(context.scene, item, ground)
    if seen is not None:
        item[Key.LINEAGE] = seen.lineage
        item[Key.DESIGN] = city_design.describe_design(item) if same else seen.design
        there = find_objects(uid for uid, _ in seen.taken)
        remember_wearers(
            item, [(there[uid], building) for uid, building in seen.taken if uid in there]
        )
    # The user's own objects show it where they did before.
    if is_in_place(item):
        put_in_place(item, scene.site)
    write_sources(item, scene.surfaces.surface_id)
    # The new city gets the design, the session, the report and colours by kind.
    city_design.remember_design(item, item[Key.DESIGN])
    session.ground_material = before.ground_material
    session.open(item)
    keep_report(item, scene, findings)
    show_result(context, item, ground, "kind")


class ClassifyPanel(StepPanel, bpy.types.Panel):
    """Classify."""

    bl_idname, bl_label, bl_order = "CITYPV_PT_classify", "2  Classify", 5

    def draw(self, context):
        """Show the settings of the step."""
        column, settings, city = self.start(context)
        place = ("latitude", "longitude") if settings.own_place else ()
        terrain = ("terrain",) if settings.ground == "terrain" else ()
        cells = ("grid_size",) if settings.split else ()
        names = (
            "own_place",
            *place,
            "ground",
            *terrain,
            *self.list_settings("classify"),
            "split",
            *cells,
        )
        self.draw_settings(column, settings, *names)
        self.draw_step(column, "citypv.classify", "MOD_BUILD")
        draw_rows(self, city, ("kind", "orientation", "eligible"))
