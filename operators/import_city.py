"""Import: read building files into a City, and show its mesh."""

import os
from dataclasses import replace
from functools import partial
from pathlib import Path

import bpy

from ..core.settings.progress import report_polygons
from .attributes import PREFIX
from .build_meshes import build_meshes, remove_city, show_objects
from .city_files import CityFiles
from .in_place import list_taken
from .keep_report import FILES, keep_report
from .read_preferences import choose_weather, find_preferences
from .read_settings import read_city_path, read_settings
from .run_step import Step
from .session import Session, list_cities, open_session
from .show_city import show_city
from .step_state import remember_step
from .switch_city import show_objects_of
from .watch_edits import remember_shape
from .wear_colours import take_off_colours

SUFFIXES = (".gml", ".xml", ".citygml", ".json", ".jsonl", ".obj", ".gz")  # the file browser shows these


class ImportCity(CityFiles, Step, bpy.types.Operator):
    """Read the buildings of a file or folder (CityGML, CityJSON, OBJ) and show them.

    The same files again take the place of their earlier import; other cities are kept, hidden"""

    bl_idname = "citypv.import_city"
    bl_label = "Import city"
    bl_options = {"REGISTER", "UNDO"}

    stages = {"reading files": 3, "joining polygons": 1, "triangulating": 1}

    def prepare(self, context):
        """Read the paths and options."""
        settings = context.scene.citypv
        choose_weather(settings, find_preferences())
        if self.files and self.directory:
            paths = [str(Path(self.directory, file.name)) for file in self.files if file.name]
        else:
            paths = [bpy.path.abspath(self.filepath) if self.filepath else read_city_path(settings)]
        settings.city_path = paths[0] if len(paths) == 1 else os.path.commonpath(paths)
        return paths, read_settings(settings)

    @staticmethod
    def work(task, progress):
        """Read the files, and triangulate them for display, without generated ground."""
        from ..core.files.read_city import read_city

        paths, request = task
        city = read_city(
            paths, lod=request.lod, unit=request.unit, up=request.up, orient=request.orient, progress=progress
        )
        return triangulate_import(city, request, progress)

    def finish(self, context, result):
        """Show the buildings."""
        return show_import(context, *result)


class ChooseCity(bpy.types.Operator):
    """Choose building files and import them"""

    bl_idname = "citypv.choose_city"
    bl_label = "Import city"

    whole: bpy.props.BoolProperty(
        name="Solar city", description="Run all steps, not only the import", options={"SKIP_SAVE"}
    )
    filter_glob: bpy.props.StringProperty(default=";".join("*" + suffix for suffix in SUFFIXES), options={"HIDDEN"})
    files: bpy.props.CollectionProperty(type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"})
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
    """Return a city, its scene with terrain as read but no generated ground, and the findings of reading."""
    from ..core.results.list_findings import list_findings
    from ..core.scene.build_scene import build_scene
    from ..core.scene.join_ground import show_terrain

    place = {"latitude": request.latitude, "longitude": request.longitude}
    report_share = partial(report_polygons, progress, "triangulating", len(city))
    scene = build_scene(replace(city, terrain=None), **place, ground="none", patch_size=None, report_share=report_share)
    if city.terrain is not None and request.ground == "auto" and request.terrain is None:
        scene = show_terrain(scene, city.terrain)
    # Covered surfaces can only be found once the city is on its ground.
    return city, scene, list_findings(scene, covered_share=[0.0] * len(scene.surfaces))


def show_import(context, city, scene, findings, taken=()):
    """Show a city; the same files' earlier one is replaced, others are hidden. Return the message for the user.

    Parameters
    ----------
    context : bpy.types.Context
    city : core.city.city.City
    scene : core.scene.scene.Scene
    findings : list of core.list_findings.Finding
    taken : list of bpy.types.Object, optional
        The user's objects that are the city; the view then stays where it is.
    """
    kept = put_aside(context.scene, [str(path) for path in scene.report.files], taken)
    item, ground = build_meshes(scene)
    show_objects(context.scene, item, ground)
    open_session(item, Session(city=city))
    remember_step(item, "import", context.scene.citypv)
    remember_shape(item)
    if not taken:
        show_city(scene.vertices, shaded=True)
    return keep_report(item, scene, findings) + (f"; kept, hidden: {', '.join(kept)}" if kept else "")


def put_aside(stage, files, taken=()):
    """Remove cities of the same files from a Blender scene, and hide the others.

    Parameters
    ----------
    stage : bpy.types.Scene
    files : list of str
    taken : list of bpy.types.Object, optional
        The user's objects that it is taken from: then the same objects count, whatever they are called.

    Returns
    -------
    list of str
        Names of the cities that are hidden now.
    """
    for item in list_cities(stage):
        same = {own for _, own, _ in list_taken(item)} == set(taken) and (taken or list(item.get(FILES, ())) == files)
        if same:
            take_off_colours(item)
            remove_city(item, item.get(PREFIX + "ground"))
    kept = list_cities(stage)
    for item in kept:
        show_objects_of(item, visible=False)
    return [item.name for item in kept]
