"""Import: read the buildings of files, typed, chosen in the file browser or dropped on a view, and
show them.
"""

import os
from dataclasses import replace
from functools import partial
from pathlib import Path

import bpy

from ...core.read.formats import READ, SUFFIXES
from ...core.settings.errors import InputError
from ...core.settings.progress import report_polygons
from ..city import source_objects
from ..city.build_meshes import build_meshes, remove_objects, show_objects
from ..city.keys import Key
from ..city.panel import StepPanel
from ..city.preferences import choose_weather
from ..city.read_settings import (
    read_settings,
    remember_step,
)
from ..city.run_step import Step
from ..city.session import Session, list_cities
from ..show.colour_user_meshes import uncolour_user_meshes
from ..show.keep_report import draw_rows, keep_report
from ..show.show_city import show_city
from . import members
from .city_design import begin_design
from .switch_city import show_objects_of
from .worn_faces import remember_wearers, write_sources

IMPORT_LABEL = f"City for CityPV ({', '.join(suffixes[0] for _, suffixes, *_ in READ)})"


class CityFiles:
    """Mixin of operators that import a city; without a file they open the file browser."""

    filepath: bpy.props.StringProperty(
        name="File",
        description="File or folder; empty: as in the panel",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    files: bpy.props.CollectionProperty(
        type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"}
    )
    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})

    whole = False  # whether the file browser goes on to all steps

    def invoke(self, context, event):
        """Start in the background; without a file, open the file browser."""
        if (
            not (self.filepath or self.files or context.scene.citypv.city_path)
            and not bpy.app.background
        ):
            bpy.ops.citypv.choose_city("INVOKE_DEFAULT", whole=self.whole)
            return {"CANCELLED"}
        return super().invoke(context, event)

    def prepare(self, context):
        """Read the paths and options."""
        settings = context.scene.citypv
        choose_weather(settings)
        if self.files and self.directory:
            paths = [str(Path(self.directory, file.name)) for file in self.files if file.name]
        elif self.filepath:
            paths = [bpy.path.abspath(self.filepath)]
        else:
            if not settings.city_path:
                raise InputError(
                    "City", "no file is chosen", "choose a file or folder with buildings"
                )
            paths = [bpy.path.abspath(settings.city_path)]
        settings.city_path = paths[0] if len(paths) == 1 else os.path.commonpath(paths)
        return paths, read_settings(settings)


class ImportCity(CityFiles, Step, bpy.types.Operator):
    """Read the buildings of a file or folder (CityGML, CityJSON, OBJ, GeoJSON, GeoPackage)
    and show them.

    Files that were imported before replace their earlier import; other cities are kept, hidden"""

    bl_idname, bl_label = "citypv.import_city", "Import city"

    stages = {"reading files": 3, "joining polygons": 1, "triangulating": 1}

    @staticmethod
    def work(task, progress):
        """Read the files, and triangulate them for display, without generated ground."""
        from ...core.run.study import read_buildings

        paths, request = task
        return triangulate_import(read_buildings(paths, request, progress), request, progress)

    def finish(self, context, result):
        """Show the buildings."""
        return show_import(context, *result)


class ChooseCity(bpy.types.Operator):
    """Choose building files and import them"""

    bl_idname, bl_label = "citypv.choose_city", "Import city"

    whole: bpy.props.BoolProperty(
        name="Solar city", description="Run all steps, not only the import", options={"SKIP_SAVE"}
    )
    filter_glob: bpy.props.StringProperty(
        default=";".join("*" + suffix for suffix in (*SUFFIXES, ".gz")), options={"HIDDEN"}
    )
    files: bpy.props.CollectionProperty(
        type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"}
    )
    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})

    def invoke(self, context, event):
        """Open the file browser."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        """Import what was chosen."""
        files = [{"name": file.name} for file in self.files]
        run = bpy.ops.citypv.solar_city if self.whole else bpy.ops.citypv.import_city
        run("INVOKE_DEFAULT", files=files, directory=self.directory)
        return {"FINISHED"}


def triangulate_import(city, request, progress):
    """Return a city, its scene with terrain as read but no generated ground, and the findings of
    reading.
    """
    from ...core.city.build_scene import build_scene
    from ...core.city.lay_ground import show_terrain
    from ...core.results.list_findings import list_findings

    place = {"latitude": request.latitude, "longitude": request.longitude}
    report_share = partial(report_polygons, progress, "triangulating", len(city))
    scene = build_scene(
        replace(city, terrain=None),
        **place,
        ground="none",
        patch_size=None,
        report_share=report_share,
    )
    if city.terrain is not None and request.ground == "auto" and request.terrain is None:
        scene = show_terrain(scene, city.terrain)
    # Covered surfaces can only be found once the city is on its ground.
    return city, scene, list_findings(scene, covered_share=[0.0] * len(scene.surfaces))


def show_import(context, city, scene, findings, taken=()):
    """Show a city; the same files' earlier one is replaced, others are hidden. Return the message
    for the user.

    Parameters
    ----------
    context : bpy.types.Context
    city : core.city.city.City
    scene : core.city.scene.Scene
    findings : list of core.list_findings.Finding
    taken : list of (bpy.types.Object, str), optional
        The user's objects that are the city, with the names of their buildings: then the same
        objects count, whatever the files are called, and the view stays where it is.
    """
    # An earlier import of this city goes; others are hidden.
    files, own_objects = [str(path) for path in scene.report.files], {part for part, _ in taken}
    earlier = None
    for item in list_cities(context.scene):
        own = (
            {part for _, part, _ in source_objects.list_taken(item)}
            if source_objects.is_in_place(item)
            else set()
        )
        if own == own_objects and (taken or list(item.get(Key.FILES, ())) == files):
            uncolour_user_meshes(item)
            earlier = item.get(Key.IDENTITY)
            remove_objects(item, item.get(Key.GROUND))
    kept = list_cities(context.scene)
    for item in kept:
        show_objects_of(item, visible=False)
    # Meshes of the scene, with the settings that they were imported by.
    item, ground = build_meshes(scene)
    show_objects(context.scene, item, ground)
    Session(city=city, imported=None if taken else city).open(item)
    remember_step(item, "import", context.scene.citypv)
    # Objects of the user's stay, and show the city's colours themselves.
    if taken:
        item[Key.TAKEN], item[Key.SEEN], item[Key.METRES] = (
            {},
            True,
            context.scene.unit_settings.scale_length,
        )
        if context.scene.citypv.collection is not None:
            item[Key.TAKEN_FROM] = context.scene.citypv.collection
        remember_wearers(item, taken)
        members.put_in_place(item, scene.site)
        write_sources(item, scene.surfaces.surface_id)
    # Edits count from here.
    begin_design(item, earlier)
    # what comes later beside it is an edit
    item[Key.BESIDE], item[Key.ADDED] = (
        members.list_beside(item),
        "",
    )
    # The view turns to a city of files; the message is the report, with the cities that were
    # hidden.
    if not taken:
        show_city(context, scene.vertices, shaded=True)
    told = keep_report(item, scene, findings)
    return f"{told}; kept, hidden: {', '.join(one.name for one in kept)}" if kept else told


class ImportPanel(StepPanel, bpy.types.Panel):
    """Import."""

    bl_idname, bl_label, bl_order = "CITYPV_PT_import", "1  Import", 4

    def draw(self, context):
        """Show the settings of the step, and the report with its buttons."""
        column, settings, city = self.start(context)
        self.draw_settings(column, settings, "lod", *self.list_settings("import"))
        self.draw_step(column, "citypv.import_city", "IMPORT")
        meshes = self.open_part(column, "citypv_meshes", "Meshes of this scene")
        if meshes:
            meshes.prop(settings, "collection")
            self.draw_step(meshes, "citypv.take_meshes", "OUTLINER_COLLECTION")
        if Key.REPORT not in city:
            return
        box = self.layout.box().column(align=True)
        for sentence in city[Key.REPORT]:
            self.draw_sentence(box, sentence)
        self.layout.operator("citypv.show_report", icon="TEXT")
        row = self.layout.row(align=True)
        row.operator("citypv.select_buildings", icon="HOME")
        row.operator("citypv.deselect", text="", icon="X")
        draw_rows(self, city)
